"""The radiance of a picture, with little noise for few samples.

The light that lamps give directly has sharp shadows and hardly any noise, if each lamp is traced alone. All other light
(the room, reflections) is noisy and changes slowly along a surface. So a picture is

    direct + smooth(everything - direct)

where `direct` is each lamp alone without reflections, `everything` is path traced, and smooth() averages over the
pixels of a window that show the same surface, divided by their albedo. Everything is unbiased but smooth(), which is
exact where the irradiance is linear within the window. Needs numpy and tracer.py.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

import draw
from smoothing import smooth
from tracer import Traced, mi

# Samples of a picture, and limits per pixel.
DIRECT, DIRECT_PER_PIXEL = 5e6, (8, 48)          # of each lamp
EVERYTHING, EVERYTHING_PER_PIXEL = 6e6, (9, 64)
ALBEDO, ALBEDO_PER_PIXEL = 12e6, (16, 64)
WINDOW_OF_BODY = 1 / 60                          # half a window, as a share of the body's size
HALF_WINDOW_PX = (2, 8)
GLOSS = 0.05                                     # reflectance of a satin coat
PAPER = 1                                        # thousands of the printed faces' numbers in Traced.surfaces()


def albedos(scene: draw.Scene, texture, folder: Path) -> np.ndarray:
    """(h, w, 3) diffuse reflectance, averaged over each pixel."""
    matte = replace(scene, paper_roughness=0.0, table=replace(scene.table, roughness=0.0))
    integrator = mi.load_dict({"type": "aov", "aovs": "albedo:albedo"})
    return Traced(matte, texture, None, folder).image(integrator, ALBEDO, ALBEDO_PER_PIXEL, 0)


def picture(scene: draw.Scene, texture, room: np.ndarray, folder: Path, traced: Traced) -> np.ndarray:
    """(h, w, 3) radiance. `traced`: the whole scene."""
    integrator = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 0})
    direct = sum(Traced(scene, texture, None, folder, lamps=(lamp,)).image(integrator, DIRECT, DIRECT_PER_PIXEL, 1 + i)
                 for i, lamp in enumerate(scene.lamps))
    everything = traced.image(traced.path, EVERYTHING, EVERYTHING_PER_PIXEL, 100)
    surfaces, albedo = traced.surfaces(), albedos(scene, texture, folder)
    satin = np.where(surfaces == 1, scene.table.roughness, 0) + np.where(
        (surfaces == 2) | (surfaces // 1000 == PAPER), scene.paper_roughness, 0)
    albedo = albedo + GLOSS * (satin > 0)[..., None]
    half = int(np.clip(round(scene.size_px * WINDOW_OF_BODY), *HALF_WINDOW_PX))
    return np.maximum(0, direct + smooth(everything - direct, albedo, surfaces, half))
