#!/usr/bin/env python3
"""Renders the trials of scenes.py with Mitsuba 3. Shares no code with Lightwell.

    render.py [--minutes 30] [NAME...]   what is missing of trials.jsonl; writes, for each trial,
        NAME_without.jpg, NAME_with.jpg  the camera's picture without and with the object, sRGB, gain as in the truth
        NAME_top.exr, NAME_away.exr      the panorama at the object's top and a metre away, without the object
    render.py --seed N --out FOLDER      the same with other noise, elsewhere
    render.py --check                    the table's irradiance below one lamp against the closed form; the lamp's
                                         centroid in a panorama

Exit: 0 done, 1 something disagrees.
"""

import argparse
import io
import json
import math
import os
import sys
import time
from pathlib import Path

import numpy as np
import OpenEXR
from PIL import Image

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
sys.path.insert(0, str(HERE.parent / "marker_scenes"))
import llvm_library  # noqa: E402, F401 (before drjit)
import drjit as dr  # noqa: E402
import mitsuba as mi  # noqa: E402

import bodies  # noqa: E402
import scenes  # noqa: E402

mi.set_variant("llvm_ad_rgb")
mi.set_log_level(mi.LogLevel.Error)

PANORAMA = (1024, 512)
SAMPLES = {"picture": 8, "shadow": 48, "panorama": 16}  # "shadow": the part of the picture around object and shadow
PASS_SAMPLES = 8e6
MAX_DEPTH = 6
JPEG_QUALITY = 90
WHITE_SHARE = 0.8   # linear picture value of the 99th percentile
DWA_LEVEL = 100.0   # of OpenEXR's lossy compression: 0.7 % RMS, below the noise; the lamp's power changes by 0.1 %


def rgb(c):
    return {"type": "rgb", "value": [float(v) for v in c]}


def matte(c):
    return {"type": "diffuse", "reflectance": rgb(c)}


def bitmap(array):
    return mi.Bitmap(np.ascontiguousarray(array, np.float32), mi.Bitmap.PixelFormat.RGB)


def sky(t: scenes.Trial) -> np.ndarray:
    """Radiance of the sky: a gradient and five wide spots, scaled to the trial's share of irradiance."""
    h, w = 64, 128
    theta = np.pi * (0.5 - (np.arange(h) + 0.5) / h)[:, None]
    phi = 2 * np.pi * ((np.arange(w) + 0.5) / w - 0.5)[None]
    d = np.stack(np.broadcast_arrays(np.cos(theta) * np.sin(phi), np.sin(theta), -np.cos(theta) * np.cos(phi)), -1)
    out = (1 + 0.5 * d[..., 1:2]) * np.array([0.9, 1.0, 1.15])
    for k in range(5):
        key = f"{t.name}.sky{k}"
        axis = scenes.direction(scenes.number(key + "a", 0, 360), scenes.number(key + "e", 0, 60))
        width = math.radians(scenes.number(key + "w", 15, 40))
        color = np.array([scenes.number(key + c, 0.5, 4) for c in "rgb"])
        out = out + color * np.exp(-(1 - d @ np.array(axis))[..., None] / (1 - math.cos(width)))
    weight = np.maximum(d[..., 1], 0) * np.cos(theta) * (np.pi / h) * (2 * np.pi / w)
    level = (weight[..., None] * out).sum((0, 1)) @ np.array([0.2126, 0.7152, 0.0722])
    return out * t.ambient_share * scenes.LAMP_IRRADIANCE / level


def box(center, size, color, turn_deg=0.0):
    at = mi.ScalarTransform4f().rotate([0, 1, 0], turn_deg).translate(list(center)).scale([s / 2 for s in size])
    return {"type": "cube", "to_world": at, "bsdf": matte(color)}


def tag_texture() -> np.ndarray:
    # Row 0 of a bitmap is at the bottom of the rectangle.
    cells = 1 - np.array(bodies.cells_of(scenes.TAG_ID), float)[::-1]
    return np.repeat((0.04 + 0.76 * cells)[..., None], 3, 2)


