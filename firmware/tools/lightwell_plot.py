#!/usr/bin/python3
"""Draws the JSON of lightwell-eval and lightwell-calibrate with matplotlib.

  lightwell-eval --pareto                            writes out/pareto.json
  lightwell_plot.py out/pareto.json --output out/pareto.png --output out/pareto.svg
  lightwell-calibrate geometry ... --json | lightwell_plot.py --output rig.png
  lightwell-calibrate photometry ... --json | lightwell_plot.py --output curves.png
  lightwell-calibrate coverage ... --watch --json | lightwell_plot.py --output coverage.png

Each line of the input is one JSON document; the pictures are replaced for each. Exit status: 0 drawn, 1 the input is
wrong or a picture cannot be written, 2 wrong usage.
"""
import argparse
import itertools
import json
import math
import os
import sys
from collections import namedtuple
from pathlib import Path as FilePath
from typing import NamedTuple

try:
    import numpy as np
    from matplotlib import rcParams
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.path import Path
    from matplotlib.ticker import LogLocator, NullLocator
    from matplotlib.transforms import Bbox
    from PIL import Image
except ImportError:
    sys.exit("lightwell_plot.py: matplotlib is missing; Debian's package is python3-matplotlib")

rcParams["svg.fonttype"] = "none"  # Text stays text.
rcParams["font.size"] = 10

# Colours that are distinguishable with colour blindness (Okabe & Ito 2008).
BLUE, ORANGE, GREEN, VIOLET, BROWN, BLACK, GREY = "#0072b2 #d55e00 #009e73 #b43c8c #966e00 #141414 #787880".split()

# ---- lightwell-eval --pareto ----

# By the parameter that a case varies ("knob"): its text in the legend, and its colour.
KNOBS = {"setting": ("named settings (@ width)", BLACK), "block": ("block size", BLUE), "band": ("band limit", ORANGE),
         "lights": ("most lights", GREEN), "epsilon": ("epsilon", VIOLET), "map": ("environment map", BROWN),
         "sensor": ("8-bit sensor", "#4682b4")}
MARKER_KNOBS = {"setting": ("default", BLACK), "decimation": ("decimation, followed", BLUE),
                "search": ("decimation, searched", VIOLET), "faces": ("most faces", ORANGE),
                "order": ("most lamps; the table", GREEN)}


class Case(NamedTuple):
    """A point of a panel. Cases of the same camera share a staircase."""
    label: str
    cost: float
    error: float  # Percent.
    color: str
    camera: tuple
    main: bool  # Of the camera whose staircase is emphasised.
    named: bool
    on_front: bool
    bound: float | None = None  # Percent; drawn as a dash above the point.


Panel = namedtuple("Panel", "title cost error height knobs cases")  # The height in inches.
Label = namedtuple("Label", "text x y color weight")


def panels_of(document):
    """The panels that have cases. A marker's rows without time or error (no frame was answered) are left out."""
    def cases(sensor, cost):
        return [Case(row["what"], row[cost], 100 * row["rms"], KNOBS[row["knob"]][1], (row["width"], row["height"]),
                     sensor == "ideal" and row["width"] == 640, row["named"], row["on_front"])
                for row in document["rows"] if row["sensor"] == sensor]

    marker = [row for row in document.get("marker", []) if row["ms"] and row["rms"]]
    # The default is drawn last, on top of cases with the same result.
    marker.sort(key=lambda row: row["knob"] == "setting")
    size = "{width}x{height}".format(**marker[0]) if marker else ""
    error = "error of the irradiance, RMS %, median of the "
    all_panels = [
        Panel("Error and time", "from frame to encoded descriptor, ms", error + "scenes", 8.2, KNOBS,
              cases("ideal", "ms")),
        Panel("Error and size", "encoded descriptor, bytes", error + "scenes", 8.2, KNOBS, cases("ideal", "bytes")),
        Panel("Through an 8-bit sensor with noise: one exposure, three exposures",
              "from frames to encoded descriptor, ms", error + "scenes", 4.2, KNOBS, cases("rgb8", "ms")),
        Panel(f"Light from a marker, one picture of {size}, 8 bits",
              "a followed frame, from the camera's bytes to the descriptor, ms", error + "frames", 6.2, MARKER_KNOBS,
              [Case(row["what"], row["ms"], 100 * row["rms"], MARKER_KNOBS[row["knob"]][1], (), True,
                    row["knob"] == "setting", row["on_front"]) for row in marker])]
    return [panel for panel in all_panels if panel.cases]


