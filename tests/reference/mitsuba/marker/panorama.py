"""Panoramas by Lightwell's conventions, in plain numpy: cleaning, directions, the bright region, irradiance.

Written anew from the written rules (proto/README.md: equirectangular images, direction of a bright region). Arrays are
(H, W, 3), row 0 the top; d = (cos theta sin phi, sin theta, -cos theta cos phi), so the middle of the picture is -Z and
+X lies to its right.
"""

import numpy as np

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def clean(image: np.ndarray) -> np.ndarray:
    """The image with NaN and negative values set to 0 and +Inf to the largest finite value."""
    image = np.asarray(image, float)[..., :3].copy()
    image[np.isnan(image) | (image < 0)] = 0
    finite = image[np.isfinite(image)]
    image[np.isinf(image)] = finite.max()
    return image


def directions(height: int) -> np.ndarray:
    """(H, 2H, 3), of the pixels' centres."""
    phi = 2 * np.pi * ((np.arange(2 * height) + 0.5) / (2 * height) - 0.5)
    theta = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    c, s = np.cos(theta)[:, None], np.sin(theta)[:, None]
    return np.stack([c * np.sin(phi), s * np.ones_like(phi), -c * np.cos(phi)], -1)


def solid_angles(height: int) -> np.ndarray:
    """(H, 1) solid angle of a pixel in sr, exact: the zone of a row divided by its number of pixels."""
    edges = np.sin(np.pi * (0.5 - np.arange(height + 1) / height))
    return ((edges[:-1] - edges[1:]) * 2 * np.pi / (2 * height))[:, None]


def turned(image: np.ndarray, columns: int) -> np.ndarray:
    """The room turned about +Y so that what was at azimuth phi (to the right positive) is `columns` pixels further to
    the right."""
    return np.roll(image, columns, axis=1)


def bright_region(image: np.ndarray) -> dict:
    """The 8-connected pixels (over seam and poles) at or above half the peak's luminance, about their weighted
    centroid."""
    height, width = image.shape[:2]
    lum = image @ LUMINANCE
    start = np.unravel_index(np.argmax(lum), lum.shape)
    seen, stack = np.zeros(lum.shape, bool), [start]
    seen[start] = True
    while stack:
        row, column = stack.pop()
        for dr in (-1, 0, 1):
            for dc in (-1, 0, 1):
                r, c = row + dr, column + dc
                if r < 0 or r >= height:
                    r, c = row, c + width // 2
                c %= width
                if not seen[r, c] and lum[r, c] >= lum[start] / 2:
                    seen[r, c] = True
                    stack.append((r, c))
    weight = np.where(seen, lum, 0) * solid_angles(height)
    vector = np.tensordot(weight, directions(height), 2)
    direction = vector / np.linalg.norm(vector)
    facing = np.where(seen, solid_angles(height), 0) * (directions(height) @ direction)
    spread = float((weight * (1 - directions(height) @ direction)).sum() / weight.sum())
    return {
        "direction": direction,
        "vector_irradiance_rgb": np.tensordot(facing, image, 2),
        "pixels": int(seen.sum()),
        "solid_angle_sr": float((seen * solid_angles(height)).sum()),
        "angular_radius_deg": float(np.degrees(np.arccos(1 - 2 * spread))),
        "peak_to_mean": float(lum.max() / ((lum * solid_angles(height)).sum() / (4 * np.pi))),
    }


def irradiance(image: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(n, 3) irradiance: the integral of L max(0, n . d), evaluated at the pixels' centres."""
    light = (image * solid_angles(image.shape[0])[..., None]).reshape(-1, 3)
    d = directions(image.shape[0]).reshape(-1, 3)
    return np.array([np.maximum(d @ n, 0) @ light for n in np.atleast_2d(normals)])


def fibonacci(n: int) -> np.ndarray:
    """(n, 3), spread evenly over the sphere."""
    i = np.arange(n) + 0.5
    y, phi = 1 - 2 * i / n, np.pi * (1 + 5 ** 0.5) * i
    r = np.sqrt(1 - y * y)
    return np.stack([r * np.cos(phi), y, r * np.sin(phi)], 1)
