"""Topic panorama: the panorama estimator's speed, accuracy, bound and extremes.

Thresholds, scene lists and exclusions are defined here and at the top of the programs of tests/measure; random seeds in
those. Timing programs run first, one at a time; then the others run in parallel.
"""
import concurrent.futures
import json
import math
import os
import platform
import re
import statistics
import subprocess
import time

from figure_topics import aarch64
from figure_topics.panorama_extremes import extremes
from figure_topics.panorama_front import front
from figure_topics.rows import at_least, at_most, equals, known_short, reported, row

ALL_PANORAMAS = True
TARGETS = ["measure_speed", "measure_peers", "measure_accuracy", "measure_bound", "measure_balls", "measure_kernels",
           "measure_extremes", "lightwell-eval"]
AARCH64_TARGETS = ["measure_kernels", "measure_instructions"]

PANORAMAS = 26
SIMULATED = "real panorama, simulated sensor"
ORACLE = "26 real panoramas, simulated ideal pair of 640x480, encoded and decoded, double-precision oracle"
NOISY = "26 real panoramas, simulated 8-bit pair of 640x480: noise, vignetting, three exposures; oracle"

# Limits of the time of one picture at `fast`, as a multiple of the time of memcpy of its bytes; `balanced`, with one
# exposure or three, may take 2.5 times as long.
FAST_LIMITS = {"rgb8_linear": 2.5, "rgb8": 4, "bayer8": 6, "nv12": 6, "yuyv": 6}
BALANCED_FACTOR = 2.5
RIGS = {"single": "one lens of 1280x960", "pair": "two lenses of 1280x960", "equirect": "sphere of 1568x784"}
FORMAT_NAMES = {"rgb8_linear": "RGB8 linear", "rgb8": "RGB8 gamma", "bayer8": "Bayer8", "nv12": "NV12", "yuyv": "YUYV",
                "bayer10": "Bayer10", "bayer12": "Bayer12", "rgb_f32": "RGB of floats"}
# Timed with the best vector unit of this machine and with narrower ones: measure_speed --vector.
VECTORS = ["best", "avx2", "sse4"]
# Names of the rows that are known to exceed their limits, and the reason.
KNOWN_SHORT = [
    (re.compile(r"^time by memcpy's, (fast|balanced, three exposures), (NV12|YUYV), "),
     "12 to 13 instructions a pixel for subsampled chroma: 7 to 20 times memcpy, awaits work on speed"),
    (re.compile(r"^time with 64 small lights .*, RGB8 linear, at the default"),
     "1.07 to 1.13: the lights cost the same in every format, and these pixels the least; awaits work on speed"),
]
SIZES = ["640x480", "1280x960", "1920x1440", "2560x1920", "3840x3840"]
# Linear in pixels: the time per pixel in the image circle is at no size more than a tenth above that at any smaller
# one. Constant costs of a frame may raise the time per pixel of small pictures. Pixels outside of the image circle cost
# nothing, and a 4:3 picture has more of them than a square one, so they are not counted.
MOST_COST_PER_PIXEL = 1.1

SENSORS = ["rgb8", "bayer8", "nv12", "yuyv"]
# The limit of 3 % is required of the 8-bit sensor that measures all colours at every pixel. With shared or interpolated
# colour, the picture does not determine the colour of a lamp of one pixel: there each scene's error must lie within the
# error bound of the same descriptor.
OWN_COLOR = "rgb8"
MOST_FLAGGED = 10
# Panoramas with the sun or a bare lamp: the peak of the brightest region is above a hundred times the mean, as in topic
# skeleton.
LAMP_PEAK = 100
# Five times the sun's radius. The direction of a larger region (a window, a softbox or a piece of sky) depends on where
# its edge is drawn, and is only reported.
LAMP_RADIUS_DEG = 1.25
BOUND_FRAMES = 1000
BOUND_SENSORS = {"rgb_f32": "ideal sensor", "rgb8": "rgb8, three exposures", "nv12": "nv12, three exposures",
                 "bayer8": "bayer8, three exposures"}
KERNEL_FORMATS = 7
# RMSE and si-RMSE of StyleLight on Laval Indoor, a different set of panoramas (tests/measure/three_balls.hpp).
PUBLISHED_BALLS = {"diffuse": (0.15, 0.11), "matte silver": (0.30, 0.29), "mirror": (0.56, 0.55)}
BALLS = ["diffuse", "matte silver", "mirror", "mirror 0.25", "mirror 0.5"]
COUNTED = {"single": 1280 * 960, "equirect": 1568 * 784}
SETTINGS = ["fast", "balanced", "exact"]
# Limits of the instructions per pixel at `fast` on aarch64; every other format and setting is only reported.
MOST_INSTRUCTIONS = {"rgb8_linear": 20}
WORK = (10, 20)  # Frames of the two counted runs.