def pareto_figure(document):
    panels = panels_of(document)
    if not panels:
        raise ValueError("it has no rows")
    return panels_figure(
        panels,
        f"Lightwell: what accuracy costs\n{len(document['scenes'])} scenes through a pair of lenses, 2 x 640x480 "
        f"unless said otherwise. One thread; memcpy here {document['memcpy_gb_per_s']:.1f} GB/s.\n"
        "Filled: on the front of time, bytes, error and bound, of one camera. Lines: the best for the cost.")


def panels_figure(panels, title, columns=1):
    """Panels of a row have the height of its first."""
    heights = [panel.height for panel in panels[::columns]]
    figure = Figure(figsize=(15, 1.2 + sum(heights)), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title)
    all_axes = figure.subplots(len(heights), columns, squeeze=False, gridspec_kw={"height_ratios": heights})
    all_axes = list(all_axes.flat)
    for panel, axes in zip(panels, all_axes):
        draw_panel(axes, panel)
    # The positions of labels depend on the layout, so it is computed once and kept.
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for panel, axes in zip(panels, all_axes):
        place_labels(axes, labels_of(axes, panel.cases))
    return figure


def draw_panel(axes, panel):
    """Error over cost, and for each camera a staircase: the smallest error of all cases of at most that cost."""
    axes.set(xscale="log", yscale="log", xlabel=panel.cost, ylabel=panel.error)
    axes.margins(0.06)
    by_cost = lambda case: (case.camera, case.cost)
    for _, group in itertools.groupby(sorted(panel.cases, key=by_cost), key=lambda case: case.camera):
        group = list(group)
        least = np.minimum.accumulate([case.error for case in group])
        axes.plot(np.repeat([case.cost for case in group], 2)[1:], np.repeat(least, 2)[:-1], color="#aaafbe",
                  linewidth=2.2 if group[0].main else 1.2, zorder=1)
    for case in panel.cases:
        if case.bound:
            axes.plot([case.cost] * 2, [case.error, case.bound], color=case.color, linewidth=0.8, alpha=0.4, zorder=0)
            axes.plot(case.cost, case.bound, "_", color=case.color, markersize=9, alpha=0.6)
        axes.plot(case.cost, case.error, "o", color=case.color, markersize=8 if case.named else 6,
                  markerfacecolor=case.color if case.on_front else "white")
    used = {case.color for case in panel.cases}
    handles = [Line2D([], [], marker="o", linestyle="", color=color, label=text)
               for text, color in panel.knobs.values() if color in used]
    # Half a page holds some hundred characters in a line.
    columns = len(handles) if sum(len(handle.get_label()) for handle in handles) <= 100 else 2
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0, 1), ncol=columns, frameon=False, fontsize=9,
                borderaxespad=0, columnspacing=1.2, handletextpad=0.2).set_in_layout(False)
    axes.set_title(panel.title, loc="left", weight="bold", pad=6 + 16 * math.ceil(len(handles) / columns))
    set_log_ticks(axes)


def set_log_ticks(axes):
    """Numbers at 1, 2, 5 of each decade, and more of them on a short axis."""
    for axis in (axes.xaxis, axes.yaxis):
        low, high = axis.get_view_interval()
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high > 30 * low else (1, 1.5, 2, 3, 4, 5, 6, 8)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(NullLocator())
    axes.grid(color="#e2e2e6", linewidth=0.8)


def labels_of(axes, cases):
    """A label for each case; cases within 7 pixels of each other share one."""
    labels, positions = [], []
    for case in cases:
        at = axes.transData.transform((case.cost, case.error))
        near = next((k for k, other in enumerate(positions) if math.dist(at, other) <= 7), None)
        if near is None:
            positions.append(at)
            labels.append(Label(case.label, case.cost, case.error, case.color,
                                "bold" if case.named and case.main else "normal"))
        elif case.label not in labels[near].text.split("\n"):
            labels[near] = labels[near]._replace(text=labels[near].text + "\n" + case.label)
    return labels


