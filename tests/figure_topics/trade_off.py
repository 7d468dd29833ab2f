"""Topic trade_off: what a cheaper frame and a shorter message cost in accuracy: interleaved sampling of the panorama
estimator (panorama.interleave), its cheapest setting, fastest, and the limit of a descriptor's size
(panorama.max_bytes; firmware/estimate/README.md). Motions, exposures, scenes and sizes are in
tests/measure/measure_interleave.cpp and measure_bytes.cpp. The error bound of all of these in drawn groups of frames
(bound_campaign), a million frames through one estimator (measure_million), and the CPU time of the whole daemon beside
OpenCV's resize (measure_daemon). At its end it draws these trades beside those of the marker and the plane to
out/trade_off.png, which is firmware/estimate/trade_off.png.
"""
import json
import pathlib
import subprocess

from figure_topics import aarch64, bound_campaign, specular
from figure_topics.programs import rows_of_program
from figure_topics.rows import at_least, at_most, equals, known_short, reported, row

TARGETS = [bound_campaign.PROGRAM, "measure_bytes", "measure_daemon", "measure_interleave", "measure_marker_trade",
           "measure_million", "measure_specular"]
ALL_PANORAMAS = True
# What is asked of the cheapest setting at rest, in the cases that have no change.
CHEAPEST = "fastest"
AT_REST = ("still", "brackets")
MEDIAN_ERROR, WORST_ERROR = 0.02, 0.04
HELD = 0.999
INSTRUCTIONS = {"rgb8_linear": 1.5, "yuyv": 2.5}
# Of balanced, and of its brackets of three, a pixel of one exposure.
BALANCED = {"rgb8_linear": 4.5, "bayer8": 4, "rgb8": 6, "nv12": 7, "yuyv": 7}
BALANCED_BRACKET = 20
# CPU time of the whole daemon by that of cv::resize to 160x120, by setting.
BY_RESIZE = {"balanced": 2.5, "fastest": 1}
# Of the ends of the front, exact by fastest, of YUYV, which cameras deliver.
SPAN = 8
# Of a lamp that is smaller than a quad of the mosaic: whole frames at exact have it, too (firmware/estimate/README.md,
# Limits).
SHORT = "brackets", "bayer12"
SHORT_REASON = "a lamp as small as a pixel of a mosaic, as in whole frames at exact"
COUNTED = {"rgb8_linear": "linear RGB8", "rgb8": "sRGB RGB8", "bayer8": "Bayer8", "nv12": "NV12", "yuyv": "YUYV"}
FORMATS = {"bayer12": "Bayer12", "rgb8": "RGB8"}
BYTES_FORMATS = ("rgb_f32", "rgb8")
BYTES_SHORT = "rgb8", 192
BYTES_SHORT_REASON = "one epsilon spends more bytes on difficult scenes; of 192 bytes 14 are counted and not sent"
SETTINGS = ("fastest", "fast", "balanced", "exact")
INTERLEAVES = (2, 4, 8)
BRACKET_POINTS = (("fastest", 16), ("balanced", 1), ("balanced", 4))
# Frames of the two counted runs: whole rotations of 16; of whole frames fewer are enough.
WORK = (33, 65)
WHOLE_WORK = (3, 8)
PIXELS = 1280 * 960
MILLION = 1_000_000
# Relative change of the irradiance of the same frame: the float tolerance of panorama_extremes.
MAX_DRIFT = 1e-5
# Pages that the C library touches late; a leak of one byte a frame is 1,000 kB.
MAX_GROWTH_KB = 64
# The points of the page: settings with interleave, of the choices of measure_interleave.
PAGE_POINTS = (("fastest", 16), *(("balanced", n) for n in (1, 2, 4, 8, 16)), ("exact", 1), ("exact", 16))
REAL = "city.exr, one lens of 1280x960, constant light, g++ -O3, qemu-user Cortex-A72"


def cheapest_rows(line):
    what = (f"{line['case']}, {FORMATS[line['format']]}, cheapest point whose bound is at most "
            f"{line['asked_bound']:g}: scenes at ")
    return [reported(what + point, count, "", f"{line['scenes']} real panoramas")
            for point, count in line["cheapest"].items()]


