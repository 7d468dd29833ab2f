#!/usr/bin/python3
"""Draws the page of the trade: cost against error, bytes and bound, of panorama, marker and plane.

  trade_off_chart.py PICTURE < LINES

LINES: the lines of measure_interleave --case brackets --format rgb8, measure_bytes, measure_marker_trade and
measure_specular --trade, each with "program", its name; and of each setting and interleave that is counted {"program":
"measure_instructions", "setting", "interleave", "per_pixel"}. tests/figures trade_off writes them.
"""
import json
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "firmware/tools"), str(Path(__file__).resolve().parents[1])]
import lightwell_plot as plot  # noqa: E402
from figure_topics import specular_chart  # noqa: E402

COLORS = {"fastest": plot.ORANGE, "balanced": plot.BLACK, "exact": plot.BLUE}
POINT_KNOBS = {name: (name, color) for name, color in COLORS.items()}
MEDIAN = "error of the irradiance, RMS %, median"


def with_front(cases):
    """The same cases, each with whether no other one has at most its cost and its error, and less of one of them."""
    key = lambda case: (case.cost, case.error)
    beaten = lambda case: any(key(o) != key(case) and o.cost <= case.cost and o.error <= case.error for o in cases)
    return [case._replace(on_front=not beaten(case)) for case in cases]


def point_case(label, cost, line, error, bound, named):
    return plot.Case(label, cost, 100 * error, COLORS[line["setting"]], (), True, named, False, 100 * bound)


def cost_panel(lines):
    """Error and bound over the instructions of a pixel."""
    of = lambda line: (line.get("setting"), line.get("interleave"))
    counted = {of(line): line["per_pixel"] for line in lines.get("measure_instructions", [])}
    cases = []
    for line in lines.get("measure_interleave", []):
        if of(line) in counted:
            setting, interleave = of(line)
            whole = interleave == 1 or setting == "fastest"
            cases.append(point_case(setting if whole else f"{setting}, {interleave}", counted[of(line)], line,
                                    line["read"]["median_error"], line["read"]["median_bound"], whole))
    return plot.Panel("Panorama: cost (exact: four times the bytes)",
                      "aarch64 instructions a pixel of one exposure, RGB8 in brackets of three",
                      MEDIAN + "; dash: bound", 6, POINT_KNOBS, with_front(cases))


def size_panel(lines):
    cases = [point_case(f"{line['max_bytes']} bytes" if line["max_bytes"] else "no limit", line["mean_bytes"], line,
                        line["median_error"], line["median_bound"], not line["max_bytes"])
             for line in lines.get("measure_bytes", []) if line["format"] == "rgb8"]
    return plot.Panel("Panorama: size (max_bytes)", "bytes of a message, mean, RGB8 in brackets of three",
                      MEDIAN + "; dash: bound", 6, POINT_KNOBS, with_front(cases))


def marker_panel(lines):
    rows = [row for row in lines.get("measure_marker_trade", []) if row["ms"] and row["rms"]]
    rows.sort(key=lambda row: row["knob"] == "setting")
    cases = [plot.Case(row["what"], row["memcpy_ratio"], 100 * row["rms"], plot.MARKER_KNOBS[row["knob"]][1], (), True,
                       row["knob"] == "setting", False) for row in rows]
    return plot.Panel("Marker: a followed frame", "processor time, times memcpy of the frame", MEDIAN, 6,
                      plot.MARKER_KNOBS, with_front(cases))


def plane_panel(lines):
    items = [line for line in lines.get("measure_specular", []) if line.get("figure") in ("trade", "fill")]
    return specular_chart.panels_of(items)[0]._replace(title="Plane: capture of its light field", height=6)


def draw(lines, path):
    panels = [panel(lines) for panel in (cost_panel, size_panel, marker_panel, plane_panel)]
    missing = [panel.title for panel in panels if not panel.cases]
    if missing:
        sys.exit("trade_off_chart.py: no lines for: " + ", ".join(missing))
    plot.save(plot.panels_figure(panels, "Lightwell: what accuracy costs.\nFilled: on the front of cost and error. "
                                 "Lines: the best for the cost.", columns=2), path)


if __name__ == "__main__":
    if len(sys.argv) != 2 or Path(sys.argv[1]).suffix not in (".png", ".svg", ".pdf"):
        sys.exit(__doc__)
    by_program = {}
    for line in map(json.loads, sys.stdin):
        by_program.setdefault(line.get("program"), []).append(line)
    draw(by_program, Path(sys.argv[1]))
