"""Part objects of topic light_field: image-based objects (lightwell/image_object.hpp) on pictures that
tests/reference/image_object renders with Embree: eight views, one every 4 degrees of turn, each under 61 lights, one
every 3 degrees of arc; twelve lights midway between them are the truth. PSNR is that of sRGB values, over the object's
pixels. Scene, positions and thresholds were committed before anything was measured.
"""
import json
import math
import pathlib
import subprocess

from figure_topics.programs import rows_of_program
from figure_topics.rows import at_least, at_most, reported, row
from figure_topics.tests import ROOT

TARGETS = ["measure_image_object"]

# Interpolated against nearest, dB: away from edges of shadows and highlights, and over all of the object.
AWAY_GAIN, SOFT_GAIN = 20, 6
# The best relightable splats on captured objects (another data set), and the best without a network.
PUBLISHED_DB, PUBLISHED_WITHOUT_NETWORK_DB = 38.5, 35.9
RAW_RATIO, JPEG_RATIO = 30, 3
# 60 frames a second.
FRAME_MS = 1000 / 60

REAL = "rendered by Embree, direct light, 256x256, 61 lights a view"
NOT_HERE = "measure_image_object was not built: it needs Embree (libembree-dev)"


def between_rows(line):
    what = f"{line['lights']} lights, {line['data']}: "
    real = f"{REAL}; {line['views']} views, 12 lights midway between captured ones"
    gain, away = line["smooth_db"] - line["nearest_db"], line["smooth_away_db"] - line["nearest_away_db"]
    finest = "finest" in line["data"]
    soft = line["lights"] != "point"
    rows = [reported(what + f"{name}, PSNR over the object", line[key + "_db"], "dB", real)
            for key, name in (("nearest", "nearest (seed)"), ("smooth", "interpolated"))]
    rows += [reported(what + f"{name}, PSNR away from edges and highlights", line[key + "_away_db"], "dB",
                      f"{real}; {100 * line['away_share']:.0f} % of the object")
             for key, name in (("nearest", "nearest (seed)"), ("smooth", "interpolated"))]
    name = what + "interpolated above nearest, over the object"
    rows.append(at_least(name, SOFT_GAIN, gain, "dB", real) if soft and finest
                else reported(name, gain, "dB", real + ("" if soft else "; a moving hard edge allows 3 dB")))
    name = what + "interpolated above nearest, away from edges and highlights"
    rows.append(at_least(name, AWAY_GAIN, away, "dB", real) if finest else reported(name, away, "dB", real))
    rows.append(reported(what + "PSNR at captured lights", line["captured_db"], "dB", real))
    return rows


def bytes_at(points, db):
    """Bytes a view of a codec at that PSNR, log-linear between its settings; None outside of them."""
    points = sorted((p["db"], p["bytes_per_view"]) for p in points)
    for (low_db, low), (high_db, high) in zip(points, points[1:]):
        if low_db <= db <= high_db:
            share = (db - low_db) / (high_db - low_db)
            return math.exp(math.log(low) + share * (math.log(high) - math.log(low)))
    return None


def ratio(a, b):
    return a / b if a and b else None


def rate_rows(lines):
    codecs = {}
    for line in lines:
        codecs.setdefault(line["codec"], []).append(line)
    ours = codecs.get("lightwell", [])
    preset = next((p for p in ours if p["setting"] == "default"), {})
    db, size = preset.get("db"), preset.get("bytes_per_view")
    if db is None:
        return [row("size against quality", "measured", "not measured", "", False, REAL)]
    jpegs = [b for name in ("jpeg 4:4:4", "jpeg 4:2:0") if (b := bytes_at(codecs.get(name, []), db))]
    x264 = bytes_at(codecs.get("x264 4:4:4", []), db)
    real = f"{REAL}; 8 bits; {preset['views']} views, each encoded and decoded by itself"
    rows = [at_least("default steps: PSNR at captured lights", PUBLISHED_DB, db, "dB",
                     f"{real}; published on captured objects: {PUBLISHED_DB} relightable splats, "
                     f"{PUBLISHED_WITHOUT_NETWORK_DB} without a network"),
            reported("default steps: bytes of a view", size, "bytes", real),
            at_least("default steps: raw pictures of 8 bits relative to it", RAW_RATIO, preset["raw_ratio"], "x", real),
            at_least("default steps: JPEG of equal PSNR relative to it", JPEG_RATIO,
                     ratio(min(jpegs, default=None), size), "x",
                     f"{real}; the smaller of 4:4:4 and 4:2:0, optimised, progressive"),
            reported("default steps: time to decode a view of 256x256", preset["decode_ms"], "ms", real),
            reported("default steps: time to encode a view of 256x256", preset["encode_ms"], "ms", real)]
    if "x264 4:4:4" in codecs:
        rows.append(reported("default steps: x264 of a view's lights at equal PSNR relative to it", ratio(x264, size),
                             "x", f"{real}; ffmpeg, preset slow, 4:4:4, {len(codecs['x264 4:4:4'])} settings"))
    for other in ours:
        rows.append(reported(f"{other['setting']}: PSNR, with {other['bytes_per_view']:.0f} bytes a view", other["db"],
                             "dB", real))
    return rows


def model_row(line):
    return reported(f"{line['model']}, not compressed: PSNR at captured lights", line["db"], "dB",
                    f"{REAL}; c reduced in {line['reduced']} pixels of 8 views")


def speed_rows(line):
    real = (f"{line['side']}x{line['side']}, {100 * line['covered']:.0f} % of it covered, 3 coloured lights between "
            f"captured ones, with the shadows on the object; one thread; memcpy {line['memcpy_gb_s']:.1f} GB/s")
    return [at_most("relighting a view and casting its shadows on the ground", FRAME_MS,
                    line["relight_ms"] + line["shadow_ms"], "ms",
                    f"{real}; shadows of lights of 2 degrees radius on 128x128 texels"),
            reported("relighting a view", line["relight_ms"], "ms", real),
            reported("casting the shadows", line["shadow_ms"], "ms", "128x128 texels, 32 samples of each light"),
            reported("relighting a view, relative to memcpy of what it reads", line["memcpy_ratio"], "x",
                     f"{real}; reads {line['bytes_read'] / 1e6:.1f} MB"),
            reported("relighting a view, 32 lights", line["relight_32_lights_ms"], "ms", real),
            reported("decoding a view", line["decode_ms"], "ms", f"{real}; {line['bytes_per_view']} bytes")]


def measure_objects(programs, say):
    """Yields the rows. Renders views into a folder beside the programs, once."""
    program = programs / "measure_image_object"
    if not program.exists():
        yield row("image-based objects", "measured", "not measured", "", False, NOT_HERE)
        return
    rates = []

    def rows_of(line):
        if line["part"] == "between":
            return between_rows(line)
        if line["part"] == "model":
            return [model_row(line)]
        if line["part"] == "speed":
            return rate_rows(rates) + speed_rows(line)
        rates.append(line)
        return []

    yield from rows_of_program([program, "--renders", programs.parent / "image_object_renders"], rows_of, say)
    if rates:
        picture = ROOT / "out/image_object.png"
        picture.parent.mkdir(exist_ok=True)
        drawn = subprocess.run(["/usr/bin/python3", pathlib.Path(__file__).with_name("image_object_chart.py"), picture],
                               input="\n".join(map(json.dumps, rates)), text=True)
        say(f"size, quality and time: {picture}" if drawn.returncode == 0 else "the chart could not be drawn")
