"""Topic shadows: virtual objects on a real plane. Textures of the shadows that they cast (ShadowCaster of host_sdk) and
of their reflections in a glossy plane (PlaneReflector), against the ray tracers of tests/reference; the light that the
plane reflects onto them (PlaneLight), against a quadrature. Objects, lights and seeds are in
tests/host_sdk/shadow_scenes.cpp and reflection_scenes.cpp.
"""

from figure_topics.marker import items_of
from figure_topics.rows import at_most, reported, row

TARGETS = ["measure_shadows", "measure_reflection"]
# A little less than a frame of 60 Hz.
MS = 16
# As AgreeWithTheRayTracer of tests/host_sdk/shadows_accuracy_test.cpp, whose scenes have fewer triangles.
RMS, PERCENTILE_99 = 0.012, 0.036
UNCONNECTED = "leaves"
# As AgreesWithTheRayTracer of tests/host_sdk/plane_reflection_test.cpp, and as OfATextureAgreesWithTheQuadrature.
REFLECTION_RMS, REFLECTION_TO_SHARP, LIGHT_RMS = 0.2, 0.55, 0.01


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


def reflection_rows(line):
    if line["scene"] == "light of a plane":
        real = "100 points up to 0.3 m above 256x256 texels, random normals, one thread"
        return [at_most("light of a plane: RMS error of D's irradiance, relative to its RMS", LIGHT_RMS,
                        line.get("rms"), "", real),
                reported("light of a plane: RMS error of S's irradiance, relative to its RMS", line.get("specular_rms"),
                         "", real),
                reported("light of a plane: time of a query, D", line.get("diffuse_us"), "us", real),
                reported("light of a plane: time of a query, D and S", line.get("both_us"), "us", real),
                reported("light of a plane: time of an update", line.get("update_ms"), "ms", real)]
    what = f"reflection, {line['scene']}: {line['setting']}: "
    real = f"{line['triangles']:,} triangles, 256x256 texels, one thread; memcpy {line['memcpy_gb_s']:.1f} GB/s"
    rms, sharp = line.get("rms"), line.get("sharp_rms")
    rows = [reported(what + "time of a texture, median", line.get("ms"), "ms", real),
            reported(what + "RMS error of the radiance, relative to its RMS", rms, "", real)]
    if line["setting"] == "default":
        rows = [rows[0],
                at_most(what + "RMS error of the radiance, relative to its RMS", REFLECTION_RMS, rms, "", real),
                reported(what + "the same of the sharp mirror image", sharp, "", real),
                at_most(what + "error relative to that of the sharp mirror image", REFLECTION_TO_SHARP,
                        rms / sharp if rms is not None and sharp else None, "", real),
                reported(what + "RMS error of the hidden share", line.get("hidden_rms"), "", real),
                reported(what + "RMS error of the remaining reflection of a room with a window, relative to its RMS",
                         line.get("room_rms"), "", real),
                reported(what + "the same with the sharp hidden share", line.get("sharp_room_rms"), "", real),
                reported(what + "time relative to memcpy of a frame of 640x480 RGB", line.get("memcpy_ratio"), "x",
                         real)]
    return rows


def measure(programs, say):
    lines = items_of([programs / "measure_shadows"], say)
    reflections = items_of([programs / "measure_reflection"], say)
    rows = [r for line in lines for r in rows_of(line)] + [r for line in reflections for r in reflection_rows(line)]
    return rows or [
        row("scenes", "measured", "not measured", "", False, "the ray tracer of tests/reference")]