class Programs:
    """Runs the programs of tests/measure; returns the JSON objects that they print, [] if they fail."""

    def __init__(self, folder, say):
        self.folder, self.say = folder, say

    def run(self, name, *arguments, prefix=(), folder=None):
        called = " ".join([*prefix[:1], name, *arguments])
        self.say(called)
        start = time.monotonic()
        done = subprocess.run([*prefix, (folder or self.folder) / name, *arguments], stdout=subprocess.PIPE, text=True)
        self.say(f"{called}: {time.monotonic() - start:.0f} s, status {done.returncode}")
        # Discard the output of a program that failed.
        if done.returncode:
            return []
        return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


def by_figure(items):
    return {item["figure"]: item for item in items}


def finite(values):
    return [v for v in values if v is not None and math.isfinite(v)]


def median(values):
    return statistics.median(values) if values else None


def percent(value):
    return None if value is None else 100 * value


def vector_units(programs):
    """Maps each vector unit of this machine to the argument of --vector that selects it, the best first."""
    units = {}
    for vector in VECTORS:
        for item in programs.run("measure_speed", "--vector", vector, "unit"):
            units.setdefault(item["vector"], vector)
    return units or {"vector unit unknown": "best"}


def timings(programs, units):
    rows = []
    for unit, vector in units.items():
        run = lambda name, *arguments: by_figure(programs.run(name, "--vector", vector, *arguments))
        for figure in speed(run) + linearity(run) + small_lights(run) + peers(run):
            figure["name"] += f", {unit}"
            reasons = [reason for pattern, reason in KNOWN_SHORT if pattern.search(figure["name"])]
            rows.append(known_short(figure, reasons[0]) if reasons else figure)
    return rows


def speed(run):
    formats = run("measure_speed", "formats")
    brackets = run("measure_speed", "brackets")
    rows = []
    copies = finite(item.get("memcpy_gb_per_s") for item in [*formats.values(), *brackets.values()])
    rows.append(reported("memcpy of frames through 32 rotating buffers, median of this run", median(copies), "GB/s",
                         "this machine"))
    for setting, factor in (("fast", 1), ("balanced", BALANCED_FACTOR), ("exact", None)):
        for rig, rig_name in RIGS.items():
            for format, limit in FAST_LIMITS.items():
                rows.append(against_memcpy(formats.get(f"{setting}.{rig}.{format}"),
                                           f"{setting}, {FORMAT_NAMES[format]}, {rig_name}",
                                           None if factor is None else factor * limit))
    for rig, rig_name in RIGS.items():
        for format, limit in FAST_LIMITS.items():
            rows.append(against_memcpy(brackets.get(f"bracket.{rig}.{format}"),
                                       f"balanced, three exposures, {FORMAT_NAMES[format]}, {rig_name}",
                                       BALANCED_FACTOR * limit))
    return rows


def against_memcpy(item, name, limit):
    item = item or {}
    real = SIMULATED
    if item:
        real += f"; {item['ms']:.3g} ms, memcpy {item['memcpy_gb_per_s']:.3g} GB/s"
    name = f"time by memcpy's, {name}"
    if limit is None:
        return reported(name, item.get("value"), "x", real)
    return at_most(name, limit, item.get("value"), "x", real)


def linearity(run):
    figures = run("measure_speed", "sizes")
    rows = []
    for setting in ("fast", "balanced"):
        items = [figures.get(f"size.{setting}.{size}") for size in SIZES]
        costs = [1e6 * item["ms"] / item["seen_pixels"] if item else None for item in items]
        for size, cost in zip(SIZES, costs):
            rows.append(reported(f"time a pixel that the lens sees, {setting}, RGB8 linear, {size}", cost, "ns",
                                 SIMULATED))
        complete = all(items)
        worst = max(cost / min(costs[:k]) for k, cost in enumerate(costs) if k) if complete else None
        rows.append(at_most(f"linear in pixels, {setting}: time a pixel, of that at any smaller size",
                            MOST_COST_PER_PIXEL, worst, "x", SIMULATED))
        slope = None
        if complete:
            slope = statistics.linear_regression([math.log(item["seen_pixels"]) for item in items],
                                                 [math.log(item["ms"]) for item in items]).slope
        rows.append(reported(f"linear in pixels, {setting}: slope of log time over log pixels", slope, "",
                             SIMULATED))
    return rows


