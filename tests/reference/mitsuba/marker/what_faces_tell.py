#!/usr/bin/env python3
"""Limits of what the faces of a marker determine about the light of a room, for any estimator. No code of Lightwell.

    what_faces_tell.py --direction     the rooms of scenes.json: how far from its place a light with the strongest one's
    own irradiance may stand, so
                                       that some light that is nowhere negative makes up for it on every seen face (half
                                       a percent of their mean)
    what_faces_tell.py --irradiance    26 panoramas, each turned ten times at random: error of the irradiance over
    normals within 60 degrees of the camera,
                                       of the most even light that explains the seen faces (largest entropy), and of a
                                       constant and a slope

Needs numpy, scipy and mitsuba (which reads the panoramas). Exit: 0.
"""

import argparse
import json
import os
from pathlib import Path

import numpy as np
from scipy.optimize import minimize, nnls

import dodecahedron as body
import panorama

HERE = Path(__file__).resolve().parent
# A change below half a percent of the mean irradiance is not observable: errors of albedo and pose alone are larger.
SAME = 0.005
# A face's error in --irradiance, of the mean irradiance, and the noise that faces are given, of their own.
SIGMA, NOISE = 0.02, 0.005
# Faces with a smaller cosine to the camera are not used.
FLATTEST = 0.25


def spiral(count: int) -> np.ndarray:
    i = np.arange(count)
    y = 1 - (2 * i + 1) / count
    s, phi = np.sqrt(1 - y * y), i * np.pi * (3 - 5 ** 0.5)
    return np.stack([s * np.cos(phi), y, s * np.sin(phi)], -1)


def directions_that_do(normals: np.ndarray, irradiance: np.ndarray, strongest: dict) -> float:
    """Angle in degrees from the strongest light's direction to the farthest one within 90 that the faces also allow."""
    grid = spiral(1500)
    cosines = np.maximum(0, normals @ grid.T) * 4 * np.pi / len(grid)
    true, light = np.array(strongest["direction"]), np.array(strongest["vector_irradiance_rgb"])
    farthest = 0.0
    for direction in grid:
        off = np.degrees(np.arccos(np.clip(direction @ true, -1, 1)))
        if off > 90 or off <= farthest:
            continue
        scale = SAME * irradiance.mean(0)
        rest = irradiance - np.outer(np.maximum(0, normals @ direction), light)
        if all(nnls(cosines / scale[c], rest[:, c] / scale[c], maxiter=3000)[1] <= 1 for c in range(3)):
            farthest = off
    return farthest


def most_even(
    normals: np.ndarray, irradiance: np.ndarray, asked: np.ndarray, grid: np.ndarray = spiral(600)
) -> np.ndarray:
    """Irradiance at the normals `asked` of the light of maximum entropy."""
    step = 4 * np.pi / len(grid)
    cosines, at_asked = np.maximum(0, normals @ grid.T), np.maximum(0, asked @ grid.T) * step
    out = []
    for c in range(3):
        mean = irradiance[:, c].mean()
        e, variance = irradiance[:, c] / mean, SIGMA ** 2
        light = lambda mu: np.exp(np.minimum(cosines.T @ mu, 60)) / np.pi
        solved = minimize(
            lambda mu: step * light(mu).sum() - mu @ e + 0.5 * variance * mu @ mu,
            np.zeros(len(e)),
            method="trust-exact",
            jac=lambda mu: step * cosines @ light(mu) - e + variance * mu,
            hess=lambda mu: step * (cosines * light(mu)) @ cosines.T + variance * np.eye(len(e)),
            options={"maxiter": 400},
        )
        out.append(at_asked @ light(solved.x) * mean)
    return np.array(out).T


def slope(normals: np.ndarray, irradiance: np.ndarray, asked: np.ndarray) -> np.ndarray:
    fit = np.linalg.lstsq(np.c_[np.ones(len(normals)), normals], irradiance, rcond=None)[0]
    return np.c_[np.ones(len(asked)), asked] @ fit


def rms(answer: np.ndarray, truth: np.ndarray) -> float:
    return 100 * float(np.sqrt(((answer - truth) ** 2).sum() / (truth ** 2).sum()))


