"""Topic shadows: textures of the shadows that virtual objects cast on a plane (ShadowCaster of host_sdk), against the
ray tracer of tests/reference. Objects, lights and seeds are in tests/host_sdk/shadow_scenes.cpp.
"""

from figure_topics.marker import items_of
from figure_topics.rows import at_most, reported, row

TARGETS = ["measure_shadows"]
# A little less than a frame of 60 Hz.
MS = 16
# As AgreeWithTheRayTracer of tests/host_sdk/shadows_accuracy_test.cpp, whose scenes have fewer triangles.
RMS, PERCENTILE_99 = 0.012, 0.036
UNCONNECTED = "leaves"


def rows_of(line):
    what = f"{line['scene']}: {line['setting']}: "
    real = (f"{line['triangles']:,} triangles, 256x256 texels, {line['directions']} directions, one thread; "
            f"memcpy {line['memcpy_gb_s']:.1f} GB/s")
    limited = line["setting"] == "default" and not line["scene"].startswith(UNCONNECTED)
    figure = at_most if limited else lambda name, limit, *rest: reported(name, *rest)
    rows = [figure(what + "time of a texture, median", MS, line.get("ms"), "ms", real),
            figure(what + "RMS error of the ratio", RMS, line.get("rms"), "", real),
            figure(what + "99 % of the errors are below", PERCENTILE_99, line.get("percentile_99"), "", real)]
    if line["setting"] == "default":
        rows += [reported(what + "RMS error where the object takes light", line.get("rms_shadowed"), "", real),
                 reported(what + "largest error", line.get("largest"), "", real),
                 reported(what + "time of a caster's first texture", line.get("first_ms"), "ms", real),
                 reported(what + "time relative to memcpy of a frame of 640x480 RGB", line.get("memcpy_ratio"), "x",
                          real),
                 reported(what + "time relative to cv::warpPerspective to 256x256", line.get("warp_perspective_ratio"),
                          "x", real)]
    return rows


def measure(programs, say):
    lines = items_of([programs / "measure_shadows"], say)
    return [r for line in lines for r in rows_of(line)] or [
        row("scenes", "measured", "not measured", "", False, "the ray tracer of tests/reference")]
