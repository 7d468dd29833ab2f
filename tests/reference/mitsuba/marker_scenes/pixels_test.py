#!/usr/bin/env python3
"""Smoothing along surfaces, and textures. Skipped without numpy."""

import sys
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
try:
    import numpy as np

    import draw
    import smoothing
    import textures
except ImportError:
    np = None


@unittest.skipIf(np is None, "numpy is missing")
class Smoothing(unittest.TestCase):
    def setUp(self):
        self.surfaces = np.ones((40, 60), int)
        self.surfaces[:, 30:] = 2
        self.albedo = np.full((40, 60, 3), 0.5)
        self.albedo[::3, ::2] = 0.1

    def test_linear_light_stays(self):
        """Also across a step of the light at the surfaces' border, and with a texture."""
        x = np.arange(60)[None, :, None] / 60
        light = self.albedo * np.where(self.surfaces == 1, 1, 3)[..., None] * np.ones((40, 1, 1))
        self.assertLess(np.abs(smoothing.smooth(light, self.albedo, self.surfaces, 4) - light).max(), 1e-12)
        even = np.full_like(self.albedo, 0.5)
        out = smoothing.smooth(even * x, even, np.ones((40, 60), int), 4)
        self.assertLess(np.abs(out - even * x)[5:-5, 5:-5].max(), 1e-12)

    def test_noise_falls_by_the_window(self):
        noise = np.random.default_rng(1).normal(size=(40, 60, 3))
        even = np.ones_like(noise)
        out = smoothing.smooth(1 + noise, even, np.ones((40, 60), int), 3)[6:-6, 6:-6]
        # 49 pixels: a seventh. Some 30 independent windows a channel: the deviation itself is known to a tenth.
        self.assertAlmostEqual(out.std() * 7, 1, delta=0.3)

    def test_the_room_and_pixels_beside_it_stay(self):
        self.surfaces[:, :30] = 0
        light = np.random.default_rng(2).uniform(size=(40, 60, 3))
        out = smoothing.smooth(light, self.albedo, self.surfaces, 3)
        self.assertTrue((out[:, :31] == light[:, :31]).all())
        self.assertFalse((out[:, 31:] == light[:, 31:]).any())


@unittest.skipIf(np is None, "numpy is missing")
class Textures(unittest.TestCase):
    def test_tables(self):
        for kind in draw.TABLE_WEIGHTS:
            with self.subTest(kind):
                table = draw.table_of(draw.Numbers("a"), {kind: 1.0})
                texture = textures.table_texture(table, 7)
                mean = texture.reflectance.astype(float).mean((0, 1))
                self.assertTrue((mean <= np.array(table.albedo) * (1 + 1e-4)).all())
                self.assertTrue(0 < texture.reflectance.min() and texture.reflectance.max() <= 0.9501)
                self.assertEqual(texture.contrast == 0, kind == "uniform")
                again = textures.table_texture(table, 7)
                self.assertTrue((again.reflectance == texture.reflectance).all())

    def test_the_room_is_positive_and_has_its_windows(self):
        room = draw.Room(0.3, 0.2, 1.5, (1.0, 1.0, 1.0), (draw.Window(0.0, 20.0, 20.0, 10.0, 6.0),))
        m = textures.room_map(room)
        self.assertEqual(m.shape, (32, 64, 3))
        self.assertGreater(m.min(), 0.19)
        self.assertEqual(m.max(), 6.0)
        self.assertAlmostEqual(float(m[0, 0, 0]), 1.5, delta=0.01)
        self.assertAlmostEqual(float(m[-1, 0, 0]), 0.2, delta=0.01)


if __name__ == "__main__":
    unittest.main()
