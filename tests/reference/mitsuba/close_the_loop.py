#!/usr/bin/env python3
"""A room seen by a probe, and a matte ball lit in the probe's place: both path-traced by Mitsuba 3.

Shares no code with Lightwell, so that a mirrored axis or a wrong sign in Lightwell cannot hide here.

    close_the_loop.py           render, write the EXR files and scene.json here, then check them
    close_the_loop.py --check   read the files here and check them again (seconds)

World: right-handed, metres, +Y up, the viewer looks along -Z, +X to his right. The probe is at the origin.
Radiance: linear, Rec. 709 primaries, in units of its own (read them as cd/m2 if a scale is wanted).
"""
import argparse
import json
import os
import time
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

HERE = Path(__file__).resolve().parent
SEED = 20240

# ---------------------------------------------------------------------------------------------------------------------
# The scene
# ---------------------------------------------------------------------------------------------------------------------
ROOM_MIN, ROOM_MAX = np.array([-2.2, -1.3, -3.4]), np.array([2.8, 1.7, 2.6])

# name, centre, half-edge u, half-edge v (the front is u x v, towards the inside), reflectance
WALLS = [
    ("left_red",    (-2.2, 0.2, -0.4), (0, 1.5, 0),   (0, 0, 3.0),   (0.60, 0.06, 0.05)),
    ("right_green", (2.8, 0.2, -0.4),  (0, 0, 3.0),   (0, 1.5, 0),   (0.10, 0.45, 0.08)),
    ("front",       (0.3, 0.2, -3.4),  (2.5, 0, 0),   (0, 1.5, 0),   (0.50, 0.50, 0.50)),
    ("back",        (0.3, 0.2, 2.6),   (0, 1.5, 0),   (2.5, 0, 0),   (0.50, 0.50, 0.50)),
    ("ceiling",     (0.3, 1.7, -0.4),  (2.5, 0, 0),   (0, 0, 3.0),   (0.65, 0.65, 0.65)),
    ("floor",       (0.3, -1.3, -0.4), (0, 0, 3.0),   (2.5, 0, 0),   (0.22, 0.22, 0.22)),
]
# name, centre, half size, turn about +Y in degrees, reflectance
BOXES = [
    ("tall_box",  (-1.35, -0.60, -2.30), (0.35, 0.70, 0.30), 25.0,  (0.55, 0.50, 0.42)),
    ("low_box",   (1.20, -1.05, -1.10),  (0.40, 0.25, 0.30), -18.0, (0.45, 0.45, 0.48)),
    ("back_box",  (1.90, -0.85, 1.60),   (0.45, 0.45, 0.35), 12.0,  (0.20, 0.25, 0.55)),
    ("shelf",     (-1.95, 0.55, 0.90),   (0.25, 0.12, 0.70), 0.0,   (0.60, 0.60, 0.20)),
]
# name, centre, half-edge u, half-edge v (it shines along u x v), radiance. The radiances are exact in half float.
LAMPS = [
    ("lamp",   (0.95, 1.69, -1.45), (0.18, 0, 0), (0, 0, 0.17), (160.0, 116.0, 68.0)),
    ("window", (-0.5, 0.45, 2.59),  (0, 0.6, 0),  (0.9, 0, 0),  (1.5, 2.25, 3.5)),
]

# ---------------------------------------------------------------------------------------------------------------------
# The cameras. right = forward x up: what lies there is on the right of the picture. Row 0 is the top.
# The up vector of the faces +Y and -Y is that of a viewer who looks along -Z and tilts the head back or forward.
# ---------------------------------------------------------------------------------------------------------------------
FACES = {
    "px": ((1, 0, 0), (0, 1, 0)),
    "nx": ((-1, 0, 0), (0, 1, 0)),
    "py": ((0, 1, 0), (0, 0, 1)),
    "ny": ((0, -1, 0), (0, 0, -1)),
    "pz": ((0, 0, 1), (0, 1, 0)),
    "nz": ((0, 0, -1), (0, 1, 0)),
}
FACE_SIZE = 128
BALL_RADIUS, BALL_REFLECTANCE, BALL_SIZE, BALL_DISTANCE, BALL_FOV = 0.01, 0.5, 48, 0.15, 8.0
ABOVE = np.array([0.35, 0.80, -0.45])
BALL_CAMERAS = [  # direction from the ball to the camera, up
    ((0, 0, 1), (0, 1, 0)),
    ((1, 0, 0), (0, 1, 0)),
    ((0, 0, -1), (0, 1, 0)),
    (tuple(ABOVE / np.linalg.norm(ABOVE)), (0, 1, 0)),
]