def place_labels(axes, labels):
    """Writes each text as near to its point as it can stand without covering texts, points or lines, with a leader line
    where it is not beside it. Returns the texts. Greedy: labels in dense regions come first, because they have the
    fewest free places."""
    axes.autoscale(False)
    renderer, to_data = axes.figure.canvas.get_renderer(), axes.transData.inverted()
    points = [axes.transData.transform((label.x, label.y)) for label in labels]
    marks = [Bbox([at - 7, at + 7]) for at in points]
    lines = [line.get_transform().transform_path(line.get_path()) for line in axes.get_lines()]
    texts, boxes = [], []

    def conflicts(box, leader):
        outside = not (axes.bbox.contains(*box.min) and axes.bbox.contains(*box.max))
        return (1000 * outside + 10 * box.count_overlaps(boxes) + 3 * box.count_overlaps(marks) +
                sum(line.intersects_bbox(box, filled=False) for line in lines) +
                sum(leader.intersects_bbox(other, filled=False) for other in boxes))

    density = lambda at: sum(math.exp(-math.dist(at, other) / 60) for other in points)
    for label, at in sorted(zip(labels, points), key=lambda pair: -density(pair[1])):
        text = axes.text(label.x, label.y, label.text, color=label.color, weight=label.weight, size=9, va="bottom")
        size = text.get_window_extent(renderer).size + 2
        fewest = math.inf
        for radius, angle in itertools.product((9, 14, 21, 30, 41, 54, 69, 86, 105, 126, 150, 180, 215, 255),
                                               np.linspace(0, 2 * np.pi, 32, endpoint=False)):
            # The box touches the circle with its point nearest to the mark.
            towards = np.array([math.cos(angle), math.sin(angle)])
            corner = at + radius * towards - size * (1 - towards) / 2
            box = Bbox([corner, corner + size])
            end = np.clip(at, box.min, box.max)
            count = conflicts(box, Path([at, end]))
            if count < fewest:
                fewest, best, best_end = count, box, end
            if count == 0:
                break
        boxes.append(best)
        lines.append(Path([at, best_end]))
        text.set_position(to_data.transform(best.min))
        text.set_multialignment("right" if best.x1 < at[0] else "left")
        if math.dist(at, best_end) > 14:
            axes.plot(*zip(to_data.transform(at), to_data.transform(best_end)), color=label.color, alpha=0.5,
                      linewidth=0.7, zorder=1)
        texts.append(text)
    return texts


# ---- lightwell-calibrate coverage, geometry ----


def lenses_figure(lenses, title):
    """A panel for each lens: cells that lack views, points, and residuals enlarged a hundred times."""
    figure = Figure(figsize=(7 * len(lenses), 7), dpi=100, layout="constrained")
    figure.suptitle(title)
    for lens, axes in zip(lenses, figure.subplots(1, len(lenses), squeeze=False)[0]):
        axes.set_title(f"lens {lens['lens']}: {lens['pictures']} pictures, {len(lens['points'])} points, "
                       f"{100 * lens['share']:.0f} % of the cells known", loc="left", size=10)
        axes.set(aspect="equal", xlim=(-0.5, lens["width"] - 0.5), ylim=(lens["height"] - 0.5, -0.5),
                 xlabel="points in blue; crosses: cells that need more views", xticks=[], yticks=[])
        cell = np.array([lens["width"] / lens["columns"], lens["height"] / lens["rows"]])
        # A cross is visible in black and white, too.
        centers = (np.array(lens["lacking"]).reshape(-1, 2) + 0.5) * cell - 0.5
        axes.plot(*centers.T, "x", color="#e69696", markersize=24, markeredgewidth=2.5)
        if not lens["points"]:
            continue
        x, y, *residuals = np.array(lens["points"]).T
        axes.plot(x, y, ".", color=BLUE, markersize=2.5)
        if residuals:
            axes.quiver(x, y, *residuals, color=ORANGE, angles="xy", scale_units="xy", scale=0.01, units="dots",
                        width=1, headwidth=0, headlength=0, headaxislength=0)
            axes.set_xlabel(axes.get_xlabel() + "; orange lines: residuals, 100 times enlarged")
    return figure


# ---- lightwell-calibrate photometry ----


def photometry_figure(document):
    curves, values = document["curves"], document["calibration"]
    figure = Figure(figsize=(15, 6.5), dpi=100, layout="constrained")
    scale = f"{values['nits_per_unit']:.5g} cd/m2 per unit" if values["nits_per_unit"] > 0 else "relative units"
    figure.suptitle(f"Lens {document['lens']}: black level {values['black_level']:.5f}; white balance "
                    f"{', '.join(f'{factor:.4f}' for factor in values['white_balance'])}; {scale}")
    panels = figure.subplots(1, 3)
    draw_response(panels[0], curves["response"], document["response"])
    draw_vignetting(panels[1], curves["vignetting"], document["vignetting"])
    draw_noise(panels[2], curves["noise"], document["noise"], document["dark"])
    for axes in panels:
        axes.grid(color="#d7d7d7")
    return figure


def draw_curve(axes, curve, title, across, up, caption):
    axes.set_title(title, loc="left", weight="bold")
    axes.set(xlabel=f"{across}\n\n{caption}", ylabel=up)
    axes.plot(*zip(*(point[:2] for point in curve)), color=BLUE)


def draw_response(axes, curve, fit):
    kind = fit and fit["kind"] + (f" {fit['gamma']:.3f}" if fit["kind"] == "gamma" else "")
    caption = fit and (f"curve: {kind}; typical residual {100 * fit['residual']:.2f} % of full scale\n{fit['samples']} "
                       f"samples; {fit['outliers']} outliers (hollow, grey); some of the others are drawn")
    draw_curve(axes, curve["curve"], "Response", "linear light x, share of full scale",
               "picture value, share of full scale", caption or "not measured: the calibration's curve")
    draw_points(axes, curve["points"])
    axes.set(xlim=(0, 1), ylim=(0, 1))


