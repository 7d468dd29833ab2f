"""Part grids of the topic light_field: grids of light probes for engines (lightwell-field --grid) in the path-traced
rooms of tests/reference/mitsuba/field: what interpolation between points adds, against the spacing of the grid.
Spacings, margin and definitions (tests/measure/measure_field_grid.cpp) were fixed before the first measurement.
"""
import math

from figure_topics.marker import items_of
from figure_topics.rows import at_least, reported

TARGETS = ["measure_field_grid"]

ROOMS = 3
REAL = ("three rooms, 4 probes, 200 points each; file read by Unity's formula, harmonics interpolated "
        "trilinearly")


def pooled(lines, square, weight):
    """RMS over the points of all rooms."""
    points = sum(line[weight] for line in lines)
    return math.sqrt(sum(line[square] * line[weight] for line in lines) / points) if points else None


def rows_of(lines):
    """Without geometry nothing tells what hides a lamp: against the truth at visible points alone."""
    keys = sorted({(line["method"], line["grid_lights"], line["spacing_m"]) for line in lines})
    for method, lights, spacing in keys:
        same = [line for line in lines if (line["method"], line["grid_lights"], line["spacing_m"]) ==
                (method, lights, spacing)]
        what = f"{method}, lights {lights}, " + (f"grid of {spacing:g} m: " if spacing else "harmonics at the point: ")
        real = REAL + (f"; {sum(line['grid_points'] for line in same)} grid points" if spacing else "")
        if spacing:
            yield reported(what + "RMS error of irradiance by interpolation",
                           pooled(same, "interpolation_square", "lit"), "", real)
            yield reported(what + "the same, 95 %, worst room", max(line["interpolation_95"] for line in same), "",
                           real)
        if method == "field":
            yield reported(what + "RMS error of irradiance, visible points",
                           pooled(same, "truth_square_visible", "visible"), "", real)
        else:
            yield reported(what + "RMS error of irradiance, all points", pooled(same, "truth_square", "lit"), "", real)
    timed = [line for line in lines if line["spacing_m"] and line["grid_lights"] == "in harmonics"
             and line["method"] == "field"]
    if timed:
        points = sum(line["grid_points"] for line in timed)
        yield reported("points whose cell has no light", sum(line["without_light"] for line in lines), "", REAL)
        ms = sum(line["grid_ms"] for line in timed)
        yield reported("a point of a grid, written and read", ms / points, "ms", REAL)


def measure_grids(programs, say):
    lines = items_of([programs / "measure_field_grid"], say)
    return [*rows_of(lines), at_least("rooms that were measured with grids", ROOMS,
                                      len({line["room"] for line in lines}), "", REAL)]