def unit(a):
    a = np.asarray(a, float)
    return a / np.linalg.norm(a, axis=-1, keepdims=True)


def rgb(c):
    return {"type": "rgb", "value": list(c)}


def rectangle(centre, u, v):
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = u, v, unit(np.cross(u, v)), centre
    return {"type": "rectangle", "to_world": mi.ScalarTransform4f(m.tolist())}


def scene_dict(ball_radius=None):
    t = mi.ScalarTransform4f
    d = {"type": "scene", "integrator": {"type": "path", "max_depth": -1, "rr_depth": 5}}
    for name, c, u, v, reflectance in WALLS:
        inward = np.cross(u, v) @ ((ROOM_MIN + ROOM_MAX) / 2 - np.array(c))
        assert inward > 0, name
        d[name] = rectangle(c, u, v) | {"bsdf": {"type": "diffuse", "reflectance": rgb(reflectance)}}
    for name, c, half, turn, reflectance in BOXES:
        d[name] = {"type": "cube", "to_world": t().translate(list(c)).rotate([0, 1, 0], turn).scale(list(half)),
                   "bsdf": {"type": "diffuse", "reflectance": rgb(reflectance)}}
    for name, c, u, v, radiance in LAMPS:
        assert np.cross(u, v) @ -np.array(c) > 0, name  # shines towards the probe's side
        d[name] = rectangle(c, u, v) | {"bsdf": {"type": "diffuse", "reflectance": rgb((0, 0, 0))},
                                        "emitter": {"type": "area", "radiance": rgb(radiance)}}
    if ball_radius:
        d["ball"] = {"type": "sphere", "center": [0, 0, 0], "radius": ball_radius,
                     "bsdf": {"type": "diffuse", "reflectance": rgb([BALL_REFLECTANCE] * 3)}}
    return d


def sensor(origin, target, up, fov, size, near):
    return mi.load_dict({
        "type": "perspective", "fov": fov, "fov_axis": "x", "near_clip": near, "far_clip": 100.0,
        "to_world": mi.ScalarTransform4f().look_at(origin=list(map(float, origin)), target=list(map(float, target)),
                                                   up=list(map(float, up))),
        "film": {"type": "hdrfilm", "width": size, "height": size, "pixel_format": "rgb", "component_format": "float32",
                 "rfilter": {"type": "box"}},
        "sampler": {"type": "multijitter"}})


