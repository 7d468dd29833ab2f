"""Topic specular: the surface light field of a glossy plane (firmware/estimate/specular), on sequences of the reference
renderer. Scenes, seeds and lengths are in tests/measure/specular_sequences.cpp.

Capture, separation, re-rendering and the light found are measured, and aarch64 instructions of a frame are counted.
Guidance and the board are not. Shadows: topic shadows.
"""

import tempfile

from figure_topics import aarch64
from figure_topics.programs import rows_of_program, side_by_side
from figure_topics.rows import at_least, at_most, equals, reported
from figure_topics.tests import ROOT

TARGETS = ["measure_specular", "measure_specular_extremes", "measure_specular_light"]
REAL = ("rendered by tests/reference (compared with Mitsuba), 640x480 8-bit sRGB frames with noise, "
        "poses off by 0.3 deg and 1 mm")
RMSE = 0.029
TRADE_SEQUENCE = "office 0.45"
STEP_MS = 15  # Extra time of a frame by the light's estimate.
WORK = (20, 40)  # Frames of the two counted runs.
# Jachnik et al. 2012, table 1: three views of real books.
PUBLISHED_RMSE = (0.0292, 0.0489, 0.1160)


def views(line):
    """Rows of a line of measure_specular."""
    if "method" not in line:
        return [reported(f"{line['sequence']}: error of the texture's place on the plane", line["alignment_error_mm"],
                         "mm", REAL)]
    what = f"{line['sequence']}: {line['method']} poses: "
    real = f"{REAL}; {100 * line['saturated']:.1f} % saturated, {100 * line['unseen']:.0f} % in unseen directions"
    if line["method"] == "ours, refined":
        figure = at_most(what + "RMSE of held-out views", RMSE, line["rmse"], "of full scale", real)
    else:
        figure = reported(what + "RMSE of held-out views", line["rmse"], "of full scale", real)
    return [figure,
            reported(what + "the same in directions that a frame saw", line["rmse_seen"], "of full scale", real),
            reported(what + "largest difference of gradients", line["max_gradient_difference"],
                     "of full scale a pixel", real)]


# What the description alone does.
CONTROL = " of a descriptor made from the true environment"
# si-RMSE of three balls, tone-mapped as in the literature (tests/measure/three_balls.hpp).
BALLS = {"diffuse": 0.08, "matte silver": 0.20, "mirror": 0.42}


def light_times(what, line):
    """Times of a frame, and of the step of the light's estimate in it."""
    copy = line["memcpy_ms"]
    real = f"640x480, one thread; memcpy of the frame {copy:.3f} ms"
    step = "step of the light's estimate"
    rows = [at_most(f"{what}: {step}, 95 % quantile of the frames with one", STEP_MS, line.get("light_q95_ms"), "ms",
                    real)]
    for part, key in ((f"{step}, largest", "light_max_ms"), ("time of a frame, median", "ms"),
                      ("time of a frame, 95 % quantile", "q95_ms"), ("time of a frame, largest", "max_ms")):
        rows.append(reported(f"{what}: {part}", line.get(key), "ms", real))
    for part, key in ((f"{step}, 95 % quantile", "light_q95_ms"), (f"{step}, largest", "light_max_ms"),
                      ("time of a frame, 95 % quantile", "q95_ms"), ("time of a frame, largest", "max_ms")):
        ms = line.get(key)
        rows.append(reported(f"{what}: {part}, relative to memcpy of the frame", ms and ms / copy, "x", real))
    frames = f"{line.get('estimates')} estimates"
    for part, key in (("frames of an estimate, median", "estimate_frames"),
                      ("frames of an estimate, at most", "estimate_max_frames"),
                      ("age of the light's capture in a descriptor, median", "age_frames"),
                      ("age of the light's capture in a descriptor, at most", "max_age_frames")):
        rows.append(reported(f"{what}: {part}", line.get(key), "frames", frames))
    return rows


def light(line, white=""):
    """Rows of a line of measure_specular_light. `white`: what is known of the plane's white."""
    what = f"{line['sequence']}: light{white}"
    if "final_error" in line:
        real = (f"{REAL}; alpha {line['alpha']:.3f} (true {line['true_alpha']}), {100 * line['seen']:.0f} % of the "
                f"directions seen; {100 * line['unsure']:.0f} % of the answers with a bound are unsure")
        return [reported(f"{what}: error of the irradiance after the capture", 100 * line["final_error"], "%", real),
                at_least(f"{what}: frames with a finite bound", 80, 100 * line["bounded"], "%", real),
                at_least(f"{what}: of those, errors within the bound", 95, 100 * line["held"], "%", real),
                at_most(f"{what}: bound relative to error, median", 4, line["bound_to_error"], "x", real),
                at_most(f"{what}: squared Mahalanobis distance of lights, 95 % quantile, answers that are sure",
                        11.83, line["mahalanobis_q95"], "", real),
                reported(f"{what}: the same, from the lights{CONTROL}", line["mahalanobis_of_control_q95"], "", real),
                ] + light_times(what, line)
    if line.get("light") == 0:
        strongest = f"{what}: direction of the strongest light"
        return [at_most(strongest, 2, line["error_deg"], "deg", REAL),
                at_most(f"{strongest}, answer and truth both blurred by the lobe", 2, line["mirrored_error_deg"],
                        "deg", REAL),
                reported(f"{strongest},{CONTROL}", line["control_error_deg"], "deg", REAL),
                reported(f"{strongest}, blurred,{CONTROL}", line["control_mirrored_error_deg"], "deg", REAL)]
    if "light" in line:
        share = f"{100 * line['relative_irradiance']:.0f} % of the strongest"
        return [at_most(f"{what}: direction of light {line['light']}", 5, line["error_deg"], "deg",
                        f"{REAL}; {share}")]
    ball = f"{what}: {line['ball']} ball, si-RMSE, the literature's protocol"
    return [at_most(ball, BALLS[line["ball"]], line["si_rmse_published"], "", REAL),
            reported(f"{ball}, answer and truth both blurred by the lobe", line["si_rmse_both_blurred"], "", REAL),
            reported(f"{ball},{CONTROL}", line["control_si_rmse_published"], "", REAL),
            reported(f"{what}: {line['ball']} ball, si-RMSE, linear light", line["si_rmse"], "", REAL)]