def room(t: scenes.Trial) -> dict:
    """Two walls that meet behind the table as seen from the lamp, with shelves and pictures, and a floor."""
    turn, out = t.room_azimuth_deg - 45, {}
    colors = [[scenes.number(f"{t.name}.wall{k}{c}", 0.2, 0.8) for c in "rgb"] for k in range(7)]
    shapes = [box((0, 0.75, 3.55), (7.2, 3.0, 0.1), colors[0], turn),
              box((3.55, 0.75, 0), (0.1, 3.0, 7.2), colors[1], turn)]
    for k in range(5):
        x, y, w, h = (scenes.number(f"{t.name}.picture{k}{c}", *r) for c, r in
                      (("x", (-2.5, 2.5)), ("y", (-0.2, 1.7)), ("w", (0.3, 1.2)), ("h", (0.3, 0.9))))
        shapes.append(box((x, y, 3.42), (w, h, 0.15), colors[2 + k], turn))
        shapes.append(box((3.42, y, -x), (0.15, h, w), colors[6 - k], turn))
    shapes.append(box((0, scenes.FLOOR_Y - 0.05, 0), (14, 0.1, 14), (0.35, 0.28, 0.2), turn))
    for i, shape in enumerate(shapes):
        out[f"room_{i}"] = shape
    return out


def sphere_lamp(center, radius, radiance):
    return {"type": "sphere", "center": list(center), "radius": radius, "bsdf": matte((0, 0, 0)),
            "emitter": {"type": "area", "radiance": rgb(radiance)}}


def scene_of(t: scenes.Trial, with_object: bool):
    at = mi.ScalarTransform4f
    d = {"type": "scene", **room(t),
         # Found by reflected rays; sampled as an emitter it would take samples from the lamp.
         "sky": {"type": "envmap", "bitmap": bitmap(sky(t)), "sampling_weight": 0.0},
         "lamp": sphere_lamp(t.lamp(), t.radius_m, t.lamp_radiance()),
         "table": box((0, -0.015, 0), (scenes.TABLE_M[0], 0.03, scenes.TABLE_M[1]), scenes.TABLE_ALBEDO)}
    # Ten cells, of which the black border and what it encloses are the tag's size.
    half = scenes.TAG_SIZE_M * 10 / 8 / 2
    place = at().translate([scenes.TAG_PLACE[0], 2e-4, scenes.TAG_PLACE[1]]).rotate([1, 0, 0], -90).scale(
        [half, half, 1])
    cells = {"type": "bitmap", "bitmap": bitmap(tag_texture()), "raw": True, "filter_type": "nearest"}
    d["tag"] = {"type": "rectangle", "to_world": place, "bsdf": {"type": "diffuse", "reflectance": cells}}
    if with_object:
        r, h, skin = scenes.OBJECT_DIAMETER_M / 2, scenes.OBJECT_HEIGHT_M, matte(scenes.OBJECT_ALBEDO)
        d["object"] = {"type": "cylinder", "p0": [0, 0, 0], "p1": [0, h, 0], "radius": r, "bsdf": skin}
        d["top"] = {"type": "disk", "to_world": at().translate([0, h, 0]).rotate([1, 0, 0], -90).scale([r, r, 1]),
                    "bsdf": skin}
    return mi.load_dict(d)


def traced(scene, window, spp, seed, rays) -> np.ndarray:
    """(height, width, 3) mean radiance of each pixel of a window (left, top, width, height); `rays(column, row)` are
    directions for places in pixels."""
    integrator = mi.load_dict({"type": "path", "max_depth": MAX_DEPTH, "rr_depth": 100})
    left, top, width, height = window
    per_pass = min(spp, max(1, int(PASS_SAMPLES / (width * height))))
    total, passes = np.zeros((height, width, 3)), math.ceil(spp / per_pass)
    for k in range(passes):
        n = width * height * per_pass
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed + k, n)
        pixel = dr.arange(mi.UInt32, n) // per_pass
        row = pixel // width
        jitter = sampler.next_2d()
        origin, direction = rays(mi.Float(pixel - row * width) + jitter.x + left, mi.Float(row) + jitter.y + top)
        color, _, _ = integrator.sample(scene, sampler, mi.RayDifferential3f(mi.Ray3f(origin, direction)))
        dr.eval(color)
        total += np.stack([np.array(dr.block_sum(c, per_pass)) for c in color], -1).reshape(height, width, 3)
    return total / (passes * per_pass)


