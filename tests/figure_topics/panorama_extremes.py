"""Topic panorama, extremes: the requirements on each row that measure_extremes prints.

No row may have violations ("lies"): a number that is not finite, a value out of range without its flag, or an error
bound that is exceeded in more than one answer of a hundred (Tally::lies in tests/firmware/estimate/extremes). Flags do
not count against a row: the inputs are extreme.
"""
from figure_topics.rows import at_most, equals, reported

REAL = "generated scenes, double oracle"
# Each of these families must be in the output; a missing one counts as not measured.
FAMILIES = ["scale", "scale_decades", "scale_exposure", "turn", "thousand_lights", "hot_pixel", "sun", "direction",
            "two_lights", "black", "saturated", "nonsense", "huge", "wire", "random_bits", "exposure", "sizes",
            "coverage", "camera_gone", "million_frames"]
MAX_SCALING_DEVIATION = 1e-5  # Relative, before encoding: the answer is proportional to radiance and exposure.
MAX_DIRECTION_DEG = 0.1  # For synthetic lights in any direction.
# Relative change of the answer to constant and cyclic light over the run; the float tolerance of the other rows.
MAX_DRIFT = 1e-5
# One track per lamp, and one more if two lamps that merged separate again.
MAX_TRACKS = 3


def lies(name, item):
    counted = f"{item['answers']:.0f} answers, {100 * item['flagged']:.0f} % flagged, {item['refused']:.0f} refused"
    return equals(f"lies, {name}", 0, item["lies"], "answers", f"{REAL}; {counted}")


def scale(name, item):
    real = f"{REAL}, powers of two"
    return [at_most(f"{name}: deviation from scaling", MAX_SCALING_DEVIATION, item["value"], "", real),
            at_most(f"{name}: deviation of irradiance from scaling", MAX_SCALING_DEVIATION, item["irradiance"], "",
                    real)]


def decades(name, item):
    # Rounding may move a pixel across a threshold, so that the estimator chooses another, equally good answer.
    return [reported(f"{name}: deviation from scaling", item["value"], "", REAL),
            reported(f"{name}: deviation of irradiance from scaling", item["irradiance"], "", REAL)]


def scaled_exposure(name, item):
    return [at_most(f"{name}: deviation from scaling", MAX_SCALING_DEVIATION, item["value"], "", REAL)]


def turn(name, item):
    # A rotated probe has other blocks of pixels: one truth must lie within the bounds of both answers.
    return [equals(f"{name}: turned and not, beyond both bounds", 0, item["beyond_both_bounds"], "answers", REAL),
            reported(f"{name}: difference of irradiance", 100 * item["value"], "%", REAL),
            reported(f"{name}: difference of the strongest light's direction", item["direction_deg"], "deg", REAL)]


def lone_light(name, item):
    return [at_most(f"{name}: direction", MAX_DIRECTION_DEG, item["value"], "deg", REAL)]


def direction(name, item):
    diameter = float(name.split(".", 2)[2].rsplit("_deg", 1)[0])
    wide = f"{name}: direction, lamp {diameter / item['pixel_deg']:.1f} pixels wide"
    if name.endswith(".balanced"):
        return [at_most(wide, MAX_DIRECTION_DEG, item["value"], "deg", REAL)]
    return [reported(wide, item["value"], "deg", REAL)]


def two_lights(name, item):
    return [equals(f"{name}: choices that flicker", 0, item["flickers"], "", REAL),
            equals(f"{name}: numbers that went from lamp to lamp", 0, item["swaps"], "", REAL),
            at_most(f"{name}: numbers given to two lamps", MAX_TRACKS, item["tracks"], "", REAL),
            reported(f"{name}: jump of irradiance between frames beside the truth's", 100 * item["jump"], "%", REAL),
            reported(f"{name}: change of energy between frames beside the truth's", 100 * item["value"], "%", REAL)]


def exposure(name, item):
    return [reported(f"{name}: deviation from scaling, of what was answered", item["value"], "", REAL)]


def sizes(name, item):
    return [reported(f"{name}: largest error of a constant sphere, 1x1 included", item["value"], "", REAL)]


def coverage(name, item):
    return [reported(f"{name}: deviation of the stated share of the sphere", item["value"], "", REAL)]


def million_frames(name, item):
    return [at_most(f"{name}: drift of {what}", MAX_DRIFT, item[what], "", REAL) for what in ("still", "noisy", "lamp")]


REQUIREMENTS = {"scale": scale, "scale_decades": decades, "scale_exposure": scaled_exposure, "turn": turn,
                "hot_pixel": lone_light, "sun": lone_light, "direction": direction, "two_lights": two_lights,
                "exposure": exposure, "sizes": sizes, "coverage": coverage, "camera_gone": coverage,
                "million_frames": million_frames}


def extremes(items):
    rows, seen_families = [], set()
    for item in items:
        name = item["figure"].removeprefix("extremes.")
        family = name.split(".")[0]
        seen_families.add(family)
        if name.endswith(".energy"):
            rows.append(reported(f"{name.removesuffix('.energy')}: largest error of a light's energy",
                                 100 * item["value"], "%", REAL))
        elif name.endswith(".lost"):
            rows.append(equals(f"{name.removesuffix('.lost')}: lights not found", 0, item["value"], "", REAL))
        else:
            rows.append(lies(name, item))
            rows += REQUIREMENTS[family](name, item) if family in REQUIREMENTS else []
    rows += [equals(f"lies, {family}", 0, None, "answers", REAL) for family in FAMILIES if family not in seen_families]
    return rows