def interleave_rows(line):
    if "cheapest" in line:
        return cheapest_rows(line)
    read, unread = line["read"], line["unread"]
    what = f"{line['case']}, {FORMATS[line['format']]}, {line['setting']}, interleave {line['interleave']}: "
    real = (f"{line['scenes']} real panoramas, {read['frames']} frames of 2 x 640x480 with noise, "
            f"{read['flagged']} flagged")
    judged = read["frames"] - read["flagged"]
    asked = line["setting"] == CHEAPEST and line["case"] in AT_REST

    def error(name, limit, *rest):
        if not asked:
            return reported(name, *rest)
        figure = at_most(name, limit, *rest)
        short = not figure["holds"] and (line["case"], line["format"]) == SHORT
        return known_short(figure, SHORT_REASON) if short else figure

    rows = [reported(what + "difference of the irradiance to that of whole frames, median", read["median_difference"],
                     "", real),
            reported(what + "the same, largest", read["worst_difference"], "", real),
            error(what + "error of the irradiance, median", MEDIAN_ERROR, read["median_error"], "", real),
            error(what + "error of the irradiance, largest", WORST_ERROR, read["worst_error"], "", real),
            at_least(what + "share of frames within the bound", HELD, read["held"] / judged if judged else None, "",
                     real),
            reported(what + "bound over error, median", read["median_ratio"], "", real)]
    if unread["frames"]:
        rows += [reported(what + "frames between a lamp's switch and its being read: share within the bound",
                          unread["held"] / max(unread["frames"] - unread["flagged"], 1), "",
                          f"{unread['frames']} frames, {unread['flagged']} flagged"),
                 reported(what + "the same: largest error", unread["worst_error"], "", real)]
    return rows


def bytes_rows(line):
    size = line["max_bytes"]
    limit = f"at most {size} bytes" if size else "no limit of bytes"
    sensor = "ideal" if line["format"] == "rgb_f32" else "8-bit RGB, brackets of three"
    what = f"{line['setting']}, {limit}, {sensor}: "
    real = f"{line['frames']} real panoramas, 2 x 640x480, {line['flagged']} flagged"
    judged = line["frames"] - line["flagged"]
    rows = [at_most(what + "longest message", size, line["largest_bytes"], "B", real)] if size else []
    rows += [reported(what + "size, mean", line["mean_bytes"], "B", real),
             reported(what + "error of the irradiance, median", 100 * line["median_error"], "%", real),
             reported(what + "error of the irradiance, largest", 100 * line["worst_error"], "%", real),
             reported(what + "bound, median", 100 * line["median_bound"], "%", real),
             reported(what + "bound, largest", 100 * line["worst_bound"], "%", real),
             equals(what + "frames within the bound", judged, line["held"], "", real),
             reported(what + "fields beside lights and harmonics, median", line["median_fixed"], "B", real),
             reported(what + "fields beside lights and harmonics, largest", line["largest_fixed"], "B", real)]
    if "same_mean" in line:
        alone, own = line["same_mean"], line["same_size"]
        at = f"epsilon {100 * alone['epsilon']:.2g} % alone, {alone['mean_bytes']:.0f} B in the mean"
        median = at_most(what + f"median error against {at}", 100 * alone["median_error"],
                         100 * line["median_error"], "%", real)
        short = not median["holds"] and (line["format"], size) == BYTES_SHORT
        rows += [known_short(median, BYTES_SHORT_REASON) if short else median,
                 reported(what + f"largest error of {at}", 100 * alone["worst_error"], "%", real),
                 at_most(what + "error by that of the best epsilon of each panorama in this size, median", 1,
                         own["median_ratio"], "x", f"{real}, {own['no_epsilon']} without such an epsilon"),
                 reported(what + "the same, largest", own["worst_ratio"], "x", real)]
    return rows


def counter(say):
    """A function of format, setting, options and work that gives the instructions of a pixel, or None."""
    folder, _ = aarch64.build(["measure_instructions"], say)

    def counted(name, setting, options, work):
        say(f"aarch64: {name}, {setting}, {' '.join(options)}")
        value = folder and aarch64.instructions(
            [folder / "measure_instructions", *options, "--frames", "{}", "single", name, setting], work)
        return value / PIXELS if value else None

    return counted


def limited(what, limit, value):
    return at_most(what, limit, value, "", REAL) if limit else reported(what, value, "", REAL)


def counted_rows(counted):
    for name, text in COUNTED.items():
        value = {}
        for setting in SETTINGS:
            value[setting] = counted(name, setting, [], WORK if setting == CHEAPEST else WHOLE_WORK)
            what = f"aarch64 (NEON) instructions a pixel, {setting}, {text}"
            limit = {CHEAPEST: INSTRUCTIONS, "balanced": BALANCED}.get(setting, {}).get(name)
            yield limited(what, limit, value[setting])
        ends = value["exact"] / value[CHEAPEST] if value["exact"] and value[CHEAPEST] else None
        what = f"aarch64 instructions, exact by fastest, {text}"
        yield at_least(what, SPAN, ends, "x", REAL) if name == "yuyv" else reported(what, ends, "x", REAL)
        for interleave in INTERLEAVES:
            yield reported(f"aarch64 (NEON) instructions a pixel, balanced, {text}, interleave {interleave}",
                           counted(name, "balanced", ["--interleave", str(interleave)], WORK), "", REAL)
        for setting, interleave in BRACKET_POINTS:
            whole = setting == "balanced" and interleave == 1
            value = counted(name, setting, ["--exposures", "3", "--interleave", str(interleave)],
                            WHOLE_WORK if whole else WORK)
            yield limited(f"aarch64 (NEON) instructions a pixel of one exposure, {setting}, interleave {interleave}, "
                          f"{text}, bracket of three", BALANCED_BRACKET if whole else None, value)


