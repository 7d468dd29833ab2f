"""Part rooms of the topic light_field: LightField in path-traced rooms (tests/reference/mitsuba/field, whose README
defines the errors and which points are visible). Rooms, seed and limits were fixed before the first measurement.
"""
from figure_topics.marker import items_of
from figure_topics.rows import at_least, at_most, known_short, reported

TARGETS = ["measure_field"]

ROOMS, LAMPS = 3, 9
DIRECTION_DEG, IRRADIANCE, LAMP = 3, 0.12, 0.03
BOUND_HOLDS, BOUND_FINITE, BOUND_TO_ERROR = 0.95, 0.8, 4
QUERY_US = {"field": 2, "field with geometry": 20}

REAL = "4 probes: panorama estimator behind a simulated 8-bit pair, encoded descriptors; 200 points; Mitsuba's light"


# Requirements that rows are known to miss.
NO_PARALLAX = "without geometry nothing tells how the light of walls changes between probes, nor what hides a lamp"
UNLISTED = "at a fifth of the points the strongest is the window, which the probes hold in their harmonics"
WIDE = "the error is smaller than the probes can show: the bound is 9 % above its limit"
SHORT = {("square, field", "irradiance"): NO_PARALLAX, ("corridor, field", "irradiance"): NO_PARALLAX,
         ("corner, field", "irradiance"): NO_PARALLAX, ("corner, field", "bound"): NO_PARALLAX,
         ("corridor, field with geometry", "width"): WIDE,
         ("corridor, field", "direction"): UNLISTED, ("corridor, field with geometry", "direction"): UNLISTED}


def unless_short(kind, what, figure):
    reason = SHORT.get((what, kind))
    return known_short(figure, reason) if reason else figure


REAL_OFF = REAL + "; poses off by 0.5 degrees and 10 mm, as their covariances say"


def scale_rows(line):
    what = f"{line['room']}, four unknown scales"
    return [reported(f"{what}: probes brought together", line["scales_used"], "", REAL),
            reported(f"{what}: largest error of the factors between them", line["scale_error"], "", REAL)]


def point_rows(line):
    what, visible = f"{line['room']}, {line['method']}", ", visible points"
    if line["method"] == "nearest probe":
        return [reported(f"{what}: RMS error of irradiance{visible}", line["irradiance_rms_visible"], "", REAL),
                reported(f"{what}: error of the strongest light's direction, median{visible}",
                         line["direction_median_visible_deg"], "deg", REAL)]
    if line["method"] not in QUERY_US:
        return [reported(f"{what}: RMS error of irradiance{visible}", line["irradiance_rms_visible"], "", REAL_OFF),
                reported(f"{what}: points at which the bound holds", line["bound_holds"], "", REAL_OFF)]
    direction = f"{what}: error of the strongest light's direction, "
    return [unless_short("irradiance", what, at_most(f"{what}: RMS error of irradiance{visible}", IRRADIANCE,
                                                     line["irradiance_rms_visible"], "", REAL)),
            reported(f"{what}: RMS error of irradiance, all points", line["irradiance_rms"], "", REAL),
            at_most(f"{direction}median{visible}", DIRECTION_DEG, line["direction_median_visible_deg"], "deg", REAL),
            unless_short("direction", what, at_most(f"{direction}90 %{visible}", DIRECTION_DEG,
                                                    line["direction_90_visible_deg"], "deg", REAL)),
            unless_short("bound", what, at_least(f"{what}: points at which the bound holds", BOUND_HOLDS,
                                                 line["bound_holds"], "", REAL)),
            at_least(f"{what}: visible points with a finite bound", BOUND_FINITE, line["bound_finite_visible"], "",
                     REAL),
            unless_short("width", what, at_most(f"{what}: bound by error, median", BOUND_TO_ERROR,
                                                line["bound_to_error_median"], "", REAL))]


def lamp_row(line):
    off = ", poses with errors" if line["lamps"] != "field" else ""
    what = f"{line['room']}, {'window' if line['window'] else 'lamp'} {line['lamp']}{off}: "
    name = what + "error of its position by its distance from the nearest probe"
    if line["window"] or off:
        return reported(name, line["relative"], "", REAL)
    return at_most(name, LAMP, line["relative"], "", REAL)


def speed_rows(line):
    what = f"{line['room']}, {line['speed']}: "
    real = f"one thread; memcpy {line['memcpy_gb_s']:.1f} GB/s"
    return [at_most(what + "a query, at()", QUERY_US[line["speed"]], line["at_us"], "us", real),
            reported(what + "at() by Lighting::irradiance() of one probe", line["at_ratio"], "x", real),
            reported(what + "a query, irradiance()", line["irradiance_us"], "us", real),
            reported(what + "an update", line["update_ms"], "ms", real)]


def measure_rooms(programs, say):
    lines = items_of([programs / "measure_field"], say)
    rows = [lamp_row(line) for line in lines if "lamp" in line]
    rows += [r for line in lines if "irradiance_rms" in line for r in point_rows(line)]
    rows += [r for line in lines if "scale_error" in line for r in scale_rows(line)]
    rows += [r for line in lines if "speed" in line for r in speed_rows(line)]
    measured = len({line["room"] for line in lines})
    return rows + [at_least("rooms that were measured", ROOMS, measured, "", REAL)]
