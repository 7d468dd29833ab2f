#!/usr/bin/env python3
"""Renders the rooms of scenes.py with Mitsuba 3: what each probe sees, and the light at 200 points. Shares no code with
Lightwell.

    render.py [NAME...] [--out FOLDER]    writes NAME_0.exr ... NAME_3.exr and NAME.json
    render.py --check                     a ball and a panel on black against closed forms

A panorama is that of tests/reference/panorama.hpp in the probe's axes: the centre is -Z, to the right is +X, the top
row is +Y. Irradiance is not divided by pi.
"""

import argparse
import json
import math
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import llvm_library  # noqa: E402, F401 (before drjit)
import drjit as dr
import mitsuba as mi
import numpy as np

import scenes  # noqa: E402

mi.set_variant("llvm_ad_rgb")
dr.set_thread_count(1)

WIDTH, HEIGHT = 256, 128
GRID, SAMPLES_A_PASS = 16, 32  # a pixel's samples: GRID x GRID strata, SAMPLES_A_PASS of them in a pass
INDIRECT, DIRECT = 16384, 1024  # samples of a point
MANTISSA_BITS = 8  # of a half's ten: 0.1 % of rounding, below the noise


def matte(color):
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(color)}}


def box(center, size, color):
    t = mi.ScalarTransform4f().translate(list(center)).scale([s / 2 for s in size])
    return {"type": "cube", "to_world": t, "bsdf": matte(color)}


def light(shape, radiance):
    return shape | {"bsdf": matte((0, 0, 0)),
                    "emitter": {"type": "area", "radiance": {"type": "rgb", "value": list(radiance)}}}


def rectangle(center, half_u, half_v):
    """Shines along half_u x half_v."""
    n = np.cross(half_u, half_v)
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = half_u, half_v, n / np.linalg.norm(n), center
    return {"type": "rectangle", "to_world": mi.ScalarTransform4f(m.tolist())}


def sides_of(lamp):
    """The half sides of a panel or a window."""
    if lamp["kind"] == "panel":
        return np.array((lamp["radius"], 0, 0)), np.array((0, 0, lamp["radius"]))
    z, y = lamp["half"]
    u, v = np.array((0, 0, z)), np.array((0, y, 0))
    return (u, v) if np.cross(u, v)[0] * lamp["normal"][0] > 0 else (v, u)


def emitter(lamp):
    if lamp["kind"] == "ball":
        return light({"type": "sphere", "center": list(lamp["center"]), "radius": lamp["radius"]}, lamp["radiance"])
    return light(rectangle(lamp["center"], *sides_of(lamp)), lamp["radiance"])


def emitters_of(room):
    return [*room.lamps, room.window]


def scene_of(room):
    w, h, d, t = room.width, room.height, room.depth, 0.1
    shapes = [box((-w / 2 - t / 2, h / 2, 0), (t, h, d), room.walls[0]),
              box((w / 2 + t / 2, h / 2, 0), (t, h, d), room.walls[1]),
              box((0, h / 2, -d / 2 - t / 2), (w, h, t), room.walls[2]),
              box((0, h / 2, d / 2 + t / 2), (w, h, t), room.walls[3]),
              box((0, h + t / 2, 0), (w, t, d), (0.8, 0.8, 0.78)), box((0, -t / 2, 0), (w, t, d), (0.4, 0.3, 0.22))]
    shapes += [box(*b, (0.55, 0.5, 0.45)) for b in room.occluders]
    shapes += [box(*b, c) for b, c in zip(room.furniture, ((0.5, 0.15, 0.1), (0.1, 0.25, 0.45), (0.3, 0.45, 0.2)))]
    return load(shapes, emitters_of(room))


def load(shapes, lamps):
    return mi.load_dict({"type": "scene", **{f"shape_{i}": s for i, s in enumerate(shapes)},
                         **{f"lamp_{i}": emitter(lamp) for i, lamp in enumerate(lamps)}})


def rotation(axis, angle):
    """Matrix of a rotation about a unit axis (Rodrigues)."""
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def panorama(scene, origin, turn, seed):
    """(HEIGHT, WIDTH, 3) mean radiance of each pixel."""
    integrator = mi.load_dict({"type": "path", "max_depth": 16, "rr_depth": 6})
    n, passes = WIDTH * HEIGHT * SAMPLES_A_PASS, GRID * GRID // SAMPLES_A_PASS
    total = np.zeros((HEIGHT, WIDTH, 3))
    for k in range(passes):
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed + k, n)
        index, jitter = dr.arange(mi.UInt32, n), sampler.next_2d()
        pixel, cell = index // SAMPLES_A_PASS, index % SAMPLES_A_PASS + k * SAMPLES_A_PASS
        row, cell_row = pixel // WIDTH, cell // GRID
        x = mi.Float(pixel - row * WIDTH) + (mi.Float(cell - cell_row * GRID) + jitter.x) / GRID
        y = mi.Float(row) + (mi.Float(cell_row) + jitter.y) / GRID
        phi, theta = 2 * dr.pi * (x / WIDTH - 0.5), dr.pi * (0.5 - y / HEIGHT)
        d = turned(turn, mi.Vector3f(dr.cos(theta) * dr.sin(phi), dr.sin(theta), -dr.cos(theta) * dr.cos(phi)))
        color, _, _ = integrator.sample(scene, sampler, mi.RayDifferential3f(mi.Ray3f(mi.Point3f(*origin), d)))
        dr.eval(color)
        total += np.stack([np.array(dr.block_sum(c, SAMPLES_A_PASS)) for c in color], -1).reshape(HEIGHT, WIDTH, 3)
    return total / (GRID * GRID)