def render_halves(scene, cam, spp, key, threads):
    """Two independent halves, each the mean of passes with different seeds."""
    dr.set_thread_count(threads)
    halves = []
    for half in range(2):
        passes = max(1, spp // 2 // 1024)
        total = sum(np.array(mi.render(scene, sensor=cam, spp=min(1024, spp // 2),
                                       seed=SEED + 100000 * key + 1000 * half + i), float) for i in range(passes))
        halves.append(total / passes)
    return halves


# ---------------------------------------------------------------------------------------------------------------------
# Geometry of the check, in plain numpy, independent of Mitsuba
# ---------------------------------------------------------------------------------------------------------------------
def pixel_grid(n, sub=1):
    """Image-plane coordinates in -1..1: x to the right, y up, row 0 at the top; sub x sub points a pixel."""
    c = (np.arange(n * sub) + 0.5) / (n * sub) * 2 - 1
    x, y = np.meshgrid(c, -c)
    return x, y


def face_directions(name):
    f, u = (np.array(a, float) for a in FACES[name])
    x, y = pixel_grid(FACE_SIZE)
    return unit(f + x[..., None] * np.cross(f, u) + y[..., None] * u)


def face_solid_angles():
    """Exact: the solid angle from the axis to a corner (x, y) of the plane at 1 is atan2(xy, sqrt(x^2+y^2+1))."""
    e = np.linspace(-1, 1, FACE_SIZE + 1)
    x, y = np.meshgrid(e, e)
    a = np.arctan2(x * y, np.sqrt(x * x + y * y + 1))
    return a[1:, 1:] - a[1:, :-1] - a[:-1, 1:] + a[:-1, :-1]


def irradiance(faces, normals, chunk=64):
    d = np.concatenate([face_directions(k).reshape(-1, 3) for k in FACES])
    w = face_solid_angles().reshape(-1, 1)
    assert abs(6 * w.sum() - 4 * np.pi) < 1e-9
    lw = np.concatenate([faces[k].reshape(-1, 3) * w for k in FACES])
    return np.concatenate([np.maximum(normals[i:i + chunk] @ d.T, 0) @ lw for i in range(0, len(normals), chunk)])


def ball_camera(i):
    to_camera, up = BALL_CAMERAS[i]
    position = BALL_DISTANCE * np.array(to_camera, float)
    forward = unit(-position)
    right = unit(np.cross(forward, up))
    return position, forward, right, np.cross(right, forward)


def ball_normals(i, sub):
    """Normal and n.v where each sub-pixel's ray meets the ball; n.v is -1 where it does not."""
    position, forward, right, up = ball_camera(i)
    x, y = pixel_grid(BALL_SIZE, sub)
    s = np.tan(np.radians(BALL_FOV) / 2)
    d = unit(forward + s * x[..., None] * right + s * y[..., None] * up)
    b = d @ position
    disc = b * b - (position @ position - BALL_RADIUS ** 2)
    p = position + (-b - np.sqrt(np.maximum(disc, 0)))[..., None] * d
    n = unit(p)
    return n, np.where(disc > 0, -(n * d).sum(-1), -1.0)


def ball_samples(sub=2, limit=0.3):
    """For each camera: the pixels all of whose footprint has n.v >= limit, with their sub-pixel and centre normals."""
    out = []
    for i in range(len(BALL_CAMERAS)):
        fine = ball_normals(i, 8)[1].reshape(BALL_SIZE, 8, BALL_SIZE, 8)
        ok = fine.min(axis=(1, 3)) >= limit
        n = ball_normals(i, sub)[0]
        blocks = (BALL_SIZE, sub, BALL_SIZE, sub)
        n = n.reshape(*blocks, 3).transpose(0, 2, 1, 3, 4)[ok]
        out.append((ok, n.reshape(len(n), -1, 3), ball_normals(i, 1)[0][ok]))
    return out


def rel_rms(a, b):
    return float(np.sqrt(np.mean((a - b) ** 2)) / np.sqrt(np.mean(b ** 2)))


def fibonacci(n):
    i = np.arange(n) + 0.5
    y, phi = 1 - 2 * i / n, np.pi * (1 + 5 ** 0.5) * i
    r = np.sqrt(1 - y * y)
    return np.stack([r * np.cos(phi), y, r * np.sin(phi)], 1)


def cap_mean_square(rho):
    """Mean of theta^2 over a uniform cap of angular radius rho (exact)."""
    return (2 * rho * np.sin(rho) - (rho ** 2 - 2) * np.cos(rho) - 2) / (1 - np.cos(rho))


def emitter_seen(centre, u, v, radiance, n=400):
    """Direction, size and irradiance of an emitter at the origin, from the geometry alone (nothing occludes it)."""
    c = (np.arange(n) + 0.5) / n * 2 - 1
    a, b = (g.reshape(-1, 1) for g in np.meshgrid(c, c))
    centre, u, v = (np.array(q, float) for q in (centre, u, v))
    p = centre + a * u + b * v
    r2 = (p * p).sum(1)
    d = p / np.sqrt(r2)[:, None]
    w = -(d @ unit(np.cross(u, v))) / r2 * 4 * np.linalg.norm(np.cross(u, v)) / n ** 2
    vector = (w[:, None] * d).sum(0)
    axis = unit(vector)
    mean_square = float((w * np.arccos(np.clip(d @ axis, -1, 1)) ** 2).sum() / w.sum())
    lo, hi = 0.0, np.pi
    for _ in range(60):
        mid = (lo + hi) / 2
        lo, hi = (mid, hi) if cap_mean_square(mid) < mean_square else (lo, mid)
    return {"direction": axis.tolist(), "solid_angle_sr": float(w.sum()),
            "angular_radius_deg_same_solid_angle": float(np.degrees(np.arccos(1 - w.sum() / (2 * np.pi)))),
            "angular_radius_deg_same_second_moment": float(np.degrees(lo)),
            "vector_irradiance_rgb": (np.linalg.norm(vector) * np.array(radiance)).tolist()}


def angle_deg(a, b):
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b))))