def rooms() -> None:
    frames = json.loads((HERE / "scenes.json").read_text(encoding="utf-8"))["frames"]
    for name, frame in frames.items():
        if frame["group"] != "room":
            continue
        light = frame["panorama"]
        seen = [one["face"] for one in frame["faces_seen"]]
        of_faces = light["face_irradiance_rgb"]
        irradiance = np.array([of_faces[str(i)] if isinstance(of_faces, dict) else of_faces[i] for i in seen])
        normals = (body.normals() @ body.rotation(*frame["T_probe_body"]["q_xyzw"]).T)[seen]
        asked, truth = np.array(light["normals"]), np.array(light["irradiance_rgb"])
        print(
            f"{name}: {100 * light['strongest']['share_of_irradiance_facing_it']:.0f} % of what faces it, "
            f"{len(seen)} faces; it may stand "
            f"{directions_that_do(normals, irradiance, light['strongest']):.0f} deg away; irradiance of the most "
            f"even light off by "
            f"{rms(most_even(normals, irradiance, asked), truth):.1f} %, of a slope "
            f"{rms(slope(normals, irradiance, asked), truth):.1f} %",
            flush=True,
        )


def small(path: Path) -> np.ndarray:
    """A panorama of 128 x 64, means over the pixels' solid angles."""
    import mitsuba as mi
    mi.set_variant("scalar_rgb")
    image = panorama.clean(np.array(mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32)))
    height, rows = image.shape[0], 64
    weight = np.broadcast_to(panorama.solid_angles(height)[..., None], image.shape)
    together = lambda a: a.reshape(rows, height // rows, 2 * rows, height // rows, 3).sum((1, 3))
    return together(image * weight) / together(weight)


def panoramas(folder: Path) -> None:
    random = np.random.default_rng(4)
    directions, weight = panorama.directions(64).reshape(-1, 3), (
        panorama.solid_angles(64) * np.ones((64, 128))
    ).reshape(-1)
    around = spiral(270)
    errors = []
    for path in sorted(folder.glob("*.exr")):
        light = small(path).reshape(-1, 3) * weight[:, None]
        irradiance = lambda normals: np.maximum(0, normals @ directions.T) @ light
        of_path = []
        for _ in range(10):
            turn, azimuth, high = random.uniform(0, 2 * np.pi, 2).tolist() + [
                np.radians(random.choice([10, 26.565, 40]))
            ]
            c, s = np.cos(turn), np.sin(turn)
            camera = np.array([np.cos(high) * np.sin(azimuth), np.sin(high), np.cos(high) * np.cos(azimuth)])
            normals = body.normals() @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T
            seen, asked = normals[normals @ camera > FLATTEST], around[around @ camera > 0.5]
            measured = irradiance(seen)
            measured = measured * (1 + NOISE * random.normal(size=measured.shape))
            of_path.append([rms(method(seen, measured, asked), irradiance(asked)) for method in (most_even, slope)])
        errors += of_path
        print(
            f"{path.stem}: most even {np.median(of_path, 0)[0]:.1f} %, slope {np.median(of_path, 0)[1]:.1f} % "
            f"(medians)",
            flush=True,
        )
    for name, of in zip(("most even", "slope"), np.array(errors).T):
        print(
            f"{name}: median {np.median(of):.1f} %, ninth decile {np.percentile(of, 90):.1f} %, worst {of.max():.0f} "
            f"%, within 10 %: "
            f"{100 * (of <= 10).mean():.0f} % of {len(of)}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--direction", action="store_true")
    parser.add_argument("--irradiance", action="store_true")
    parser.add_argument(
        "--panoramas",
        type=Path,
        default=Path(os.environ.get("LIGHTWELL_PANORAMA_DIR") or Path.home() / ".cache/lightwell/panoramas"),
    )
    options = parser.parse_args()
    if not options.direction and not options.irradiance:
        parser.error("what shall be looked at? There are --direction and --irradiance")
    if options.direction:
        rooms()
    if options.irradiance:
        panoramas(options.panoramas)


if __name__ == "__main__":
    main()
