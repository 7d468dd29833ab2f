#!/usr/bin/python3
"""Draws the lines of measure_trade: what accuracy costs an application. usage: trade_chart.py PICTURE < LIST.json"""
import json
import re
import sys

from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

COLORS = {0: "#787880", 1: "#0072b2", 2: "#d55e00", 4: "#009e73", 6: "#b43c8c"}  # By the highest band.

# Title, keys of x and y, and which choices are shown: the edge of the map is 0 without one.
PANELS = [("irradiance error, %, over bytes a second", "bytes_per_s", "irradiance_percent",
           lambda lights, edge: edge == 0),
          ("irradiance error, %, over ns a query", "irradiance_ns", "irradiance_percent",
           lambda lights, edge: edge == 0),
          ("matte silver ball's error, %, over bytes a second", "bytes_per_s", "silver_percent",
           lambda lights, edge: edge > 0 or lights == 4)]


def draw(items, path):
    figure = Figure(figsize=(18.6, 7), dpi=100, layout="constrained")
    figure.suptitle("What accuracy costs an application: medians of eight real panoramas, 30 descriptors and 5 maps a "
                    "second\nColour: highest band (grey 0, blue 1, orange 2, green 4, violet 6). Number: lights; with "
                    "a map its edge (squares).")
    for (title, cost, error, shows), axes in zip(PANELS, figure.subplots(1, len(PANELS))):
        axes.set(xscale="log", yscale="log")
        axes.set_title(title, loc="left", weight="bold")
        for item in items:
            band, lights, edge = map(int, re.fullmatch(r"trade\.band(\d+)\.lights(\d+)\.map(\d+)",
                                                       item["figure"]).groups())
            if not shows(lights, edge):
                continue
            axes.plot(item[cost], item[error], "s" if edge else "o", color=COLORS[band])
            axes.annotate(str(edge or lights), (item[cost], item[error]), (4, 3), textcoords="offset points",
                          color=COLORS[band])
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            axis.set_major_formatter("{x:g}")
            axis.set_minor_locator(NullLocator())
        axes.grid(color="#e2e2e6")
    figure.savefig(path, dpi=200)


if __name__ == "__main__":
    draw(json.load(sys.stdin), sys.argv[1])