def turned(matrix, d):
    return mi.Vector3f(*(float(matrix[i, 0]) * d.x + float(matrix[i, 1]) * d.y + float(matrix[i, 2]) * d.z
                         for i in range(3)))


def rounded(picture):
    """Halves with the mantissa rounded to MANTISSA_BITS."""
    drop = 10 - MANTISSA_BITS
    bits = picture.astype(np.float16).view(np.uint16).astype(np.uint32)
    return ((bits + (1 << (drop - 1))) >> drop << drop).astype(np.uint16).view(np.float16)


def indirect(scene, origin, normals, seed):
    """Irradiance (normals, 3) of all that no emitter sends straight: directions of a jittered lattice."""
    rows = int(math.sqrt(INDIRECT / 2))
    n = 2 * rows * rows
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, n)
    index, jitter = dr.arange(mi.UInt32, n), sampler.next_2d()
    row = index // (2 * rows)
    y = 1 - 2 * (mi.Float(row) + jitter.y) / rows
    phi = dr.pi * (mi.Float(index - row * 2 * rows) + jitter.x) / rows
    s = dr.sqrt(dr.maximum(0, 1 - y * y))
    d = mi.Vector3f(s * dr.cos(phi), y, s * dr.sin(phi))
    ray = mi.RayDifferential3f(mi.Ray3f(mi.Point3f(*origin), d))
    hit = scene.ray_intersect(ray)
    seen = dr.neq(hit.emitter(scene), None) if hasattr(dr, "neq") else hit.emitter(scene) != None  # noqa: E711
    integrator = mi.load_dict({"type": "path", "max_depth": 16, "rr_depth": 6})
    color, _, _ = integrator.sample(scene, sampler, ray)
    radiance = np.where(np.array(seen)[:, None], 0, np.stack([np.array(c) for c in color], -1))
    cosine = np.maximum(np.stack([np.array(c) for c in d], -1) @ np.array(normals).T, 0)
    return 4 * math.pi / n * cosine.T @ radiance


def direct(scene, lamp, origin, normals, generator):
    """Of one emitter: irradiance (normals, 3) with occlusion, its vector irradiance (luminance) without and with
    occlusion, and the direction of the former."""
    o, c = np.array(origin), np.array(lamp["center"])
    a, b = generator.random((2, DIRECT))
    a = (np.arange(DIRECT) + a) / DIRECT
    b = (b + np.arange(DIRECT) * 0.6180339887498949) % 1
    if lamp["kind"] == "ball":  # uniform over the cone in which it is seen
        gap = np.linalg.norm(c - o)
        axis = (c - o) / gap
        smallest = math.sqrt(1 - (lamp["radius"] / gap)**2)
        cosine, phi = 1 - a * (1 - smallest), 2 * math.pi * b
        sine = np.sqrt(1 - cosine**2)
        u = np.cross(axis, (1, 0, 0) if abs(axis[0]) < 0.7 else (0, 1, 0))
        u /= np.linalg.norm(u)
        d = cosine[:, None] * axis + sine[:, None] * (np.cos(phi)[:, None] * u +
                                                      np.sin(phi)[:, None] * np.cross(axis, u))
        weight = np.full(DIRECT, 2 * math.pi * (1 - smallest) / DIRECT)
        reach = gap + lamp["radius"]
    else:  # uniform over its area
        u, v = sides_of(lamp)
        to = c + np.outer(2 * a - 1, u) + np.outer(2 * b - 1, v) - o
        squared = (to**2).sum(1)
        d = to / np.sqrt(squared)[:, None]
        n = np.cross(u, v)
        area = 4 * np.linalg.norm(n)
        weight = np.maximum(-d @ (n / np.linalg.norm(n)), 0) / squared * area / DIRECT
        reach = math.sqrt(squared.max()) + 0.1
    ray = mi.Ray3f(mi.Point3f(*origin), mi.Vector3f(*(mi.Float(d[:, i].astype(np.float32)) for i in range(3))))
    hit = scene.ray_intersect(ray)
    t = np.array(hit.t)
    points = o + np.where(np.isfinite(t), t, 0)[:, None] * d
    on = np.array(hit.is_valid()) & (t < reach)
    if lamp["kind"] == "ball":
        on &= np.abs(np.linalg.norm(points - c, axis=1) - lamp["radius"]) < 2e-3
    else:
        on &= np.abs((points - c) @ (n / np.linalg.norm(n))) < 2e-3
    radiance, luminance = np.array(lamp["radiance"]), np.array((0.2126, 0.7152, 0.0722)) @ np.array(lamp["radiance"])
    cosine = np.maximum(d @ np.array(normals).T, 0)
    free, seen = (weight[:, None] * d).sum(0), ((weight * on)[:, None] * d).sum(0)
    size = np.linalg.norm(free)
    return (np.outer((weight * on) @ cosine, radiance), luminance * size, luminance * np.linalg.norm(seen),
            free / max(size, 1e-30))


