"""Part rooms of the topic light_field: LightField in path-traced rooms (tests/reference/mitsuba/field, whose README
defines the errors and which points are visible). Rooms, seed and limits were fixed before the first measurement.
"""
from figure_topics.marker import items_of
from figure_topics.rows import at_least, at_most, reported

TARGETS = ["measure_field"]

ROOMS, LAMPS = 3, 9
DIRECTION_DEG, IRRADIANCE, LAMP = 3, 0.12, 0.03
BOUND_HOLDS, BOUND_FINITE, BOUND_TO_ERROR = 0.95, 0.8, 4
QUERY_US = {"field": 2, "field with geometry": 20}

REAL = "4 probes: panorama estimator behind a simulated 8-bit pair, encoded descriptors; 200 points; Mitsuba's light"


def point_rows(line):
    what = f"{line['room']}, {line['method']}: "
    nearest = line["method"] == "nearest probe"
    most, least = (at_most, at_least) if not nearest else (
        lambda name, limit, *rest: reported(name, *rest),) * 2
    rows = [most(what + "RMS error of irradiance, visible points", IRRADIANCE, line["irradiance_rms_visible"], "", REAL),
            reported(what + "the same, all points", line["irradiance_rms"], "", REAL),
            most(what + "error of the strongest light's direction, visible points, median", DIRECTION_DEG,
                 line["direction_median_visible_deg"], "deg", REAL),
            reported(what + "the same, 90 %", line["direction_90_visible_deg"], "deg", REAL),
            reported(what + "visible points whose strongest light is within 3 degrees", line["direction_within_3_visible"],
                     "", REAL)]
    if not nearest:
        rows += [least(what + "points at which the bound holds", BOUND_HOLDS, line["bound_holds"], "", REAL),
                 least(what + "visible points with a finite bound", BOUND_FINITE, line["bound_finite_visible"], "",
                       REAL),
                 most(what + "bound by error, median", BOUND_TO_ERROR, line["bound_to_error_median"], "", REAL)]
    return rows


def lamp_row(line):
    what = f"{line['room']}, {'window' if line['window'] else 'lamp'} {line['lamp']}: "
    name = what + "error of its position by its distance from the nearest probe"
    if line["window"]:
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
    rows += [r for line in lines if "speed" in line for r in speed_rows(line)]
    measured = len({line["room"] for line in lines})
    return rows + [at_least("rooms that were measured", ROOMS, measured, "", REAL)]