# ---------------------------------------------------------------------------------------------------------------------
# Files
# ---------------------------------------------------------------------------------------------------------------------
def write_exr(path, image, dtype):
    dr.set_thread_count(2)  # with one thread Mitsuba's EXR writer and reader never return
    mi.Bitmap(np.ascontiguousarray(image.astype(dtype)), mi.Bitmap.PixelFormat.RGB).write(str(path))


def read_exr(path):
    dr.set_thread_count(2)
    return np.array(mi.Bitmap(str(path)).convert(component_format=mi.Struct.Type.Float32), dtype=float)


def seams(faces):
    """RMS difference along each of the twelve edges of the cube, relative; each pair is two rows or columns of
    pixels."""
    px, nx, py, ny, pz, nz = (faces[k] for k in ("px", "nx", "py", "ny", "pz", "nz"))
    pairs = {
        "nz_px": (nz[:, -1], px[:, 0]),
        "px_pz": (px[:, -1], pz[:, 0]),
        "pz_nx": (pz[:, -1], nx[:, 0]),
        "nx_nz": (nx[:, -1], nz[:, 0]),
        "nz_py": (nz[0], py[-1]),
        "px_py": (px[0, ::-1], py[:, -1]),
        "pz_py": (pz[0, ::-1], py[0]),
        "nx_py": (nx[0], py[:, 0]),
        "nz_ny": (nz[-1], ny[0]),
        "px_ny": (px[-1], ny[:, -1]),
        "pz_ny": (pz[-1, ::-1], ny[-1]),
        "nx_ny": (nx[-1, ::-1], ny[:, 0]),
    }
    return {k: rel_rms(a, b) for k, (a, b) in pairs.items()}


