#!/usr/bin/env python3
"""Renders two rooms as panoramas with Mitsuba 3, seen from a desk. Shares no code with Lightwell.

    rooms.py [NAME...] [--spp N] [--out FOLDER]    living_room, office; writes NAME.exr
    rooms.py --check                               the orientation, by three lamps in known directions

World: right-handed, metres, +Y up, the floor at y = 0; the eye is 2 cm above the desk's middle. The picture is that of
tests/reference/panorama.hpp: the centre is -Z, to the right is +X, the top row is +Y.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import llvm_library  # noqa: E402, F401 (before drjit)
import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
dr.set_thread_count(1)

WIDTH, HEIGHT = 512, 256
EYE = np.array([0, 0.77, 0])
SAMPLES_A_PASS = 32
MANTISSA_BITS = 8  # of a half's ten: 0.1 % of rounding, below the noise, for smaller files


def matte(color):
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(color)}}


def box(center, size, color, turn_deg=0.0):
    t = mi.ScalarTransform4f().translate(list(center)).rotate([0, 1, 0], turn_deg).scale([s / 2 for s in size])
    return {"type": "cube", "to_world": t, "bsdf": matte(color)}


def light(shape, radiance):
    return shape | {"bsdf": matte([0, 0, 0]), "emitter": {"type": "area", "radiance": {"type": "rgb",
                                                                                      "value": list(radiance)}}}


def ball_lamp(center, radius, radiance):
    return light({"type": "sphere", "center": list(center), "radius": radius}, radiance)


def panel(center, half_u, half_v, radiance):
    """Shines along half_u x half_v."""
    n = np.cross(half_u, half_v)
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = half_u, half_v, n / np.linalg.norm(n), center
    return light({"type": "rectangle", "to_world": mi.ScalarTransform4f(m.tolist())}, radiance)


def shell(x, height, z, colors, ceiling=(0.8, 0.8, 0.78), floor=(0.35, 0.25, 0.17)):
    """Walls 10 cm thick around x[0]..x[1], z[0]..z[1]; colors of the walls at -X, +X, -Z, +Z."""
    w, d, cx, cz, t = x[1] - x[0], z[1] - z[0], sum(x) / 2, sum(z) / 2, 0.1
    return [box((x[0] - t / 2, height / 2, cz), (t, height, d), colors[0]),
            box((x[1] + t / 2, height / 2, cz), (t, height, d), colors[1]),
            box((cx, height / 2, z[0] - t / 2), (w, height, t), colors[2]),
            box((cx, height / 2, z[1] + t / 2), (w, height, t), colors[3]),
            box((cx, height + t / 2, cz), (w, t, d), ceiling), box((cx, -t / 2, cz), (w, t, d), floor)]


def desk(width, depth, color):
    legs = [box((sx * (width / 2 - 0.05), 0.36, sz * (depth / 2 - 0.05)), (0.05, 0.72, 0.05), color)
            for sx in (-1, 1) for sz in (-1, 1)]
    return [box((0, 0.735, 0), (width, 0.03, depth), color), *legs]


def living_room():
    white, wood, dark = (0.78, 0.78, 0.76), (0.42, 0.28, 0.16), (0.08, 0.07, 0.07)
    shapes = shell((-2.4, 2.5), 2.6, (-3.1, 2.2), ((0.6, 0.35, 0.28), (0.7, 0.68, 0.6), (0.35, 0.45, 0.5),
                                                   (0.7, 0.66, 0.55))) + desk(1.3, 0.7, wood)
    # The window, 1.4 m by 1.3 m in the wall at +X, its frame, its cross and the sill.
    shapes.append(panel((2.49, 1.55, -0.7), (0, 0, 0.7), (0, 0.65, 0), (26, 30, 36)))
    for y, z, h, d in ((0.88, -0.7, 0.08, 1.56), (2.22, -0.7, 0.08, 1.56), (1.55, -1.42, 1.4, 0.08),
                       (1.55, 0.02, 1.4, 0.08), (1.55, -0.7, 1.3, 0.06), (1.8, -0.7, 0.05, 1.4)):
        shapes.append(box((2.46, y, z), (0.08, h, d), white))
    shapes.append(box((2.38, 0.83, -0.7), (0.24, 0.03, 1.6), white))
    for z in (-1.65, 0.25):
        shapes.append(box((2.38, 1.4, z), (0.06, 2.0, 0.32), (0.5, 0.2, 0.15)))  # curtains
    # A floor lamp behind on the left, and a lamp below the ceiling behind on the right.
    shapes += [ball_lamp((-1.1, 1.65, -1.3), 0.08, (300, 215, 120)), box((-1.1, 0.78, -1.3), (0.03, 1.56, 0.03), dark),
               ball_lamp((0.75, 2.2, 0.95), 0.05, (520, 430, 300)), box((0.75, 2.43, 0.95), (0.01, 0.34, 0.01), dark)]
    shapes += [box((-1.9, 0.22, 0.7), (0.85, 0.44, 2.0), (0.12, 0.2, 0.35)),  # sofa, its back
               box((-2.25, 0.62, 0.7), (0.25, 0.5, 2.0), (0.12, 0.2, 0.35)),
               box((0.9, 0.95, -2.85), (1.3, 1.9, 0.45), (0.5, 0.34, 0.2)),  # cupboard
               box((-0.9, 1.6, -3.08), (0.9, 0.65, 0.03), dark), box((-0.9, 1.6, -3.06), (0.78, 0.53, 0.03),
                                                                     (0.65, 0.5, 0.15)),
               box((-2.38, 1.7, -0.9), (0.03, 0.5, 0.7), (0.15, 0.4, 0.25)),  # a picture
               box((-0.4, 1.75, 2.0), (1.6, 0.03, 0.28), wood), box((0.5, 0.42, 0.75), (0.45, 0.84, 0.4), dark, 20)]
    for k, color in enumerate(((0.5, 0.1, 0.1), (0.1, 0.3, 0.5), (0.6, 0.55, 0.3), (0.2, 0.4, 0.2), (0.6, 0.6, 0.6))):
        shapes.append(box((-1.05 + 0.09 * k, 1.88, 2.0), (0.06, 0.22 + 0.02 * (k % 3), 0.17), color))
    return shapes


def office():
    white, grey, dark = (0.75, 0.75, 0.75), (0.4, 0.42, 0.44), (0.05, 0.05, 0.06)
    shapes = shell((-2.8, 3.2), 2.8, (-3.3, 2.9), ((0.65, 0.66, 0.62), (0.3, 0.42, 0.55), (0.68, 0.68, 0.66),
                                                   (0.66, 0.62, 0.55)), floor=(0.2, 0.21, 0.23))
    shapes += desk(1.6, 0.8, (0.6, 0.58, 0.55))
    # Four panels of 60 cm; the one at +X, -Z is off.
    for x, z, on in ((-1.2, -1.5, True), (1.4, -1.5, False), (-1.2, 1.1, True), (1.4, 1.1, True)):
        shapes.append(box((x, 2.785, z), (0.68, 0.03, 0.68), white))
        if on:
            shapes.append(panel((x, 2.765, z), (0.3, 0, 0), (0, 0, 0.3), (34, 36, 38)))
        else:
            shapes.append(box((x, 2.767, z), (0.6, 0.006, 0.6), (0.85, 0.85, 0.85)))
    # A desk lamp: a disc of 5 cm that shines down, below a shade, on an arm.
    down = mi.ScalarTransform4f().translate([-0.5, 1.22, -0.22]).rotate([1, 0, 0], 90).scale(0.05)
    shapes += [light({"type": "disk", "to_world": down}, (420, 330, 210)),
               box((-0.5, 1.245, -0.22), (0.15, 0.03, 0.15), (0.5, 0.08, 0.06)),
               box((-0.62, 1.0, -0.3), (0.02, 0.5, 0.02), dark), box((-0.62, 0.76, -0.3), (0.16, 0.02, 0.16), dark)]
    shapes += [box((0.15, 1.05, -0.33), (0.55, 0.33, 0.03), dark, -8),
               box((0.15, 0.82, -0.34), (0.06, 0.16, 0.03), dark),
               box((2.2, 1.02, 2.87), (0.9, 2.04, 0.05), (0.35, 0.2, 0.1)),  # the door, its frame
               box((1.72, 1.04, 2.87), (0.07, 2.1, 0.07), white), box((2.68, 1.04, 2.87), (0.07, 2.1, 0.07), white),
               box((0.4, 1.5, -3.28), (1.8, 1.1, 0.03), (0.85, 0.85, 0.85)),  # a white board
               box((2.9, 0.6, -0.4), (0.5, 1.2, 1.6), grey), box((0.9, 0.5, 0.85), (0.5, 1.0, 0.5), dark, 35)]
    colors = ((0.6, 0.15, 0.1), (0.15, 0.35, 0.6), (0.7, 0.6, 0.2), (0.2, 0.45, 0.25), (0.5, 0.5, 0.5),
              (0.1, 0.1, 0.12))
    for level in range(4):
        y = 0.7 + 0.42 * level
        shapes.append(box((-2.62, y, -0.3), (0.34, 0.03, 2.2), white))
        for k in range(12):
            shapes.append(box((-2.62, y + 0.14, -1.25 + 0.17 * k), (0.24, 0.26 - 0.03 * ((3 * k + level) % 4), 0.11),
                              colors[(k + 2 * level) % 6]))
    return shapes


ROOMS = {"living_room": living_room, "office": office}


def render(shapes, spp, seed):
    """(HEIGHT, WIDTH, 3) mean radiance of each pixel, from two halves; and their difference."""
    scene = mi.load_dict({"type": "scene", **{f"shape_{i}": s for i, s in enumerate(shapes)}})
    integrator = mi.load_dict({"type": "path", "max_depth": 16, "rr_depth": 6})
    n, halves = WIDTH * HEIGHT * SAMPLES_A_PASS, np.zeros((2, HEIGHT, WIDTH, 3))
    passes = max(2, spp // SAMPLES_A_PASS)
    for k in range(passes):
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed + k, n)
        pixel = dr.arange(mi.UInt32, n) // SAMPLES_A_PASS
        row, jitter = pixel // WIDTH, sampler.next_2d()
        phi = 2 * dr.pi * ((mi.Float(pixel - row * WIDTH) + jitter.x) / WIDTH - 0.5)
        theta = dr.pi * (0.5 - (mi.Float(row) + jitter.y) / HEIGHT)
        d = mi.Vector3f(dr.cos(theta) * dr.sin(phi), dr.sin(theta), -dr.cos(theta) * dr.cos(phi))
        color, _, _ = integrator.sample(scene, sampler, mi.RayDifferential3f(mi.Ray3f(mi.Point3f(*EYE.tolist()), d)))
        dr.eval(color)
        halves[k % 2] += np.stack([np.array(dr.block_sum(c, SAMPLES_A_PASS)) for c in color],
                                  -1).reshape(HEIGHT, WIDTH, 3)
    halves /= np.array([(passes + 1) // 2, passes // 2])[:, None, None, None] * SAMPLES_A_PASS
    return halves.mean(0), (halves[0] - halves[1]) / 2


def rounded(picture):
    """Halves with the mantissa rounded to MANTISSA_BITS."""
    drop = 10 - MANTISSA_BITS
    bits = picture.astype(np.float16).view(np.uint16).astype(np.uint32)
    return ((bits + (1 << (drop - 1))) >> drop << drop).astype(np.uint16).view(np.float16)


def check():
    """Lamps 3 m away on black: the centroid of each in the picture, from the formulas of panorama.hpp."""
    worst = 0.0
    for number, d in enumerate(([0.8, 0.1, -0.5], [-0.3, 0.8, 0.4], [-0.2, -0.3, -0.9])):
        d = np.array(d) / np.linalg.norm(d)
        picture, _ = render([ball_lamp(EYE + 3 * d, 0.2, (1, 1, 1))], 2 * SAMPLES_A_PASS, number)
        y, x = (np.sum(a * picture[..., 0]) / picture[..., 0].sum() for a in np.mgrid[:HEIGHT, :WIDTH])
        column = WIDTH * (np.arctan2(d[0], -d[2]) / (2 * np.pi) + 0.5) - 0.5
        row = HEIGHT * (0.5 - np.arcsin(d[1]) / np.pi) - 0.5
        print(f"towards {np.round(d, 3)}: found at ({x:.2f}, {y:.2f}), expected ({column:.2f}, {row:.2f})")
        worst = max(worst, abs(x - column), abs(y - row))
    return worst < 0.5


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=list(ROOMS))
    parser.add_argument("--spp", type=int, default=512)
    parser.add_argument("--out", type=Path, default=Path(__file__).resolve().parent)
    parser.add_argument("--check", action="store_true")
    args = parser.parse_args()
    if args.check:
        sys.exit(0 if check() else 1)
    for number, name in enumerate(args.names):
        start = time.time()
        picture, difference = render(ROOMS[name](), args.spp, 1000 * (number + 1))
        dr.set_thread_count(2)  # the writer of OpenEXR waits without end for a second thread
        mi.Bitmap(rounded(picture)).write(str(args.out / f"{name}.exr"))
        dr.set_thread_count(1)
        up = picture[:HEIGHT // 2]
        print(f"{name}: {time.time() - start:.0f} s, noise of a pixel (median) "
              f"{100 * np.median(np.abs(difference) / np.maximum(picture, 1e-6)):.2f} %, upper half: mean "
              f"{up.mean():.3f}, median {np.median(up):.3f}, largest {up.max():.1f}, "
              f"{(args.out / f'{name}.exr').stat().st_size} bytes")


if __name__ == "__main__":
    main()
