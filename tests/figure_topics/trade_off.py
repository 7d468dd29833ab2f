"""Topic trade_off: what a cheaper frame costs in accuracy. So far: interleaved sampling of the panorama estimator
(panorama.interleave; firmware/estimate/README.md). Motions, exposure and scenes are in
tests/measure/measure_interleave.cpp.
"""

from figure_topics import aarch64
from figure_topics.programs import rows_of_program
from figure_topics.rows import at_least, at_most, known_short, reported

TARGETS = ["measure_interleave"]
ALL_PANORAMAS = True
# The cheapest point, and what is asked of it.
CHEAPEST = 16
INSTRUCTIONS = {"rgb8_linear": 1.5, "yuyv": 2.5}
MEDIAN_ERROR, WORST_ERROR = 0.02, 0.04
HELD = 0.999
FORMATS = {"rgb8_linear": "linear RGB8", "rgb8": "sRGB RGB8", "bayer8": "Bayer8", "nv12": "NV12", "yuyv": "YUYV"}
INTERLEAVES = (1, 2, 4, 8, 16)
# Frames of the two counted runs: whole rotations of 16.
WORK = (33, 65)
FIXED_WORK = "what a frame costs beside its pixels: runs of lights, projections of runs, search for lights"
PIXELS = 1280 * 960


def interleave_rows(line):
    read, unread = line["read"], line["unread"]
    what = f"{line['motion']}, interleave {line['interleave']}: "
    real = (f"{line['scenes']} real panoramas, {read['frames']} frames of 2 x 640x480 Bayer12 with noise, "
            f"{read['flagged']} flagged")
    judged = read["frames"] - read["flagged"]
    asked = line["interleave"] == CHEAPEST and line["motion"] == "still"
    error = (lambda name, limit, *rest: at_most(name, limit, *rest)) if asked else (
        lambda name, limit, *rest: reported(name, *rest))
    rows = [reported(what + "difference of the irradiance to that of whole frames, median", read["median_difference"],
                     "", real),
            reported(what + "the same, largest", read["worst_difference"], "", real),
            error(what + "error of the irradiance, median", MEDIAN_ERROR, read["median_error"], "", real),
            error(what + "error of the irradiance, largest", WORST_ERROR, read["worst_error"], "", real),
            at_least(what + "share of frames within the bound", HELD, read["held"] / judged if judged else None, "",
                     real),
            reported(what + "bound over error, median", read["median_ratio"], "", real)]
    if unread["frames"]:
        rows += [reported(what + "frames between a lamp's switch and its being read: share within the bound",
                          unread["held"] / max(unread["frames"] - unread["flagged"], 1), "",
                          f"{unread['frames']} frames, {unread['flagged']} flagged"),
                 reported(what + "the same: largest error", unread["worst_error"], "", real)]
    return rows


def counted_rows(say):
    folder, _ = aarch64.build(["measure_instructions"], say)
    for name, text in FORMATS.items():
        for interleave in INTERLEAVES:
            say(f"aarch64: {text}, interleave {interleave}")
            counted = folder and aarch64.instructions(
                [folder / "measure_instructions", "--interleave", str(interleave), "--frames", "{}", "single", name,
                 "fast"], WORK)
            what = f"aarch64 (NEON) instructions a pixel, fast, {text}, interleave {interleave}"
            real = "city.exr, one lens of 1280x960, constant light, g++ -O3, qemu-user Cortex-A72"
            value = counted / PIXELS if counted else None
            limit = INSTRUCTIONS.get(name) if interleave == CHEAPEST else None
            if not limit:
                yield reported(what, value, "", real)
                continue
            figure = at_most(what, limit, value, "", real)
            yield figure if figure["holds"] else known_short(figure, FIXED_WORK)


def measure(programs, say):
    yield from rows_of_program([programs / "measure_interleave"], interleave_rows, say)
    yield from counted_rows(say)
