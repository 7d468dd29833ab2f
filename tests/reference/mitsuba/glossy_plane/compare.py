#!/usr/bin/env python3
"""Renders the frames of glossy_frames with Mitsuba 3 and compares them. Shares no code with Lightwell.

    compare.py FOLDER [--spp N]    FOLDER: what glossy_frames wrote
    compare.py FOLDER --check      only the conventions: the environment's and the texture's orientation

Exit: 0 every alpha within 1 %, 1 something disagrees.
"""

import argparse
import json
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

MAP_WIDTH, MAP_HEIGHT = 2048, 1025
WORLD_FROM_PLANE = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)  # +Y of the plane is -Z, +Z is +Y


class HeightCorrelated(mi.BSDF):
    """roughconductor with the height-correlated G2 of Heitz (2014, eq. 99). Mitsuba's own is the product of two G1."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.alpha = props["height_alpha"]
        self.inner = mi.load_dict(conductor(self.alpha))
        self.m_components, self.m_flags = [self.inner.flags(0)], self.inner.flags()

    def factor(self, wi, wo):
        a, b = ((dr.sqrt(1 + self.alpha**2 * mi.Frame3f.tan_theta_2(w)) - 1) / 2 for w in (wi, wo))
        return dr.select((mi.Frame3f.cos_theta(wi) > 0) & (mi.Frame3f.cos_theta(wo) > 0),
                         (1 + a) * (1 + b) / (1 + a + b), 0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        bs, weight = self.inner.sample(ctx, si, sample1, sample2, active)
        return bs, weight * self.factor(si.wi, bs.wo)

    def eval(self, ctx, si, wo, active=True):
        return self.inner.eval(ctx, si, wo, active) * self.factor(si.wi, wo)

    def pdf(self, ctx, si, wo, active=True):
        return self.inner.pdf(ctx, si, wo, active)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return f"HeightCorrelated[{self.alpha}]"


mi.register_bsdf("height_correlated", lambda props: HeightCorrelated(props))


def conductor(alpha):
    return {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": alpha,
            "sample_visible": True}


def bitmap(array):
    return mi.Bitmap(np.ascontiguousarray(array, np.float32), mi.Bitmap.PixelFormat.RGB)


def radiance(scene, d):
    """Of the environment, from world directions (..., 3)."""
    value = np.array(scene["ground"]) + d[..., 1:2] * np.array(scene["growth"])
    for light in scene["lights"]:
        value = value + np.exp((d @ np.array(light["towards"]) - 1) / light["width"][0]**2)[..., None] * light["peak"]
    return value


def environment(scene):
    """Mitsuba's rows are at the polar angles pi j / (H - 1), its columns at the azimuths 2 pi (i + 0.5) / W, from -Z
    to +X."""
    azimuth = 2 * np.pi * (np.arange(MAP_WIDTH) + 0.5) / MAP_WIDTH
    polar = np.pi * np.arange(MAP_HEIGHT) / (MAP_HEIGHT - 1)
    s = np.sin(polar)[:, None]
    d = np.stack(np.broadcast_arrays(s * np.sin(azimuth), np.cos(polar)[:, None], -s * np.cos(azimuth)), -1)
    return {"type": "envmap", "bitmap": bitmap(radiance(scene, d))}


def albedo(scene, folder):
    """Mitsuba's bitmaps have row 0 at v = 0, which is the plane's -Y edge."""
    n = scene["texels"]
    texels = np.fromfile(folder / "albedo.f32", np.float32).reshape(n, n, 3)[::-1]
    return {"type": "bitmap", "bitmap": bitmap(texels), "raw": True, "filter_type": "bilinear", "wrap_mode": "clamp"}


def plane(scene, bsdf):
    m = np.eye(4)
    m[:3, :3] = WORLD_FROM_PLANE @ np.diag([scene["size_m"][0] / 2, scene["size_m"][0] / 2, 1])
    return {"type": "rectangle", "to_world": mi.ScalarTransform4f(m.tolist()), "bsdf": bsdf}


def sensor(scene, frame):
    """Mitsuba's camera looks along +Z, +Y up, +X to the left."""
    width, height, focal = scene["camera"]
    rotation = np.array(frame["rotation"])
    m = np.eye(4)
    m[:3, :3] = WORLD_FROM_PLANE @ rotation.T @ np.diag([-1, -1, 1])
    m[:3, 3] = WORLD_FROM_PLANE @ -(rotation.T @ np.array(frame["translation"]))
    return mi.load_dict({
        "type": "perspective", "fov": float(np.degrees(2 * np.arctan(width / 2 / focal))), "fov_axis": "x",
        "near_clip": 1e-3, "far_clip": 100.0, "to_world": mi.ScalarTransform4f(m.tolist()),
        "film": {"type": "hdrfilm", "width": int(width), "height": int(height), "pixel_format": "rgb",
                 "component_format": "float32", "rfilter": {"type": "box"}},
        "sampler": {"type": "multijitter"}})


