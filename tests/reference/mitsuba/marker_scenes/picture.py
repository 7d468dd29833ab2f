"""The radiance of a picture, with little noise for few samples. Needs numpy, smoothing.py and tracer.py.

The light that lamps give directly has sharp shadows and hardly any noise if each sample goes to each lamp. All other
light that a surface reflects (of the room, of other surfaces) is noisy and changes slowly along it. So a picture is

    direct + smooth(rest)

`direct` is what is visible of lamps and room, and the reflection of each lamp. `rest` is path traced; smooth() averages
it over the pixels of a window that show the same surface, divided by their albedo. Only smooth() is biased; it is exact
where the irradiance is linear within the window.
"""

import numpy as np

import draw
from smoothing import smooth
from tracer import Traced

# Samples of a picture, and limits of the strata of a pixel along an axis.
DIRECT, DIRECT_STRATA = 4.5e6, (3, 6)
REST, REST_STRATA = 2.5e6, (2, 5)
WINDOW_OF_BODY = 1 / 40                          # half a window, as a share of the body's size
HALF_WINDOW_PX = (3, 12)
GLOSS = 0.05                                     # reflectance of a satin coat
PAPER = 1                                        # thousands of the printed faces' numbers in Traced.surfaces()


def strata(samples: float, limits: tuple[int, int], scene: draw.Scene) -> int:
    return int(np.clip(np.sqrt(samples / (scene.crop[2] * scene.crop[3])), *limits))


def picture(scene: draw.Scene, traced: Traced) -> np.ndarray:
    """(h, w, 3) radiance."""
    direct, albedo = traced.direct_light(strata(DIRECT, DIRECT_STRATA, scene))
    rest, surfaces = traced.other_light(strata(REST, REST_STRATA, scene)), traced.surfaces()
    satin = np.where(surfaces == 1, scene.table.roughness, 0) + np.where(
        (surfaces == 2) | (surfaces // 1000 == PAPER), scene.paper_roughness, 0)
    albedo = albedo + GLOSS * (satin > 0)[..., None]
    half = int(np.clip(round(scene.size_px * WINDOW_OF_BODY), *HALF_WINDOW_PX))
    return np.maximum(0, direct + smooth(rest, albedo, surfaces, half))