def check(folder):
    """Checks the files as committed. Returns the figures; raises AssertionError if a requirement does not hold."""
    faces = {k: read_exr(folder / f"face_{k}.exr") for k in FACES}
    balls = [read_exr(folder / f"ball_{i}.exr") for i in range(len(BALL_CAMERAS))]
    assert all(np.isfinite(a).all() and (a >= 0).all() for a in [*faces.values(), *balls])
    result, samples = {}, ball_samples()
    measured = [balls[i][ok] * np.pi / BALL_REFLECTANCE for i, (ok, _, _) in enumerate(samples)]
    every = np.concatenate(measured)
    area = [irradiance(faces, n.reshape(-1, 3)).reshape(n.shape).mean(1) for _, n, _ in samples]
    centre = np.concatenate([irradiance(faces, n) for _, _, n in samples])
    predicted = np.concatenate(area)
    result["pixels_compared"] = [int(ok.sum()) for ok, _, _ in samples]
    result["rms_relative"] = rel_rms(predicted, every)
    result["rms_relative_each_camera"] = [rel_rms(a, b) for a, b in zip(area, measured)]
    result["rms_relative_each_channel"] = [rel_rms(predicted[:, c], every[:, c]) for c in range(3)]
    result["rms_relative_normal_at_pixel_centre_only"] = rel_rms(centre, every)
    result["largest_relative_to_rms"] = float(np.abs(predicted - every).max() / np.sqrt(np.mean(every ** 2)))
    result["mean_ratio_faces_over_ball_rgb"] = (predicted.mean(0) / every.mean(0)).tolist()

    # The figures with one axis or order reversed (a ninth of the pixels suffices).
    normals, some, wrong = np.concatenate([n for _, _, n in samples])[::9], every[::9], {}
    for name, m in {
        "x_negated": np.diag([-1, 1, 1]),
        "y_negated": np.diag([1, -1, 1]),
        "z_negated": np.diag([1, 1, -1]),
        "x_and_z_negated": np.diag([-1, 1, -1]),
        "x_z_swapped": np.eye(3)[[2, 1, 0]],
        "x_y_swapped": np.eye(3)[[1, 0, 2]],
        "y_z_swapped": np.eye(3)[[0, 2, 1]],
        "all_negated": -np.eye(3),
    }.items():
        wrong[name] = rel_rms(irradiance(faces, normals @ m.T), some)
    for k in ("py", "pz"):
        wrong[f"face_{k}_left_right"] = rel_rms(irradiance(faces | {k: faces[k][:, ::-1]}, normals), some)
        wrong[f"face_{k}_upside_down"] = rel_rms(irradiance(faces | {k: faces[k][::-1]}, normals), some)
    wrong["red_and_blue_swapped"] = rel_rms(centre[::9, ::-1], some)
    result["rms_relative_if_wrong"] = wrong

    # The emitters in the faces lie where the scene's numbers put them (a camera that mirrors could not do this).
    d = np.concatenate([face_directions(k).reshape(-1, 3) for k in FACES])
    w = np.tile(face_solid_angles().reshape(-1), 6)
    radiance = np.concatenate([faces[k].reshape(-1, 3) for k in FACES])
    seen = emitter_seen(*LAMPS[0][1:])
    excess = np.where(radiance[:, 0] > 4, radiance[:, 0], 0) * w
    result["lamp_centroid_off_by_deg"] = angle_deg(excess @ d, seen["direction"])
    result["lamp_solid_angle_ratio"] = float(excess.sum() / LAMPS[0][4][0] / seen["solid_angle_sr"])
    seen = emitter_seen(*LAMPS[1][1:])
    excess = np.where((radiance[:, 2] > 1.75) & (radiance[:, 2] > radiance[:, 0]), 1, 0) * w
    result["window_centroid_off_by_deg"] = angle_deg(excess @ d, seen["direction"])
    # The red wall is in the -X face, the green one in the +X face.
    result["wall_colour_nx_px"] = [faces[k][60:68, 60:68].mean((0, 1)).tolist() for k in ("nx", "px")]
    # Edges that two faces share agree; the irradiance hardly feels a dim face turned round, these edges do.
    result["seam_rms_relative"] = seams(faces)
    result["worst_seam_if_one_face_is_wrong"] = {
        f"{k}_{name}": max(
            seams(faces | {k: faces[k][turn] if name != "transposed" else faces[k].transpose(1, 0, 2)}).values()
        )
        for k in FACES
        for name, turn in {
            "left_right": np.s_[:, ::-1],
            "upside_down": np.s_[::-1],
            "half_turned": np.s_[::-1, ::-1],
            "transposed": None,
        }.items()
    }

    assert result["rms_relative"] < 0.01, result
    assert result["lamp_centroid_off_by_deg"] < 0.1 and abs(result["lamp_solid_angle_ratio"] - 1) < 0.02, result
    assert result["window_centroid_off_by_deg"] < 0.5, result
    assert result["wall_colour_nx_px"][0][0] > 3 * result["wall_colour_nx_px"][0][1], result
    assert result["wall_colour_nx_px"][1][1] > 2 * result["wall_colour_nx_px"][1][0], result
    assert min(wrong.values()) > 5 * result["rms_relative"], result
    worst = max(result["seam_rms_relative"].values())
    assert worst < 0.1 and min(result["worst_seam_if_one_face_is_wrong"].values()) > 2 * worst, result
    return result


