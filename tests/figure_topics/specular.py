"""Topic specular: the surface light field of a glossy plane (firmware/estimate/specular), on sequences of the reference
renderer. Scenes, seeds and lengths are in tests/measure/specular_sequences.cpp.

Capture, separation and re-rendering are measured. Light from the specular part, guidance, extremes and the
board are not.
"""

from figure_topics.marker import items_of
from figure_topics.rows import at_most, known_short, reported, row

TARGETS = ["measure_specular"]
REAL = ("rendered by tests/reference (compared with Mitsuba), 640x480 8-bit sRGB frames with noise, "
        "poses off by 0.3 deg and 1 mm")
RMSE = 0.029
# Jachnik et al. 2012, table 1: three views of real books.
PUBLISHED_RMSE = (0.0292, 0.0489, 0.1160)
SHORT = dict.fromkeys(
    ("living room 0.32", "living room 0.17", "interior 0.32", "lamps 0.17", "studio 0.17, saturated"),
    "pixels in grazing directions that no frame saw; at most 0.027 in the others")


def views(lines):
    rows = []
    for line in lines:
        if "method" not in line:
            continue
        what = f"{line['sequence']}: {line['method']} poses: "
        real = f"{REAL}; {100 * line['saturated']:.1f} % saturated, {100 * line['unseen']:.0f} % in unseen directions"
        if line["method"] == "ours, refined":
            figure = at_most(what + "RMSE of held-out views", RMSE, line["rmse"], "of full scale", real)
            short = SHORT.get(line["sequence"])
            rows.append(known_short(figure, short) if short and not figure["holds"] else figure)
        else:
            rows.append(reported(what + "RMSE of held-out views", line["rmse"], "of full scale", real))
        rows.append(reported(what + "the same in directions that a frame saw", line["rmse_seen"], "of full scale",
                             real))
        rows.append(reported(what + "largest difference of gradients", line["max_gradient_difference"],
                             "of full scale a pixel", real))
    return rows or [row("sequences", "measured", "not measured", "", False, REAL)]


def speed(line):
    real = f"one capture with refined poses, 640x480, one thread; memcpy {line.get('memcpy_gb_s', 0):.1f} GB/s"
    return [known_short(at_most("capture of a frame, median", 10, line.get("ms"), "ms", real),
                        "half of the time is the refinement of the pose"),
            reported("capture of a frame, ninth decile", line.get("decile_ms"), "ms", real),
            reported("capture of a frame, relative to memcpy of the frame", line.get("memcpy_ratio"), "x", real),
            reported("capture of a frame, relative to cv::warpPerspective of the plane to 256x256",
                     line.get("warp_perspective_ratio"), "x", real),
            at_most("peak growth of memory, 60 levels, 256x256 texels, about 430 directions a texel visited", 200,
                    line.get("peak_growth_mb"), "MB", real)]


def measure(programs, say):
    times = items_of([programs / "measure_specular", "--speed"], say)
    rows = speed(next((line for line in times if line.get("figure") == "speed"), {}))
    return rows + views(items_of([programs / "measure_specular"], say))