def small_lights(run):
    figures = run("measure_speed", "lights")
    rows = []
    for choice, what in (("as_rich_as_needed", "at the default of 1 %"), ("all_sent", "all 64 sent, epsilon 0")):
        for setting in ("fast", "balanced"):
            for format in ("rgb8_linear", "rgb8"):
                none, all_lit = (figures.get(f"lights.{choice}.{setting}.{format}.{count}") for count in (0, 64))
                ratio, sent = None, "?"
                if none and all_lit:
                    sent = all_lit["lights"]
                    ratio = all_lit["ms"] / none["ms"]
                name = f"time with 64 small lights by that with none, {setting}, {FORMAT_NAMES[format]}, {what}"
                real = f"generated room, sphere of 1568x784, {sent} lights in the descriptor"
                # The limit applies at the default epsilon, where the estimator sends only the lights that it needs. The
                # time with all 64 sent is reported for comparison.
                rows.append(at_most(name, 1.10, ratio, "x", real) if choice == "as_rich_as_needed" else
                            reported(name, ratio, "x", real))
    return rows


def peers(run):
    figures = run("measure_peers")
    ms = lambda name: figures.get(name, {}).get("ms")
    ratio = lambda theirs, ours: ms(theirs) / ms(ours) if ms(theirs) and ms(ours) else None
    city = "city.exr, one thread, best of five in turns"
    rows = [
        at_least("Filament's route to nine coefficients by ours at balanced, the panorama's own floats", 50,
                 ratio("filament", "ours.floats"), "x", city),
        at_least("Filament's route to nine coefficients by ours at balanced, an 8-bit frame of as many pixels", 50,
                 ratio("filament", "ours.frame"), "x", city),
        at_least("S0's detection alone by our whole frame at balanced, the same 8-bit frame", 1,
                 ratio("s0_detection", "ours.frame"), "x", city),
    ]
    for name, what in (("ours.floats", "ours at balanced, floats"), ("filament", "Filament's route"),
                       ("median_cut", "median cut to 64 lights"), ("ours.frame", "ours at balanced, 8-bit frame"),
                       ("s0_detection", "S0's detection, 8-bit frame")):
        rows.append(reported(f"time of {what}", ms(name), "ms", city))
    for name, what in (("ours.floats", "ours"), ("filament", "Filament's nine coefficients"),
                       ("median_cut", "median cut's 64 lights")):
        error = percent(figures.get(name, {}).get("error"))
        rows.append(reported(f"irradiance error of {what}, city", error, "%", city))
    return rows


def flagged_share(items):
    return 100 * sum(item["flagged"] for item in items) / len(items) if items else None


def unless_flagged(figure, flagged):
    """The row, which does not hold if more than MOST_FLAGGED percent of its frames are flagged."""
    if flagged is None or flagged > MOST_FLAGGED:
        figure["holds"] = False
        figure["real"] += f"; {flagged or 0:.0f} % flagged"
    return figure


def error_of_scenes(items, what, most, most_median, real):
    """The rows of one sensor and epsilon: each scene's error in percent (if `most` is None, the largest one only), the
    median, and the share of flagged frames."""
    flagged = flagged_share(items)
    errors = [percent(item["error"]) for item in items if item["error"] is not None]
    rows = []
    if most is not None:
        for item in items:
            figure = at_most(f"irradiance error, {what}, {item['scene']}", most, percent(item["error"]), "%", real)
            rows.append(unless_flagged(figure, flagged))
        rows.append(equals(f"panoramas measured, {what}", PANORAMAS, len(errors), "", real))
    else:
        rows.append(reported(f"largest irradiance error, {what}", max(errors, default=None), "%", real))
    middle = median(errors) if len(errors) == PANORAMAS else None
    name = f"median irradiance error, {what}"
    rows.append(reported(name, middle, "%", real) if most_median is None else
                unless_flagged(at_most(name, most_median, middle, "%", real), flagged))
    rows.append(at_most(f"flagged, {what}", MOST_FLAGGED, flagged, "%", real))
    return rows