def mitsuba_agrees_on_pixels():
    """Mitsuba's own rays through the picture against the directions that the check and scene.json use."""
    worst = 0.0
    cams = [(sensor((0, 0, 0), f, u, 90, FACE_SIZE, 0.01), face_directions(k)) for k, (f, u) in FACES.items()]
    for cam, d in cams:
        for row, col in [(0, 0), (0, FACE_SIZE - 1), (FACE_SIZE - 1, 0), (17, 90)]:
            uv = [(col + 0.5) / FACE_SIZE, (row + 0.5) / FACE_SIZE]
            ray, _ = cam.sample_ray(0.0, 0.5, mi.ScalarPoint2f(uv), mi.ScalarPoint2f(0.5))
            worst = max(worst, angle_deg(np.array(ray.d), d[row, col]))
    for i in range(len(BALL_CAMERAS)):
        position, forward, right, up = ball_camera(i)
        cam = sensor(position, (0, 0, 0), BALL_CAMERAS[i][1], BALL_FOV, BALL_SIZE, 0.01)
        s = np.tan(np.radians(BALL_FOV) / 2)
        for u, v in [(0.1, 0.2), (0.9, 0.3), (0.4, 0.95)]:
            ray, _ = cam.sample_ray(0.0, 0.5, mi.ScalarPoint2f([u, v]), mi.ScalarPoint2f(0.5))
            worst = max(worst, angle_deg(np.array(ray.d), forward + s * (2 * u - 1) * right + s * (1 - 2 * v) * up))
    return worst


# ---------------------------------------------------------------------------------------------------------------------
def describe(args, noise, seconds):
    def floats(a):
        return [round(float(q), 9) + 0.0 for q in a]
    return {
        "what": "Six cube faces of a room from the probe's place, and a matte ball lit there. See README.md.",
        "world": "right-handed, metres, +Y up, the viewer at the origin looks along -Z, +X to his right",
        "radiance": "linear, Rec. 709 primaries, one relative unit throughout; irradiance = radiance of the ball * "
                    "pi / reflectance",
        "rows": "row 0 of every file is the top of the picture, column 0 its left",
        "made_with": {
            "mitsuba": mi.__version__,
            "variant": mi.variant(),
            "integrator": "path, unlimited depth, Russian roulette from 5",
            "filter": "box (a pixel is the mean over its area)",
            "sampler": "multijitter",
            "seed": SEED,
            "seconds": round(seconds),
        },
        "faces": {
            "size": FACE_SIZE,
            "fov_deg": 90.0,
            "samples_per_pixel": args.face_spp,
            "position": [0.0, 0.0, 0.0],
            "direction_of_pixel": "forward + (2(col+0.5)/size-1) right + (1-2(row+0.5)/size) up, then normalised",
            "list": {
                k: {"file": f"face_{k}.exr", "forward": floats(f), "right": floats(np.cross(f, u)), "up": floats(u)}
                for k, (f, u) in FACES.items()
            },
        },
        "ball": {
            "centre": [0.0, 0.0, 0.0],
            "radius_m": BALL_RADIUS,
            "reflectance": BALL_REFLECTANCE,
            "samples_per_pixel": args.ball_spp,
            "direction_of_pixel": "forward + tan(fov/2) ((2(col+0.5)/width-1) right + (1-2(row+0.5)/height) "
                                  "true_up), then normalised",
            "cameras": [
                {
                    "file": f"ball_{i}.exr",
                    "position": [float(q) + 0.0 for q in ball_camera(i)[0]],
                    "target": [0.0, 0.0, 0.0],
                    "up": floats(BALL_CAMERAS[i][1]),
                    "fov_deg": BALL_FOV,
                    "fov_axis": "x (the pictures are square: y too)",
                    "width": BALL_SIZE,
                    "height": BALL_SIZE,
                    "forward": floats(ball_camera(i)[1]),
                    "right": floats(ball_camera(i)[2]),
                    "true_up": floats(ball_camera(i)[3]),
                }
                for i in range(len(BALL_CAMERAS))
            ],
        },
        "emitters_from_the_origin": {
            name: emitter_seen(c, u, v, r) | {"radiance_rgb": r} for name, c, u, v, r in LAMPS
        },
        "scene": {
            "walls": [dict(zip(("name", "centre", "half_u", "half_v", "reflectance"), q)) for q in WALLS],
            "boxes": [dict(zip(("name", "centre", "half_size", "turn_about_y_deg", "reflectance"), q)) for q in BOXES],
            "emitters": [dict(zip(("name", "centre", "half_u", "half_v", "radiance"), q)) for q in LAMPS],
        },
        "noise": noise,
    }