def draw_vignetting(axes, curve, fit):
    caption = fit and ("v1 {:.4f}, v2 {:.4f}, v3 {:.4f}; ".format(*fit["vignetting"]) +
                       f"typical residual {100 * fit['residual']:.2f} %\n"
                       f"dashed: 3 sigma; {fit['sightings']} observations, {fit['outliers']} outliers")
    draw_curve(axes, curve["curve"], "Vignetting", "angle from the axis, degrees", "relative illumination",
               caption or "not measured: the calibration's curve")
    if fit:
        for side in (-3, 3):
            axes.plot(*zip(*((x, y + side * sigma) for x, y, sigma in curve["curve"])), "--", color=BLUE, linewidth=1)
    draw_points(axes, curve["points"])
    axes.set(xlim=(0, None), ylim=(0, 1.1))


def draw_noise(axes, curve, fit, dark):
    caption = fit and (f"read noise {fit['read_noise']:.4g} +- {fit['read_deviation']:.1g}; shot noise "
                       f"{fit['shot_noise']:.4g} +- {fit['shot_deviation']:.1g}\nrounding noise subtracted; "
                       f"{fit['levels']} levels{' and the dark' if dark else ''}")
    draw_curve(axes, [(x, 1e6 * y) for x, y in curve["curve"]], "Photon transfer", "mean linear light x, by gain",
               "variance of x, millionths",
               caption or ("no flats: the line of dark and calibration" if dark
                           else "not measured: the calibration's line"))
    draw_points(axes, [(x, 1e6 * y, 1e6 * sigma, counted) for x, y, sigma, counted in curve["points"]])
    axes.set(xlim=(0, None), ylim=(0, None))


def draw_points(axes, points):
    """Points (x, y, standard deviation of y, whether it counted); outliers are hollow."""
    counted = [point[:3] for point in points if point[3]]
    if counted:
        x, y, sigma = zip(*counted)
        axes.errorbar(x, y, sigma if any(sigma) else None, fmt=".", color="#dc7814", markersize=4, linewidth=1)
    outliers = [point[:2] for point in points if not point[3]]
    if outliers:
        axes.plot(*zip(*outliers), "o", color="#aaaaaa", markerfacecolor="none", markersize=5)


# ---- the program ----


def figure_of(document):
    """The figure of a document; ValueError or KeyError if it is of none of these commands."""
    if isinstance(document, list) and document:
        return lenses_figure(document, "lightwell-calibrate coverage")
    if isinstance(document, dict) and "rows" in document:
        return pareto_figure(document)
    if isinstance(document, dict) and "curves" in document:
        return photometry_figure(document)
    if isinstance(document, dict) and "coverage" in document:
        return lenses_figure(document["coverage"], "lightwell-calibrate geometry")
    raise ValueError("it is not the JSON of lightwell-eval --pareto or of lightwell-calibrate coverage, geometry or "
                     "photometry")


def save(figure, path):
    """Replaces the file when the picture is complete: a viewer may read it at any time."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        figure.savefig(temporary, format=path.suffix[1:], dpi=200)
        if path.suffix == ".png":  # matplotlib writes an alpha channel, which every pixel sets to opaque.
            Image.open(temporary).convert("RGB").save(temporary, format="png", dpi=(200, 200))
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def picture_path(text):
    if FilePath(text).suffix not in (".png", ".svg", ".pdf"):
        raise argparse.ArgumentTypeError(f"'{text}' must end in .png, .svg or .pdf")
    return FilePath(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("json", nargs="?", default="-", metavar="JSON", help="a file; - is standard input [-]")
    parser.add_argument("--output", type=picture_path, action="append", required=True, metavar="PICTURE",
                        help=".png, .svg or .pdf; may be given several times")
    arguments = parser.parse_args()
    number = 0
    try:
        with sys.stdin if arguments.json == "-" else open(arguments.json, encoding="utf-8") as lines:
            for number, line in enumerate(lines, 1):
                figure = figure_of(json.loads(line))
                for path in arguments.output:
                    save(figure, path)
    except OSError as error:
        sys.exit(f"lightwell_plot.py: {error}")
    except KeyError as error:
        sys.exit(f"lightwell_plot.py: {arguments.json}:{number}: it lacks {error}")
    except (ValueError, TypeError) as error:
        sys.exit(f"lightwell_plot.py: {arguments.json}:{number}: {error}")
    if number == 0:
        sys.exit(f"lightwell_plot.py: {arguments.json}: there is nothing in it")


if __name__ == "__main__":
    main()