def accuracy(run):
    """`run` maps the arguments of measure_accuracy to its results."""
    rows = []
    one, half = run["--epsilon", "0.01"], run["--epsilon", "0.005"]
    what = "epsilon 1 %"
    rows += error_of_scenes(one, what, 1, None, ORACLE)
    for item in one:
        rows.append(at_most(f"encoded size, {what}, {item['scene']}", 256, item["bytes"], "B", ORACLE))
    sizes = [item["bytes"] for item in one]
    rows.append(at_most(f"median encoded size, {what}", 160, median(sizes) if len(sizes) == PANORAMAS else None, "B",
                        ORACLE))
    weighted = percent(max((item["weighted"] for item in one), default=None))
    rows.append(reported(f"largest luminance-weighted error, {what}", weighted, "%", ORACLE))
    what = "epsilon 0.5 %"
    rows += error_of_scenes(half, what, None, 0.5, ORACLE)
    rows.append(reported(f"median encoded size, {what}", median([item["bytes"] for item in half]), "B", ORACLE))
    rows.append(reported(f"largest encoded size, {what}", max((item["bytes"] for item in half), default=None), "B",
                         ORACLE))
    for sensor in SENSORS:
        items = run["--sensor", sensor]
        rows += error_of_scenes(items, f"8-bit sensor {sensor}", 3 if sensor == OWN_COLOR else None, 1.5, NOISY)
        if sensor != OWN_COLOR:
            over = [
                item["error"] / item["bound"] if item["bound"] else 0 for item in items if item["error"] is not None
            ]
            rows.append(
                at_most(
                    f"largest error by its own bound, 8-bit sensor {sensor}", 1, max(over, default=None), "x", NOISY
                )
            )
    lamps = [item for item in one if item["peak"] is not None and item["peak"] > LAMP_PEAK]
    for item in lamps:
        lamp = f"peak {item['peak']:.0f} times the mean, {2 * item['region_radius_deg']:.2g} deg wide"
        name = f"light direction, {item['scene']} ({lamp})"
        rows.append(at_most(name, 0.3, item["direction_deg"], "deg", ORACLE)
                    if item["region_radius_deg"] <= LAMP_RADIUS_DEG else
                    reported(name, item["direction_deg"], "deg", ORACLE))
    if not lamps:
        rows.append(at_most("light direction", 0.3, None, "deg", ORACLE))
    return rows + platforms(one)


def platforms(items):
    """Errors of the same light in the output formats of ARCore and ARKit."""
    real = "26 real panoramas, made from the panorama itself; oracle"
    rows = []
    for key, name in (("arcore", "ARCore-style output (main light and nine coefficients)"),
                      ("arkit", "ARKit-style output (nine coefficients)")):
        errors = [percent(item[key]) for item in items]
        rows.append(reported(f"median irradiance error, {name}", median(errors), "%", real))
        rows.append(reported(f"largest irradiance error, {name}", max(errors, default=None), "%", real))
    ours = [percent(item["error"]) for item in items]
    rows.append(reported("largest irradiance error, ours at epsilon 1 %, beside these", max(ours, default=None), "%",
                         ORACLE))
    return rows


def bound(items):
    rows = []
    for sensor, what in BOUND_SENSORS.items():
        whole = next((item for item in items if item["scene"] == "all" and item["sensor"] == sensor), {})
        frames, flagged = whole.get("frames", 0), whole.get("flagged", 0)
        unflagged = frames - flagged
        real = f"26 real panoramas, probe turning 30 deg/s, lamps switching, smoothing on; {what}; oracle"
        share = percent(flagged / frames) if frames else None
        held = percent(whole["held"] / unflagged) if unflagged else None
        rows.append(at_least(f"frames of the bound, {what}", BOUND_FRAMES, frames, "", real))
        rows.append(at_most(f"flagged frames of the bound, {what}", MOST_FLAGGED, share, "%", real))
        rows.append(unless_flagged(at_least(f"bound holds, {what}", 99, held, "%", real), share))
        rows.append(at_most(f"median of bound by error, {what}", 4, whole.get("median_ratio"), "x", real))
        rows.append(at_least(f"median of bound by error, {what}, no less than one", 1, whole.get("median_ratio"), "x",
                             real))
        rows.append(reported(f"median error of these frames, {what}", percent(whole.get("median_error")), "%", real))
    return rows


