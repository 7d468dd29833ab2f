"""Part relight of topic light_field: relit performances (lightwell/relight.hpp) against pictures that
tests/reference/relight traces with all bounces: a figurine with wrinkled and concave parts, 320x240, photographed
under 29 basis lights, in the light of Venetian blinds and of a stained-glass projector, each at a basis light and
between basis lights. Errors are RMS differences of linear radiance over the pixels that the subject covers whole.
Scenes, seeds and thresholds were committed before anything was measured.
"""
from figure_topics.programs import rows_of_program
from figure_topics.rows import at_least, at_most, known_short, reported, row
from figure_topics.tests import ROOT

TARGETS = ["measure_relight"]

# RMSE without the correction for indirect light, relative to that with it.
CORRECTION_GAIN = 2
FRAMES_PER_S, RESIDENT_MB = 24, 500

REAL = "path-traced with all bounces, 320x240, 29 basis lights; linear RMSE over the subject"
NOT_HERE = "measure_relight was not built: it needs Embree (libembree-dev)"
INPUTS = {"mesh": "whole mesh, albedo and normals of what the camera sees given",
          "exact": "depth, albedo and normals of what the camera sees given",
          "photographs": "albedo and normals from the 29 photographs, depth with 3 mm of noise, refined"}


HIDDEN = "a depth map lacks what the camera does not see, from where half of this scene's indirect light comes"
BETWEEN = "between basis lights the direct part has the highlights and shadow edges of the nearest lights"


def gain_row(name, line, real):
    figure = at_least(name, CORRECTION_GAIN, line["rmse_direct"] / line["rmse_corrected"], "x", real)
    if line["inputs"] != "mesh":
        return known_short(figure, HIDDEN)
    return known_short(figure, BETWEEN) if "between" in line["scene"] else figure


def accuracy_rows(line):
    what = f"{line['scene']}, {line['inputs']}: "
    real = f"{REAL}; {INPUTS[line['inputs']]}; {line['lit_from']}"
    return [reported(what + "RMSE without correction (equation 1)", line["rmse_direct"], "radiance", real),
            reported(what + "RMSE with correction (equation 5)", line["rmse_corrected"], "radiance", real),
            gain_row(what + "RMSE without correction relative to that with it", line, real),
            reported(what + "the same with one bounce, as the paper",
                     line["rmse_direct"] / line["rmse_one_bounce"], "x", real),
            reported(what + "the same where the pattern is dark", line["dark_direct"] / line["dark_corrected"], "x",
                     f"{real}; {100 * line['dark_share']:.0f} % of the subject")]


def indirect_row(line):
    name = (f"indirect light: {line['samples']} samples, step {line['step']}, {line['bounces']} bounces: "
            "RMSE relative to its RMS")
    return reported(name, 100 * line["error"], "%",
                    f"{line['scene']}, whole mesh; {line['ms']:.0f} ms for {line['lights']} lights on one thread, "
                    f"{line['simulated']} simulated pixels; noise of the truth included")


def stream_rows(line):
    real = (f"{line['columns']}x{line['rows']}, {line['basis']} photographs and {line['patterns']} patterns a frame, "
            f"{line['frame_mb']:.1f} MB a frame from disk ({line['cache']}), one thread; "
            f"memcpy {line['memcpy_gb_s']:.1f} GB/s")
    frames_per_s = 1e3 / line["frame_ms"]
    return [at_least(f"direct part, {line['cache']}: frames a second", FRAMES_PER_S, frames_per_s, "1/s", real),
            reported(f"direct part, {line['cache']}: time relative to reading and scaling the same bytes",
                     line["frame_ms"] / line["scale_ms"], "x", f"{real}; that takes {line['scale_ms']:.1f} ms"),
            at_most(f"direct part, {line['cache']}: resident memory", RESIDENT_MB, line["resident_mb"], "MB", real),
            reported(f"direct part, {line['cache']}: alpha of all patterns for new geometry", line["alpha_ms"], "ms",
                     f"{real}; not in the time of a frame: geometry stands still")]


def motion_rows(line):
    what = f"subject that moves by {line['px_per_cycle']:.0f} px in a cycle of 29 photographs: "
    real = ("path-traced, 320x240, moving sideways; lit by all lights and by blinds; against the same relit from "
            "photographs of a subject that stands still")
    return [reported(what + "RMSE without alignment", line["unaligned"], "radiance", real),
            reported(what + "RMSE with alignment", line["aligned"], "radiance", real),
            at_least(what + "RMSE without alignment relative to with", 1, line["unaligned"] / line["aligned"], "x",
                     f"{real}; {line['ms']:.0f} ms for 29 photographs")]


def rows_of(line):
    if line["part"] == "accuracy":
        return accuracy_rows(line)
    if line["part"] == "motion":
        return motion_rows(line)
    return [indirect_row(line)] if line["part"] == "indirect" else stream_rows(line)


def measure_relight(programs, say):
    """Yields the rows. Renders photographs and truth into a folder beside the programs, once."""
    program = programs / "measure_relight"
    if not program.exists():
        yield row("relighting", "measured", "not measured", "", False, NOT_HERE)
        return
    picture = ROOT / "out/relight.png"
    picture.parent.mkdir(exist_ok=True)
    yield from rows_of_program([program, "--renders", programs.parent / "relight_renders", "--picture", picture],
                               rows_of, say)
    say(f"photograph, equation 1, equation 5, truth: {picture}")