def keeping(lines, program, rows_of):
    """As `rows_of`; appends each line to `lines`, with the program's name."""
    def rows(line):
        lines.append({**line, "program": program})
        return rows_of(line)

    return rows


def marker_rows(line):
    if line["rms"] is None:
        return []
    return [reported(f"marker, {line['what']}: error of the irradiance, median", line["rms"], "",
                     f"{line['memcpy_ratio']:.1f} times memcpy")]


def page_rows(programs, counted, lines, say):
    """Counts the points of the page, measures marker and plane, and draws them with the lines measured so far."""
    for setting, interleave in PAGE_POINTS:
        work = WHOLE_WORK if interleave == 1 else WORK
        value = counted("rgb8", setting, ["--exposures", "3", "--interleave", str(interleave)], work)
        yield reported(f"page: instructions a pixel of one exposure, RGB8, bracket of three, {setting}, {interleave}",
                       value, "", REAL)
        if value:
            lines.append({"program": "measure_instructions", "setting": setting, "interleave": interleave,
                          "per_pixel": value})

    yield from rows_of_program([programs / "measure_marker_trade"], keeping(lines, "measure_marker_trade", marker_rows),
                               say)
    yield from rows_of_program(
        [programs / "measure_specular", "--trade", "--fill", "--sequence", specular.TRADE_SEQUENCE],
        keeping(lines, "measure_specular", specular.trade), say)
    picture = pathlib.Path("out/trade_off.png").resolve()
    picture.parent.mkdir(exist_ok=True)
    drawn = subprocess.run(["/usr/bin/python3", pathlib.Path(__file__).with_name("trade_off_chart.py"), picture],
                           input="".join(json.dumps(line) + "\n" for line in lines), text=True)
    yield row("page of the trade", "drawn", picture.name if drawn.returncode == 0 else "not drawn", "",
              drawn.returncode == 0, str(picture))


def million_rows(line):
    name, value = line["figure"].removeprefix("million."), line["value"]
    what, real = f"a million frames: {name}", "one estimator, all settings in turn, a day; 2 x 160x120, RGB8 with noise"
    if name == "frames":
        return [at_least(what, MILLION, value, "", real)]
    if name in ("unsound", "refused") or name.startswith("swaps."):
        return [equals(what, 0, value, "", real)]
    if name == "tracks.brightest":
        return [equals(what, 1, value, "", real)]
    limit = {"drift": MAX_DRIFT, "growth_kb": MAX_GROWTH_KB}.get(name)
    return [reported(what, value, "", real) if limit is None else at_most(what, limit, value, "", real)]


def daemon_rows(line):
    what = f"the whole daemon, {line['lenses']} x {line['size']}, {line['sensor']}: "
    real = f"{line['vector']}, at 30/s, one client, city; {line['dropped']} frames dropped"
    rows = [equals(what + "frames dropped while it was measured", 0, line["dropped"], "", real)]
    for setting in ("balanced", "fast", "fastest"):
        value = line[setting + "_ms"]
        ratio, name = value / line["resize_ms"], what + f"CPU time a frame at {setting} by cv::resize INTER_AREA"
        rows += [at_most(name, BY_RESIZE[setting], ratio, "x", real) if setting in BY_RESIZE
                 else reported(name, ratio, "x", real),
                 reported(what + f"CPU time a frame at {setting}", value, "ms", real)]
    return rows + [reported(what + f"CPU time of {text}", line[key], "ms", real) for key, text in (
        ("resize_ms", "cv::resize"), ("detection_ms", "S0's detection"), ("memcpy_ms", "memcpy"))]


# The page contains the rows of bytes and, of interleave, those of RGB8 in brackets.
PARTS = ("bytes", "interleave", "bound", "million", "daemon", "instructions", "page")


def measure(programs, say, only=PARTS):
    lines = []
    if "bytes" in only or "page" in only:
        for name in BYTES_FORMATS:
            yield from rows_of_program([programs / "measure_bytes", "--format", name],
                                       keeping(lines, "measure_bytes", bytes_rows), say)
    if "interleave" in only:
        yield from rows_of_program([programs / "measure_interleave"], interleave_rows, say)
    if "interleave" in only or "page" in only:
        yield from rows_of_program([programs / "measure_interleave", "--case", "brackets", "--format", "rgb8"],
                                   keeping(lines, "measure_interleave", interleave_rows), say)
    if "bound" in only:
        yield from bound_campaign.rows(programs, say)
    if "million" in only:
        yield from rows_of_program([programs / "measure_million"], million_rows, say)
    if "daemon" in only:
        yield from rows_of_program(["/usr/bin/env", "OPENCV_CPU_DISABLE=AVX512_SKX", programs / "measure_daemon",
                                    "--vector", "avx2"], daemon_rows, say)
    if "instructions" in only or "page" in only:
        counted = counter(say)
    if "instructions" in only:
        yield from counted_rows(counted)
    if "page" in only:
        yield from page_rows(programs, counted, lines, say)
