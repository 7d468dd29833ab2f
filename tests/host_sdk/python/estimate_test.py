#!/usr/bin/env python3
"""Lighting.estimate(), color_temperature() and fade_weight() against the results of C++.

usage: estimate_test.py ANSWERS_FOLDER
"""

import pathlib
import sys
import unittest

import numpy as np

import lightwell
from lightwell import LightRequest

LINES = (pathlib.Path(sys.argv[1]) / "estimates.txt").read_text().splitlines()


class Estimates(unittest.TestCase):
    def check_estimate(self, light, numbers):
        requested, gain, neutral, validity, available, *v = numbers
        got = light.estimate(LightRequest(int(requested)), gain=gain, neutral_illuminance=neutral)
        self.assertEqual((got.validity, got.available), (validity, available))
        expected = [v[0], v[1], v[2], v[3], v[4:7], v[7:34], v[34:37], v[37:40], v[40]]
        names = ["ambient_lumens", "mean_illuminance", "color_temperature", "duv", "ambient_color",
                 "ambient_spherical_harmonics", "main_light_direction", "main_light_color", "main_light_lumens"]
        for name, value in zip(names, expected):
            found = getattr(got, name)
            if found is None:
                self.assertEqual(np.count_nonzero(value), 0, name)
            else:
                np.testing.assert_array_equal(np.ravel(np.float32(found)), np.ravel(np.float32(value)), name)

    def test_they_are_those_of_cpp(self):
        counts = {"estimate": 0, "temperature": 0, "fade": 0}
        for line in LINES:
            word, *rest = line.split()
            if word == "message":
                light = lightwell.Lighting.decode(bytes.fromhex(rest[0]))
                continue
            numbers = [float(v) for v in rest]
            counts[word] += 1
            if word == "estimate":
                self.check_estimate(light, numbers)
            elif word == "temperature":
                kelvin, duv = lightwell.color_temperature(numbers[:3]) or (0, 0)
                self.assertEqual([kelvin, duv], numbers[3:])
            else:
                age, hold, fade, weight = numbers
                self.assertEqual(np.float32(lightwell.fade_weight(int(age), int(hold), int(fade))), np.float32(weight))
        self.assertTrue(counts["estimate"] > 500 and counts["temperature"] > 300 and counts["fade"] > 70, counts)

    def test_bad_arguments_are_named(self):
        light = lightwell.Lighting()
        for bad in (0, -1, float("nan"), float("inf")):
            with self.assertRaisesRegex(lightwell.Error, "gain"):
                light.estimate(gain=bad)
            with self.assertRaisesRegex(lightwell.Error, "neutral_illuminance"):
                light.estimate(neutral_illuminance=bad)
        with self.assertRaisesRegex(lightwell.Error, "hold"):
            lightwell.fade_weight(0, -1)
        with self.assertRaisesRegex(lightwell.Error, "fade"):
            light.fade_weight(0, -1)

    def test_what_is_not_known_is_none(self):
        empty = lightwell.Lighting().estimate()
        self.assertEqual((empty.validity, empty.available), (lightwell.Validity.NONE, LightRequest.NONE))
        self.assertIsNone(empty.ambient_lumens)
        self.assertIsNone(empty.color_temperature)
        self.assertEqual(lightwell.Lighting().fade_weight(), 0)
        self.assertIsNone(lightwell.color_temperature([0, 1, 0]))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
