#!/usr/bin/env python3
"""Smoothing along surfaces, textures, and the camera from radiance to a file. Needs numpy and Pillow."""

import io
import sys
import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
import camera_sensor  # noqa: E402
import draw  # noqa: E402
import smoothing  # noqa: E402
import textures  # noqa: E402


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


class Sensor(unittest.TestCase):
    """With a scene of the set defects: its sensor has no errors."""

    def setUp(self):
        self.scene = draw.picture("defects/03_none")
        self.even = np.full((self.scene.crop[3], self.scene.crop[2], 3), 0.5)

    def with_sensor(self, **changes):
        return replace(self.scene, sensor=replace(self.scene.sensor, **changes))

    def decoded(self, scene, radiance) -> np.ndarray:
        file, _ = camera_sensor.developed(scene, radiance, np.ones(3))
        v = np.asarray(Image.open(io.BytesIO(file))) / 255
        return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)

    def test_the_brightest_paper_has_its_level(self):
        white, light = np.array([2.0, 1.0, 0.5]), np.array([3.0, 1.0, 0.4])
        gains = camera_sensor.gains_of(self.scene.sensor, white, light)
        self.assertAlmostEqual((gains * white).max(), self.scene.sensor.level)
        # The light's colour is removed wholly.
        self.assertLess(np.ptp(gains * light), 1e-12)

    def test_even_light_is_encoded_and_decoded(self):
        # A code is 0.9 % of full scale at this level.
        self.assertLess(np.abs(self.decoded(self.scene, self.even) - 0.5).max(), 0.0045)

    def test_noise_has_its_variance(self):
        noisy = self.decoded(self.with_sensor(electrons=3000.0, read_noise=0.005), self.even)[..., 1]
        # sqrt(0.5 / 3000 + 0.005^2); JPEG of quality 97 removes a little.
        self.assertAlmostEqual(noisy.std() / np.sqrt(0.5 / 3000 + 0.005**2), 1, delta=0.1)

    def test_vignetting_at_the_corner_of_the_sensor(self):
        c = self.scene.camera
        whole = replace(self.with_sensor(vignetting=0.25), crop=(0, 0, c.width, c.height))
        v = camera_sensor.vignetting_of(whole)
        # The middle of the corner's pixel is half a pixel within the corner.
        self.assertAlmostEqual(v[0, 0], 0.75, delta=0.001)
        self.assertAlmostEqual(v[c.height // 2, c.width // 2], 1, delta=1e-5)
        x, y, w, h = self.scene.crop
        self.assertTrue((camera_sensor.vignetting_of(self.with_sensor(vignetting=0.25)) == v[y:y + h, x:x + w]).all())

    def test_blur_has_its_width(self):
        line = np.zeros((9, 31, 3))
        line[:, 15] = 1
        for sigma in (0.5, 1.0, 2.0):
            row = camera_sensor.blurred(line, sigma)[4, :, 0]
            self.assertAlmostEqual(row.sum(), 1)
            # A pixel has a variance of 1/12.
            self.assertAlmostEqual(row @ (np.arange(31) - 15) ** 2, sigma**2 + 1 / 12, delta=0.03 * sigma**2 + 0.01)

    def test_quality_falls_for_the_size_of_the_file_but_not_of_a_defect(self):
        noise = np.random.default_rng(3).uniform(0, 1, (400, 400, 3))
        scene = replace(self.scene, crop=(0, 0, 400, 400))
        _, quality = camera_sensor.developed(scene, noise, np.ones(3))
        self.assertEqual(quality, self.scene.sensor.jpeg_quality)
        file, quality = camera_sensor.developed(replace(scene, defect=""), noise, np.ones(3))
        self.assertEqual(quality, camera_sensor.LEAST_QUALITY)
        _, quality = camera_sensor.developed(replace(scene, defect=""), 0 * noise, np.ones(3))
        self.assertEqual(quality, self.scene.sensor.jpeg_quality)


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