def figures(values, digits=5):
    return [float(f"{v:.{digits}g}") for v in np.ravel(values)]


def truth(room, scene, seed):
    directions, points = scenes.normals(), []
    generator = np.random.default_rng(seed)
    for number, point in enumerate(room.points):
        total, lamps = indirect(scene, point, directions, seed + number), []
        for lamp in emitters_of(room):
            irradiance, free, seen, towards = direct(scene, lamp, point, directions, generator)
            total = total + irradiance
            lamps.append({"free": figures(free)[0], "seen": figures(seen)[0], "towards": figures(towards)})
        points.append({"position": figures(point, 7), "irradiance": figures(total), "lamps": lamps})
    return points


def check():
    """A ball and a panel on black, as seen from the origin."""
    worst = 0.0
    ball = {"kind": "ball", "center": (1.0, 2.0, -0.5), "radius": 0.1, "radiance": (3, 3, 3)}
    panel = {"kind": "panel", "center": (0.0, 2.0, 0.0), "radius": 0.2, "radiance": (3, 3, 3)}
    scene = load([box((0, -9, 0), (1, 1, 1), (0, 0, 0))], [ball, panel])
    generator = np.random.default_rng(1)
    for lamp in (ball, panel):
        gap = math.hypot(*lamp["center"])
        expected = math.pi * 3 * (lamp["radius"] / gap)**2
        if lamp["kind"] == "panel":  # below its middle, in closed form: the form factor of four quarters
            x = lamp["radius"] / gap
            expected = 4 * 3 * x / math.sqrt(1 + x * x) * math.atan(x / math.sqrt(1 + x * x))
        irradiance, free, seen, towards = direct(scene, lamp, (0, 0, 0), [np.array(lamp["center"]) / gap], generator)
        print(f"{lamp['kind']}: irradiance {irradiance[0, 0]:.6f}, expected {expected:.6f}; vector {free:.6f}")
        worst = max(worst, abs(irradiance[0, 0] / expected - 1))
    picture = panorama(load([], [ball]), (0, 0, 0), rotation((0, 1, 0), 0.7), 5)
    y, x = (np.sum(a * picture[..., 0]) / picture[..., 0].sum() for a in np.mgrid[:HEIGHT, :WIDTH])
    d = rotation((0, 1, 0), -0.7) @ np.array(ball["center"]) / math.hypot(*ball["center"])
    column = WIDTH * (math.atan2(d[0], -d[2]) / (2 * math.pi) + 0.5) - 0.5
    row = HEIGHT * (0.5 - math.asin(d[1]) / math.pi) - 0.5
    print(f"ball in the panorama: ({x:.2f}, {y:.2f}), expected ({column:.2f}, {row:.2f})")
    return worst < 0.002 and abs(x - column) < 0.2 and abs(y - row) < 0.2


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=list(scenes.SHAPES))
    parser.add_argument("--out", type=Path, default=Path(__file__).resolve().parent)
    parser.add_argument("--check", action="store_true")
    args = parser.parse_args()
    if args.check:
        sys.exit(0 if check() else 1)
    for number, name in enumerate(args.names):
        start, room = time.time(), scenes.Room(name)
        scene, probes = scene_of(room), []
        for k, probe in enumerate(room.probes):
            turn = rotation(probe["axis"], probe["angle"])
            picture = panorama(scene, probe["position"], turn, 100_000 * (number + 1) + 1000 * k)
            dr.set_thread_count(2)  # the writer of OpenEXR waits without end for a second thread
            mi.Bitmap(rounded(picture)).write(str(args.out / f"{name}_{k}.exr"))
            dr.set_thread_count(1)
            half = probe["angle"] / 2
            probes.append({"position": figures(probe["position"], 9),
                           "rotation": figures([a * math.sin(half) for a in probe["axis"]] + [math.cos(half)], 9)})
        out = {"name": name, "size": [room.width, room.height, room.depth],
               "occluders": [{"center": b[0], "size": b[1]} for b in room.occluders],
               "lamps": [{"kind": lamp["kind"], "center": figures(lamp["center"], 7)} for lamp in emitters_of(room)],
               "normals": [figures(n, 9) for n in scenes.normals()], "probes": probes,
               "points": truth(room, scene, 7_000_000 * (number + 1))}
        text = json.dumps(out, separators=(",", ":")).replace('{"position"', '\n{"position"')
        (args.out / f"{name}.json").write_text(text + "\n")
        print(f"{name}: {time.time() - start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
