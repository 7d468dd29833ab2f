#!/usr/bin/python3
"""Draws size, quality and time of image-based objects: bytes of a view against PSNR at captured lights, beside JPEG and
x264; time to relight and to decode a view against PSNR. Filled: on the Pareto front.

  measure_image_object --part rate | image_object_chart.py PICTURE
"""
import json
import sys
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

COLORS = {"lightwell": "#141414", "jpeg 4:4:4": "#d55e00", "jpeg 4:2:0": "#966e00", "x264 4:4:4": "#0072b2"}


def on_front(point, points, cost):
    """Whether no other point costs as little, has as high a PSNR, and is better in one of them."""
    return not any(other is not point and other[cost] <= point[cost] and other["db"] >= point["db"] and
                   (other[cost], other["db"]) != (point[cost], point["db"]) for other in points)


def draw_panel(axes, points, cost, label):
    for codec, color in COLORS.items():
        own = sorted((p for p in points if p["codec"] == codec and cost in p), key=lambda p: p["db"])
        if not own:
            continue
        axes.plot([p[cost] for p in own], [p["db"] for p in own], "-", color=color, linewidth=0.8)
        for p in own:
            filled = color if on_front(p, points, cost) else "white"
            axes.plot(p[cost], p["db"], "o", color=color, markerfacecolor=filled)
        best = own[-1]
        axes.annotate(codec, (best[cost], best["db"]), (4, 4), textcoords="offset points", color=color)
    for p in points:
        if p["codec"] == "lightwell" and p["setting"] == "default":
            axes.annotate("default", (p[cost], p["db"]), (6, -12), textcoords="offset points")
    axes.set(xscale="log", xlabel=label, ylabel="PSNR over the object, dB")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())
    axes.grid(color="#e2e2e6")


def draw(points, path):
    if not points:
        sys.exit("image_object_chart.py: there is no line of `measure_image_object --part rate` in the input")
    figure = Figure(figsize=(16, 6), dpi=100, layout="constrained")
    figure.suptitle(f"Image-based object, 61 lights of 256x256, mean of {points[0]['views']} views: size, quality, "
                    "time (one thread)")
    timed = [p for p in points if "relight_ms" in p]
    size, relight, decode = figure.subplots(1, 3)
    draw_panel(size, points, "bytes_per_view", "bytes of a view")
    draw_panel(relight, timed, "relight_ms", "ms to relight it with three lights")
    draw_panel(decode, timed, "decode_ms", "ms to decode it")
    figure.savefig(path, dpi=150)


if __name__ == "__main__":
    if len(sys.argv) != 2 or Path(sys.argv[1]).suffix not in (".png", ".svg", ".pdf"):
        sys.exit(__doc__)
    draw([line for line in map(json.loads, sys.stdin) if line.get("part") == "rate"], Path(sys.argv[1]))
