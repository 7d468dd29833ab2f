"""Topic panorama, the extremes: what is asked of each row that measure_extremes prints.

Of every row no answer may be a lie: a number that is not finite, what is out of range without its flag, and a bound
that is missed in more than one answer of a hundred (Tally::lies in tests/firmware/estimate/extremes). Flags are not
counted against these rows: to be flagged is what they ask for.
"""
from figure_topics.rows import at_most, equals, reported

REAL = "generated scenes, double oracle"
# Every one of these families has to come, or it was not measured.
FAMILIES = ["scale", "scale_decades", "scale_exposure", "turn", "thousand_lights", "hot_pixel", "sun", "direction",
            "two_lights", "black", "saturated", "nonsense", "huge", "wire", "random_bits", "exposure", "sizes",
            "coverage", "camera_gone", "million_frames"]
ANSWER_SCALES = 1e-5  # The answer scales with radiance and with exposure: before the wire.
DIRECTION_DEG = 0.1   # Synthetic lights anywhere.
# Still and cyclic light comes back as it was: what floats promise elsewhere.
DRIFT = 1e-5
# A lamp's number, and one more where lamps that were one part again.
MOST_TRACKS = 3


def lies(name, item):
    counted = f"{item['answers']:.0f} answers, {100 * item['flagged']:.0f} % flagged, {item['refused']:.0f} refused"
    return equals(f"lies, {name}", 0, item["lies"], "answers", f"{REAL}; {counted}")


def scale(name, item):
    real = f"{REAL}, powers of two"
    return [at_most(f"{name}: deviation from scaling", ANSWER_SCALES, item["value"], "", real),
            at_most(f"{name}: deviation of irradiance from scaling", ANSWER_SCALES, item["irradiance"], "", real)]


def decades(name, item):
    # Pixels that are rounded anew may fall on the other side of a threshold, and another, as good answer be chosen.
    return [reported(f"{name}: deviation from scaling", item["value"], "", REAL),
            reported(f"{name}: deviation of irradiance from scaling", item["irradiance"], "", REAL)]


def scaled_exposure(name, item):
    return [at_most(f"{name}: deviation from scaling", ANSWER_SCALES, item["value"], "", REAL)]


def turn(name, item):
    # Blocks lie elsewhere in a turned probe: what is asked is that one truth lies within the bounds of both answers.
    return [equals(f"{name}: turned and not, beyond both bounds", 0, item["beyond_both_bounds"], "answers", REAL),
            reported(f"{name}: difference of irradiance", 100 * item["value"], "%", REAL),
            reported(f"{name}: difference of the strongest light's direction", item["direction_deg"], "deg", REAL)]


def lone_light(name, item):
    return [at_most(f"{name}: direction", DIRECTION_DEG, item["value"], "deg", REAL)]


def direction(name, item):
    diameter = float(name.split(".", 2)[2].rsplit("_deg", 1)[0])
    wide = f"{name}: direction, lamp {diameter / item['pixel_deg']:.1f} pixels wide"
    if name.endswith(".balanced"):
        return [at_most(wide, DIRECTION_DEG, item["value"], "deg", REAL)]
    return [reported(wide, item["value"], "deg", REAL)]


def two_lights(name, item):
    return [equals(f"{name}: choices that flicker", 0, item["flickers"], "", REAL),
            equals(f"{name}: numbers that went from lamp to lamp", 0, item["swaps"], "", REAL),
            at_most(f"{name}: numbers given to two lamps", MOST_TRACKS, item["tracks"], "", REAL),
            reported(f"{name}: jump of irradiance between frames beside the truth's", 100 * item["jump"], "%", REAL),
            reported(f"{name}: change of energy between frames beside the truth's", 100 * item["value"], "%", REAL)]


def exposure(name, item):
    return [reported(f"{name}: deviation from scaling, of what was answered", item["value"], "", REAL)]


def sizes(name, item):
    return [reported(f"{name}: largest error of a constant sphere, 1x1 included", item["value"], "", REAL)]


def seen(name, item):
    return [reported(f"{name}: deviation of the stated share of the sphere", item["value"], "", REAL)]


def million_frames(name, item):
    return [at_most(f"{name}: drift of {what}", DRIFT, item[what], "", REAL) for what in ("still", "noisy", "lamp")]


JUDGES = {"scale": scale, "scale_decades": decades, "scale_exposure": scaled_exposure, "turn": turn,
          "hot_pixel": lone_light, "sun": lone_light, "direction": direction, "two_lights": two_lights,
          "exposure": exposure, "sizes": sizes, "coverage": seen, "camera_gone": seen, "million_frames": million_frames}


def extremes(items):
    rows, came = [], set()
    for item in items:
        name = item["figure"].removeprefix("extremes.")
        family = name.split(".")[0]
        came.add(family)
        if name.endswith(".energy"):
            rows.append(reported(f"{name.removesuffix('.energy')}: largest error of a light's energy",
                                 100 * item["value"], "%", REAL))
        elif name.endswith(".lost"):
            rows.append(equals(f"{name.removesuffix('.lost')}: lights not found", 0, item["value"], "", REAL))
        else:
            rows.append(lies(name, item))
            rows += JUDGES[family](name, item) if family in JUDGES else []
    rows += [equals(f"lies, {family}", 0, None, "answers", REAL) for family in FAMILIES if family not in came]
    return rows
