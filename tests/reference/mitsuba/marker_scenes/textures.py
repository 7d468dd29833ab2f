"""Procedural pictures: the texture of a table, and a room as an environment map. Needs numpy.

    Texture, table_texture(table, seed)
    room_map(room)
"""

from dataclasses import dataclass

import numpy as np

import draw

SIDE = 1024                      # pixels of a texture
LARGEST_REFLECTANCE = 0.95
WEAK_PATTERN_M = 0.005           # patterns finer than this are averaged before their contrast is measured
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass
class Texture:
    """Tiles the table without seams."""
    reflectance: np.ndarray      # (n, n, 3), linear
    extent_m: float              # of one tile
    contrast: float              # relative RMS of the luminance, averaged over squares of WEAK_PATTERN_M


def noise(rng: np.random.Generator, across: float, along: float) -> np.ndarray:
    """(SIDE, SIDE) periodic smooth noise, mean 0, variance 1. `across`, `along`: correlation lengths of columns and
    rows in pixels."""
    fy, fx = np.meshgrid(np.fft.fftfreq(SIDE), np.fft.rfftfreq(SIDE), indexing="ij")
    spectrum = rng.normal(size=fx.shape) + 1j * rng.normal(size=fx.shape)
    spectrum *= np.exp(-2 * np.pi**2 * ((fx * across) ** 2 + (fy * along) ** 2) / 2)
    spectrum[0, 0] = 0
    out = np.fft.irfft2(spectrum, (SIDE, SIDE))
    return out / out.std()


def wood(table: draw.Table, rng) -> tuple[np.ndarray, float]:
    """Rings along the rows, bent, with fibres."""
    extent = 0.6
    u = np.arange(SIDE)[None, :] / SIDE
    rings = u * max(1, round(extent / table.scale_m)) + 0.8 * noise(rng, 60, 300)
    late = rings % 1.0  # the share of a ring that has grown; late wood is dark and ends within a tenth of a ring
    profile = np.minimum((late / 0.9) ** 2, (1 - late) / 0.1) - 0.35
    return 1 + table.contrast * (-1.5 * profile + 0.25 * noise(rng, 1, 60)), extent


def tiles(table: draw.Table, rng) -> tuple[np.ndarray, float]:
    """Square tiles, each a little lighter or darker, with joints."""
    count = max(2, round(0.6 / table.scale_m))
    extent = count * table.scale_m
    position = np.arange(SIDE) / SIDE * count
    index = position.astype(int)
    value = 1 + table.contrast * rng.normal(size=(count, count))[np.ix_(index, index)] * 0.5
    joint = np.minimum(position % 1, 1 - position % 1) * table.scale_m < rng.uniform(0.001, 0.0025)
    grout = rng.uniform(0.5, 1.5)
    return np.where(joint[:, None] | joint[None, :], grout, value), extent


def cloth(table: draw.Table, rng) -> tuple[np.ndarray, float]:
    """A plain weave with slow variation."""
    threads = SIDE // 8
    phase = 2 * np.pi * threads * np.arange(SIDE) / SIDE
    weave = np.sin(phase)[None, :] * np.sin(phase)[:, None]
    return 1 + table.contrast * (weave + 0.2 * noise(rng, 40, 40)), threads * table.scale_m / 2


def text(table: draw.Table, rng) -> tuple[np.ndarray, float]:
    """Lines of words of dark strokes on paper."""
    pitch = 24                   # pixels of a line
    out = np.ones((SIDE, SIDE))
    for top in range(0, SIDE - pitch, pitch):
        if rng.uniform() < 0.12:  # between paragraphs
            continue
        at = 8
        while at < SIDE - 90:
            end = at + int(rng.integers(12, 80))
            for stroke in range(at, end, 3):
                if rng.uniform() < 0.75:
                    high = int(rng.integers(5, 9)) if rng.uniform() < 0.2 else 9
                    out[top + high:top + 18, stroke:stroke + 2] = 1 - table.contrast
            at = end + 7
    return out, SIDE / pitch * table.scale_m


def table_texture(table: draw.Table, seed: int) -> Texture:
    rng = np.random.default_rng(seed)
    if table.kind == "uniform":
        value, extent = np.ones((8, 8)), 1.0
    else:
        value, extent = {"wood": wood, "tiles": tiles, "cloth": cloth, "print": text}[table.kind](table, rng)
    value = np.clip(value, 0.02, None)
    value /= value.mean()
    reflectance = value[..., None] * np.array(table.albedo)
    reflectance *= min(1.0, LARGEST_REFLECTANCE / reflectance.max())
    block = max(1, round(WEAK_PATTERN_M / extent * len(value)))
    n = len(value) // block
    coarse = value[:n * block, :n * block].reshape(n, block, n, block).mean((1, 3))
    return Texture(reflectance.astype(np.float32), extent, float(coarse.std() / coarse.mean()))


def room_map(room: draw.Room) -> np.ndarray:
    """(32, 64, 3) radiance relative to the walls; row 0 is the zenith, column 0 is at an azimuth of 180 degrees."""
    rows, columns = 32, 64
    elevation = 90 - (np.arange(rows)[:, None] + 0.5) * 180 / rows
    azimuth = 180 - (np.arange(columns)[None, :] + 0.5) * 360 / columns
    up = 1 / (1 + np.exp(-(elevation - 35) / 6))
    down = 1 / (1 + np.exp((elevation + 12) / 6))
    value = (1 + (room.ceiling - 1) * up + (room.floor - 1) * down) * np.ones((1, columns))
    for w in room.windows:
        off = np.abs((azimuth - w.azimuth_deg + 180) % 360 - 180) / w.half_width_deg
        value = np.where((off < 1) & (np.abs(elevation - w.elevation_deg) < w.half_height_deg), w.radiance, value)
    return (value[..., None] * np.array(room.color)).astype(np.float32)