def main():
    global BALL_RADIUS, BALL_DISTANCE
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("--check", action="store_true", help="render nothing, check the files in --out")
    ap.add_argument("--out", type=Path, default=HERE)
    ap.add_argument("--face-spp", type=int, default=512, help="samples a pixel of the faces, both halves together")
    ap.add_argument("--ball-spp", type=int, default=16384, help="samples a pixel of the ball, both halves together")
    ap.add_argument("--shrink", type=float, default=1.0,
                    help="ball and camera distance times this: the pictures stay, parallax goes (for --out elsewhere)")
    ap.add_argument("--threads", type=int, default=1)
    args = ap.parse_args()
    BALL_RADIUS, BALL_DISTANCE = BALL_RADIUS * args.shrink, BALL_DISTANCE * args.shrink

    if not args.check:
        args.out.mkdir(parents=True, exist_ok=True)
        start = time.time()
        room = mi.load_dict(scene_dict())
        face_halves = ({}, {})
        for key, (k, (f, u)) in enumerate(FACES.items()):
            a, b = render_halves(room, sensor((0, 0, 0), f, u, 90, FACE_SIZE, 0.01), args.face_spp, key, args.threads)
            face_halves[0][k], face_halves[1][k] = a, b
            write_exr(args.out / f"face_{k}.exr", (a + b) / 2, np.float16)
            print(f"face {k}: {time.time() - start:.0f} s", flush=True)
        room = mi.load_dict(scene_dict(BALL_RADIUS))
        ball_noise, samples = [], ball_samples()
        for i in range(len(BALL_CAMERAS)):
            cam = sensor(ball_camera(i)[0], (0, 0, 0), BALL_CAMERAS[i][1], BALL_FOV, BALL_SIZE, BALL_DISTANCE / 15)
            a, b = render_halves(room, cam, args.ball_spp, 10 + i, args.threads)
            ok = samples[i][0]
            ball_noise.append(rel_rms(a[ok], b[ok]) / 2)
            write_exr(args.out / f"ball_{i}.exr", (a + b) / 2, np.float32)
            print(f"ball {i}: {time.time() - start:.0f} s", flush=True)
        normals = fibonacci(2048)
        ea, eb = (irradiance(h, normals) for h in face_halves)
        flat = [np.concatenate([h[k].reshape(-1, 3) for k in FACES]) for h in face_halves]
        dark = (flat[0].max(1) < 1) & (flat[1].max(1) < 1)
        noise = {
            "how": "RMS of half the difference of two independent half renders (one standard deviation of their "
                   "mean), relative to the RMS",
            "irradiance_from_faces": rel_rms(ea, eb) / 2,
            "irradiance_from_faces_largest": float(np.abs(ea - eb).max() / 2 / np.sqrt(np.mean(ea**2))),
            "face_pixel_without_emitters": rel_rms(flat[0][dark], flat[1][dark]) / 2,
            "ball_pixel_each_camera": ball_noise,
        }
        (args.out / "scene.json").write_text(json.dumps(describe(args, noise, time.time() - start), indent=1) + "\n")

    scene = json.loads((args.out / "scene.json").read_text())
    figures = {"mitsuba_rays_off_by_deg": mitsuba_agrees_on_pixels()} | check(args.out)
    assert figures["mitsuba_rays_off_by_deg"] < 1e-3, figures
    scene["self_check"] = figures
    if not args.check:
        (args.out / "scene.json").write_text(json.dumps(scene, indent=1) + "\n")
    print(
        json.dumps(
            {"noise": scene["noise"], "self_check": figures, "lamp": scene["emitters_from_the_origin"]["lamp"]},
            indent=1,
        )
    )


if __name__ == "__main__":
    main()