def extremes(line):
    """Rows of a line of measure_specular_extremes: an answer that is neither unseen nor unsure, and has a finite bound,
    must be within its bound, and its strongest light must be one of the scene's."""
    what = f"extremes, {line['extreme']}"
    real = (f"{REAL}; {line['answers']} answers, {line['bounded']} with a bound, {line['sure']} sure; at the end "
            f"{', '.join(line['flags']) or 'no flag'}")
    return [equals(f"{what}: answers that are not finite", 0, line["not_finite"], "answers", real),
            equals(f"{what}: sure, beyond the bound", 0, line["confidently_wrong"], "answers", real),
            equals(f"{what}: sure, with a strongest light that the scene does not have", 0, line["false_lights"],
                   "answers", real),
            reported(f"{what}: error of the irradiance in the last answer", 100 * line["last_error"], "%", real)]


def speed(line):
    real = f"one capture with refined poses, 640x480, one thread; memcpy {line.get('memcpy_gb_s', 0):.1f} GB/s"
    return [at_most("capture of a frame, median", 10, line.get("ms"), "ms", real),
            reported("capture of a frame, ninth decile", line.get("decile_ms"), "ms", real),
            reported("capture of a frame, relative to memcpy of the frame", line.get("memcpy_ratio"), "x", real),
            reported("capture of a frame, relative to cv::warpPerspective of the plane to 256x256",
                     line.get("warp_perspective_ratio"), "x", real)]


def memory(line):
    real = (f"the estimator with all defaults and its captured plane, {line.get('sequence')}, light field of "
            f"{line.get('light_field_mb', 0):.0f} MB")
    return [at_most("peak growth of memory, 60 levels, 256x256 texels", 200, line.get("peak_growth_mb"), "MB", real)]


def trade(line):
    """Rows of a line of `measure_specular --trade --fill`."""
    what = f"{line['levels']} levels, {line['texels']}x{line['texels']} texels"
    if line["every"] > 1:
        what += f", every {line['every']} frames"
    if line["fill_limit"] < 1:
        what += f", ended at {100 * line['fill_limit']:g} % of the light field"
    real = (f"{line['sequence']}, {line['stored']} of {line['frames']} frames stored, "
            f"{100 * line['fill']:.1f} % filled, {100 * line['unseen']:.0f} % of the pixels in unseen directions; "
            f"{REAL}")
    return [reported(f"{what}: capture of a frame, median", line["ms"], "ms", real),
            reported(f"{what}: memory of the light field", line["mb"], "MB", real),
            reported(f"{what}: RMSE of held-out views", line["rmse"], "of full scale", real),
            reported(f"{what}: the same, the published way", line["rmse_published_way"], "of full scale", real)]


def instructions(say):
    folder, _ = aarch64.build(["measure_instructions"], say)
    command = [folder / "measure_instructions", "--frames", "{}", "plane"] if folder else None
    counted = aarch64.instructions(command, WORK) if command else None
    return [reported("aarch64 (NEON) instructions of a frame", counted and counted / 1e6, "millions",
                     "640x480 sRGB, 256x256 texels, frames 21 to 40 of a sequence, counted under qemu-user")]


# Part: program, its arguments, rows of a line that it prints. A last "--frames": it reads and keeps rendered frames.
PARTS = {
    "speed": ("measure_specular", ("--speed", "--frames"), speed),
    "memory": ("measure_specular_light", ("--memory", "--frames"), memory),
    "trade": ("measure_specular", ("--trade", "--fill", "--sequence", TRADE_SEQUENCE, "--frames"), trade),
    "light": ("measure_specular_light", ("--frames",), light),
    "extremes": ("measure_specular_extremes", (), extremes),
    "views": ("measure_specular", ("--frames",), views),
    "white": ("measure_specular_light", ("--white-given", "--frames"), lambda line: light(line, " with given white")),
    "instructions": None,
}
UNTIMED = "extremes", "views", "white"


def measure(programs, say, only=tuple(PARTS)):
    """Programs with times run one at a time, the others beside each other. All read the same rendered frames (a
    megabyte each, removed at the end), which the first one that needs them renders."""
    with tempfile.TemporaryDirectory(dir=ROOT / "build", prefix="frames-") as frames:

        def rows_of(part):
            program, arguments, rows = PARTS[part]
            folder = [frames] if arguments[-1:] == ("--frames",) else []
            return rows_of_program([programs / program, *arguments, *folder], rows, say)

        for part in ("speed", "memory", "trade", "light"):
            if part in only:
                yield from rows_of(part)
        yield from side_by_side(rows_of(part) for part in UNTIMED if part in only)
    if "instructions" in only:
        yield from instructions(say)