def pixel_of(point) -> tuple[float, float]:
    c, (position, right, up, back) = scenes.CAMERA, scenes.camera_axes()
    x, y, z = (float(np.dot(np.subtract(point, position), axis)) for axis in (right, up, back))
    return c["cx"] + c["fx"] * x / -z, c["cy"] - c["fy"] * y / -z


def shadow_window(t: scenes.Trial) -> tuple[int, int, int, int]:
    """Around the object and its shadow, with a margin of 2 cm."""
    toward, r = t.to_lamp(), scenes.OBJECT_DIAMETER_M / 2 + 0.02
    flat = math.hypot(toward[0], toward[2])
    tip = [-toward[0] / flat * t.shadow_m(), 0, -toward[2] / flat * t.shadow_m()]
    places = [pixel_of((p[0] + a, p[1], p[2] + b)) for p in ([0, 0, 0], [0, scenes.OBJECT_HEIGHT_M, 0], tip)
              for a in (-r, r) for b in (-r, r)]
    x, y = zip(*places)
    left, top = max(0, int(min(x))), max(0, int(min(y)))
    return left, top, min(scenes.CAMERA["width"], int(max(x)) + 1) - left, min(scenes.CAMERA["height"],
                                                                               int(max(y)) + 1) - top


def camera_rays(column, row):
    # The centre of the top left pixel is (0, 0).
    c, (position, right, up, back) = scenes.CAMERA, scenes.camera_axes()
    x, y = (column - 0.5 - c["cx"]) / c["fx"], (c["cy"] - row + 0.5) / c["fy"]
    d = [x * r + y * u - b for r, u, b in zip(right, up, back)]
    return mi.Point3f(*position), dr.normalize(mi.Vector3f(*d))


def picture(scene, window, seed) -> np.ndarray:
    """With more samples in the window."""
    width, height = scenes.CAMERA["width"], scenes.CAMERA["height"]
    out = traced(scene, (0, 0, width, height), SAMPLES["picture"], seed, camera_rays)
    left, top, w, h = window
    out[top:top + h, left:left + w] = traced(scene, window, SAMPLES["shadow"], seed + 10_000, camera_rays)
    return out


def panorama(scene, eye, seed) -> np.ndarray:
    width, height = PANORAMA

    def rays(column, row):
        phi, theta = 2 * dr.pi * (column / width - 0.5), dr.pi * (0.5 - row / height)
        return mi.Point3f(*eye), mi.Vector3f(dr.cos(theta) * dr.sin(phi), dr.sin(theta), -dr.cos(theta) * dr.cos(phi))

    return traced(scene, (0, 0, width, height), SAMPLES["panorama"], seed, rays)


def jpeg(linear: np.ndarray) -> bytes:
    v = np.clip(linear, 0, 1)
    srgb = np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)
    out = io.BytesIO()
    Image.fromarray((255 * srgb + 0.5).astype(np.uint8)).save(out, "JPEG", quality=JPEG_QUALITY)
    return out.getvalue()


def write_exr(path: Path, radiance: np.ndarray) -> None:
    header = {"compression": OpenEXR.DWAA_COMPRESSION, "type": OpenEXR.scanlineimage, "dwaCompressionLevel": DWA_LEVEL}
    partial = path.with_suffix(".part")
    OpenEXR.File(header, {"RGB": radiance.astype(np.float16)}).write(str(partial))
    os.replace(partial, path)


