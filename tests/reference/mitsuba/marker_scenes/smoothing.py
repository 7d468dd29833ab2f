"""Averages light over the pixels of a window that show the same surface. Needs numpy alone."""

import numpy as np


def box_sums(values: np.ndarray, half: int) -> np.ndarray:
    """Sums over windows of (2 half + 1) squared pixels, cut at the edges; (h, w, ...)."""
    for axis in (0, 1):
        n = values.shape[axis]
        total = np.cumsum(values, axis)
        total = np.concatenate([np.zeros_like(np.take(total, [0], axis)), total], axis)
        high, low = np.minimum(np.arange(n) + half + 1, n), np.maximum(np.arange(n) - half, 0)
        values = np.take(total, high, axis) - np.take(total, low, axis)
    return values


def inner(surfaces: np.ndarray) -> np.ndarray:
    """(h, w) whether the four neighbours show the same surface."""
    same = np.ones(surfaces.shape, bool)
    for axis in (0, 1):
        equal = np.diff(surfaces, axis=axis) == 0
        for start in (0, 1):
            part = [slice(None)] * 2
            part[axis] = slice(start, start + equal.shape[axis])
            same[tuple(part)] &= equal
    return same


def smooth(light: np.ndarray, albedo: np.ndarray, surfaces: np.ndarray, half: int) -> np.ndarray:
    """`light`: (h, w, 3). Pixels of surface 0 (the room), beside it, and without an inner pixel nearby stay."""
    out, clean = light.copy(), inner(surfaces)
    beside_room = box_sums((surfaces == 0)[..., None].astype(float), 1)[..., 0] > 0
    for number in np.unique(surfaces[surfaces > 0]):
        mine = surfaces == number
        rows, columns = np.flatnonzero(mine.any(1)), np.flatnonzero(mine.any(0))
        part = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
        weight = (mine[part] & clean[part]).astype(float)
        sums = box_sums(np.concatenate([weight[..., None] * light[part], weight[..., None] * albedo[part]], 2), half)
        count = box_sums(weight[..., None], half)[..., 0]
        # Dark and bright pixels count by their albedo: the best estimate if noise is proportional to its root.
        mean = sums[..., :3] / np.maximum(sums[..., 3:], 1e-9) * albedo[part]
        use = mine[part] & (count > 0.5) & ~beside_room[part]
        out[part][use] = mean[use]
    return out