def balls(items):
    rows = []
    answers = {"reflections": "descriptor with a map of 32x32", "irradiance": "descriptor without a map",
               "as_sent": "the same without reconstruction"}
    for answer, answer_name in answers.items():
        sizes = [item["bytes"] for item in items if item["answer"] == answer]
        rows.append(reported(f"median encoded size, {answer_name}", median(sizes), "B", ORACLE))
        for ball in BALLS:
            chosen = [item for item in items if item["answer"] == answer and item["ball"] == ball]
            whole = len(chosen) == PANORAMAS
            rmse, si_rmse = PUBLISHED_BALLS.get(ball, (None, None))
            for key, name, beside in (("rmse_published", "RMSE, the literature's protocol", rmse),
                                      ("si_rmse_published", "si-RMSE, the literature's protocol", si_rmse),
                                      ("rmse", "RMSE, linear light", None), ("si_rmse", "si-RMSE, linear light", None)):
                value = median([item[key] for item in chosen]) if whole else None
                rows.append(reported(f"{ball} ball, {name}, median, {answer_name}", value, "", ORACLE, beside))
    return rows


def kernels(items, machine):
    """A row for every vector unit, format and number of exposures."""
    rows, targets = [], {}
    for item in items:
        named = re.fullmatch(r"float_vs_double\.(\w+)\.(\w+?)(_bracket)?", item["figure"])
        if named:
            targets.setdefault((named[1], bool(named[3])), {})[named[2]] = item["value"]
    real = f"random scenes, double oracle, {machine}"
    for (target, bracket), formats in sorted(targets.items()):
        what = "three exposures" if bracket else "one exposure"
        for format, value in sorted(formats.items()):
            name = f"coefficients, float against double, {target}, {format}, {what}"
            rows.append(at_most(name, 1e-5, value, "", real))
        rows.append(equals(f"formats compared, {target}, {what}", KERNEL_FORMATS, len(formats), "", real))
    if not rows:
        rows.append(at_most(f"coefficients, float against double, {machine}", 1e-5, None, "", real))
    return rows


def instructions(folder, say):
    def counted_row(rig, format, setting, map_edge=0):
        name = f"aarch64 (NEON) instructions a pixel, {setting}, {FORMAT_NAMES[format]}, {RIGS[rig]}"
        name += f", a map of {map_edge} texels in every frame" if map_edge else ""
        say(name)
        counted = None
        if folder:
            command = [folder / "measure_instructions", "--frames", "{}", rig, format, setting]
            command += ["--map", str(map_edge)] if map_edge else []
            counted = aarch64.instructions(command, WORK)
        value = None if counted is None else counted / COUNTED[rig]
        real = "city.exr, g++ -O3, qemu-user Cortex-A72, frame to encoded descriptor"
        limit = MOST_INSTRUCTIONS.get(format) if setting == "fast" and not map_edge else None
        return reported(name, value, "", real) if limit is None else at_most(name, limit, value, "", real)

    # Start-up takes half a minute a run, so the whole sphere is counted only for the formats with a limit.
    cases = [(rig, format, setting) for rig, formats in (("single", FORMAT_NAMES), ("equirect", MOST_INSTRUCTIONS))
             for format in formats for setting in SETTINGS]
    cases += [("single", "rgb8_linear", "fast", edge) for edge in (8, 64)]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(lambda case: counted_row(*case), cases))


def measure(folder, say):
    programs = Programs(folder, say)
    aarch64_folder, sysroot = aarch64.build(AARCH64_TARGETS, say)
    units = vector_units(programs)
    rows = timings(programs, units) + front(folder, say, next(iter(units)))

    accuracies = [("--epsilon", "0.01"), ("--epsilon", "0.005"), *(("--sensor", sensor) for sensor in SENSORS)]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        # Start the longest ones first.
        of_bound = pool.submit(programs.run, "measure_bound")
        of_extremes = pool.submit(programs.run, "measure_extremes")
        of_accuracy = {arguments: pool.submit(programs.run, "measure_accuracy", "--all", *arguments)
                       for arguments in accuracies}
        of_balls = pool.submit(programs.run, "measure_balls")
        of_kernels = pool.submit(programs.run, "measure_kernels")
        emulated = None
        if aarch64_folder:
            emulator = ("qemu-aarch64", "-cpu", "cortex-a72", "-L", sysroot)
            emulated = pool.submit(programs.run, "measure_kernels", prefix=emulator, folder=aarch64_folder)
        rows += accuracy({arguments: future.result() for arguments, future in of_accuracy.items()})
        rows += bound(of_bound.result())
        rows += balls(of_balls.result())
        rows += extremes(of_extremes.result())
        rows += kernels(of_kernels.result(), f"this machine, {platform.machine()}")
        rows += kernels(emulated.result() if emulated else [], "NEON under qemu-user, Cortex-A72")
    return rows + instructions(aarch64_folder, say)