def lines_of(path: Path) -> dict[str, dict]:
    if not path.exists():
        return {}
    return {item["name"]: item for item in map(json.loads, path.read_text().splitlines())}


def render(t: scenes.Trial, out: Path, seed: int) -> dict:
    seed += 100_000 * (int(t.name) + 1)
    without, with_object = scene_of(t, False), scene_of(t, True)
    window = shadow_window(t)
    bare = picture(without, window, seed)
    gain = WHITE_SHARE / np.percentile(bare.max(2), 99)
    (out / f"{t.name}_without.jpg").write_bytes(jpeg(gain * bare))
    (out / f"{t.name}_with.jpg").write_bytes(jpeg(gain * picture(with_object, window, seed + 20_000)))
    for place, eye in (("top", scenes.PROBE_TOP), ("away", t.probe_away())):
        radiance = panorama(without, eye, seed + 40_000 + 20_000 * (place == "away"))
        write_exr(out / f"{t.name}_{place}.exr", np.minimum(radiance, 65504))
    return scenes.truth(t) | {"gain": gain}


def check() -> bool:
    ok, t = True, scenes.trial(1)
    lamp = mi.load_dict({"type": "scene", "lamp": sphere_lamp(t.lamp(), t.radius_m, t.lamp_radiance()),
                         "table": box((0, -0.015, 0), (3, 0.03, 3), (0.5,) * 3)})
    seen = picture(lamp, (600, 440, 80, 80), 1)
    # The closed form of a sphere above the horizon: E = L pi sin²(rho) cos at the table's middle.
    c, r = map(round, pixel_of((0, 0, 0)))
    mean = seen[r - 3:r + 4, c - 3:c + 4].mean((0, 1))
    to_lamp = np.array(t.lamp())
    sine2, cosine = t.radius_m**2 / (to_lamp @ to_lamp), to_lamp[1] / np.linalg.norm(to_lamp)
    truth = 0.5 / math.pi * np.array(t.lamp_radiance()) * math.pi * sine2 * cosine
    print("table below one lamp:", mean, "closed form:", truth)
    ok &= bool(np.all(np.abs(mean / truth - 1) < 0.01))
    view = panorama(lamp, scenes.PROBE_TOP, 2)
    bright = np.where(view[..., 1] > view[..., 1].max() / 20, view[..., 1], 0)
    row, column = ((bright * axis).sum() / bright.sum() + 0.5 for axis in np.mgrid[:PANORAMA[1], :PANORAMA[0]])
    phi, theta = 2 * np.pi * (column / PANORAMA[0] - 0.5), np.pi * (0.5 - row / PANORAMA[1])
    d = np.array([np.cos(theta) * np.sin(phi), np.sin(theta), -np.cos(theta) * np.cos(phi)])
    angle = math.degrees(math.acos(min(1.0, float(d @ np.array(t.to_lamp())))))
    print(f"centroid of the lamp in the panorama: {angle:.3f} degrees from the truth")
    return ok and angle < 0.05


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--out", type=Path, default=HERE)
    parser.add_argument("--seed", type=int, default=0, help="another one gives other noise: multiples of 10000000")
    parser.add_argument("--check", action="store_true")
    args = parser.parse_args()
    if args.check:
        return 0 if check() else 1
    start, path = time.time(), args.out / "trials.jsonl"
    (args.out / "setup.json").write_text(json.dumps(scenes.setup(), indent=1) + "\n")
    items = lines_of(path)
    for t in scenes.trials():
        if t.name in items or (args.names and t.name not in args.names):
            continue
        if time.time() - start > 60 * args.minutes:
            print("stopped: the time is over; the rest is rendered by the next run")
            break
        began = time.time()
        items[t.name] = render(t, args.out, args.seed)
        path.write_text("".join(json.dumps(items[name], separators=(",", ":")) + "\n" for name in sorted(items)))
        size = sum(f.stat().st_size for f in args.out.glob(f"{t.name}_*"))
        print(f"{t.name}: {time.time() - began:.0f} s, {size / 1000:.0f} kB", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