def check_conventions(scene, folder):
    """The environment and the texture as Mitsuba evaluates them."""
    lights = mi.load_dict({"type": "scene", "env": environment(scene)})
    rng = np.random.default_rng(1)
    d = rng.normal(size=(20000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    si = dr.zeros(mi.SurfaceInteraction3f, len(d))
    si.wi = mi.Vector3f(np.ascontiguousarray(-d.T, np.float32))
    found, truth = np.array(lights.environment().eval(si)).T, radiance(scene, d)
    error = np.sqrt(np.mean((found - truth)**2) / np.mean(truth**2))
    n = scene["texels"]
    texels = np.fromfile(folder / "albedo.f32", np.float32).reshape(n, n, 3)
    si = dr.zeros(mi.SurfaceInteraction3f, 1)
    si.uv = mi.Point2f(0.25 + 0.5 / n, 1 - (0.125 + 0.5 / n))
    at = np.array(mi.load_dict(albedo(scene, folder)).eval(si)).ravel()
    texel = np.abs(at - texels[n // 8, n // 4]).max()
    print(f"environment: relative RMS difference {error:.1e}; a texel: {texel:.1e}")
    return error < 2e-3 and texel < 1e-4


def render(parts, camera, spp, seed):
    """The sum over parts of two independent halves."""
    return [sum(np.array(mi.render(part, sensor=camera, spp=spp // 2, seed=seed + half), float) for part in parts)
            for half in range(2)]


def relative(a, b):
    return float(np.sqrt(np.mean(a**2) / np.mean(b**2)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--spp", type=int, default=1024)
    parser.add_argument("--check", action="store_true")
    args = parser.parse_args()
    scene = json.loads((args.folder / "scene.json").read_text())
    if not check_conventions(scene, args.folder):
        sys.exit(1)
    if args.check:
        return
    start, env, worst = time.time(), environment(scene), 0.0
    width, height = (int(v) for v in scene["camera"][:2])
    base = {"type": "scene", "env": env, "integrator": {"type": "path", "max_depth": 2, "hide_emitters": True}}
    matte = mi.load_dict(base | {"plane": plane(scene, {"type": "diffuse", "reflectance": albedo(scene, args.folder)})})
    rows = {}
    print("frame        elevation  all    gloss  product of G1  noise  (relative RMS difference in %)")
    for number, frame in enumerate(scene["frames"]):
        alpha, name = frame["alpha"][0], frame["name"]
        glossy = [mi.load_dict(base | {"plane": plane(scene, bsdf)})
                  for bsdf in ({"type": "height_correlated", "height_alpha": alpha}, conductor(alpha))]
        camera, seed = sensor(scene, frame), 100 * number
        diffuse = render([matte], camera, args.spp, seed)
        gloss, product = (render([part], camera, args.spp, seed + 10 * k) for k, part in enumerate(glossy, 1))
        oracle = np.fromfile(args.folder / f"{name}.rgb.f32", np.float32).reshape(height, width, 3).astype(float)
        inside = np.fromfile(args.folder / f"{name}.coverage.f32", np.float32).reshape(height, width) == 1
        mean = [(a[0] + a[1])[inside] / 2 for a in (diffuse, gloss, product)]
        oracle = oracle[inside]
        noise = (diffuse[0] - diffuse[1] + gloss[0] - gloss[1])[inside] / 2
        gloss_noise = (gloss[0] - gloss[1])[inside] / 2
        differences = [relative(mean[0] + mean[1] - oracle, oracle),
                       relative(mean[1] - (oracle - mean[0]), mean[1]),
                       relative(mean[0] + mean[2] - oracle, oracle), relative(noise, oracle),
                       relative(gloss_noise, mean[1]), float(np.mean(mean[0] + mean[1]) / np.mean(oracle) - 1)]
        eye = -(np.array(frame["rotation"]).T @ np.array(frame["translation"]))
        elevation = np.degrees(np.arcsin(eye[2] / np.linalg.norm(eye)))
        rows.setdefault(alpha, []).append(differences)
        print(f"{name:12} {elevation:8.0f}  " + "  ".join(f"{100 * v:6.3f}" for v in differences), flush=True)
    print("\n| alpha | oracle to Mitsuba | gloss alone | with the product of G1 | noise | noise of the gloss | mean |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for alpha, values in rows.items():
        rms = np.sqrt(np.mean(np.square(values), 0))
        worst = max(worst, rms[0])
        print(f"| {alpha} | " + " | ".join(f"{100 * v:.2f} %" for v in rms[:5])
              + f" | {100 * np.mean(values, 0)[5]:+.3f} % |")
    print(f"{time.time() - start:.0f} s, {args.spp} samples a pixel")
    sys.exit(0 if worst < 0.01 else 1)


if __name__ == "__main__":
    main()
