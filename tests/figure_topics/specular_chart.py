#!/usr/bin/python3
"""Draws what the accuracy of a captured plane costs: time and memory against RMSE, with the Pareto fronts.

  measure_specular --trade --fill --sequence "office 0.45" | specular_chart.py PICTURE
"""
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "firmware/tools"))
import lightwell_plot as plot  # noqa: E402

KNOBS = {"default": ("60 levels, 256x256 texels, all frames", plot.BLACK), "levels": ("fewer levels", plot.BLUE),
         "texels": ("fewer texels", plot.ORANGE), "every": ("fewer frames", plot.GREEN),
         "fill": ("another spiral, until a share of the light field is filled", plot.VIOLET)}
DEFAULT = {"levels": 60, "texels": 256, "every": 1}


def knob_of(item):
    return "fill" if item["figure"] == "fill" else next(
        (name for name, value in DEFAULT.items() if item[name] != value), "default")


def label_of(item):
    return {"default": "default", "levels": f"{item['levels']} levels", "texels": f"{item['texels']}x{item['texels']}",
            "every": f"every {item['every']} frames", "fill": f"{100 * item['fill_limit']:g} % filled"}[knob_of(item)]


def seconds_of(item):
    """Processor time of all captured frames."""
    return item["ms"] * item["frames"] / 1000


def on_front(item, items):
    """Whether no other capture of the same views is as good in time, memory and RMSE, and better in one of them."""
    key = lambda i: (seconds_of(i), i["mb"], i["rmse"])
    mine = key(item)
    return not any(key(other) != mine and all(a <= b for a, b in zip(key(other), mine)) for other in items
                   if other["figure"] == item["figure"])


def panels_of(items):
    def cases(cost):
        return [plot.Case(label_of(item), cost(item), 100 * item["rmse"], KNOBS[knob_of(item)][1], (item["figure"],),
                          item["figure"] == "trade", knob_of(item) == "default", on_front(item, items))
                for item in items]

    error = "RMSE of held-out views, % of full scale"
    return [plot.Panel("Error and time", "processor time of the whole capture, s", error, 5, KNOBS, cases(seconds_of)),
            plot.Panel("Error and memory", "memory of the light field, MB", error, 5, KNOBS,
                       cases(lambda item: item["mb"]))]


def draw(items, path):
    items = [item for item in items if item.get("figure") in ("trade", "fill")]
    if not items:
        sys.exit("specular_chart.py: there is no line of `measure_specular --trade` or `--fill` in the input")
    plot.save(plot.panels_figure(
        panels_of(items), f"Capture of a glossy plane, {items[0]['sequence']}: what accuracy costs. 640x480, one "
        "thread.\nFilled: on the front of time, memory and error of one spiral. Lines: the best for the cost."), path)


if __name__ == "__main__":
    if len(sys.argv) != 2 or Path(sys.argv[1]).suffix not in (".png", ".svg", ".pdf"):
        sys.exit(__doc__)
    draw([json.loads(line) for line in sys.stdin], Path(sys.argv[1]))
