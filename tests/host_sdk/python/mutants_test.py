#!/usr/bin/env python3
"""Damaged messages: the Python package accepts and refuses the same ones as C++, and gives the same values of those
that it accepts.

usage: mutants_test.py ANSWERS_FOLDER
"""
import pathlib
import sys
import unittest

import numpy as np

import lightwell
from lightwell import Error

FOLDER = pathlib.Path(sys.argv[1])
# The library may be one of another compiler than the one that wrote the answers: sine and cosine of mathematical
# libraries differ in the last bit.
TOLERANCE = 1e-6


def outcome(function, *arguments):
    """("ok", the result), or (the name of the error's status, None)."""
    try:
        return "ok", function(*arguments)
    except Error as error:
        return error.status.name.lower(), None


class Mutants(unittest.TestCase):
    def near(self, got, expected, scale, line):
        self.assertLessEqual(np.abs(np.asarray(got, float) - expected).max(), TOLERANCE * scale, line)

    def check(self, light, line):
        word, *rest = line.split()
        values = np.array([float(v) for v in rest])
        if word == "flags":
            self.assertEqual(int(light.info().flags), values[0], line)
        elif word == "origin":
            info = light.info()
            self.near(info.origin_position, values[:3], 1 + np.abs(values[:3]).max(), line)
            self.near(info.origin_orientation, values[3:], 1, line)
        elif word == "distances":
            distances = [light.distance or 0 for light in light.lights()]
            np.testing.assert_array_equal(np.float32(distances), np.float32(values), line)
        elif word == "irradiance":
            self.near(light.irradiance(values[:3]).value, values[3:], max(np.abs(values[3:]).max(), 1e-30), line)
        else:
            self.fail(f"a line of an unknown kind: {line}")

    def count(self, name, decode):
        """How many messages of a file are accepted and how many are refused, after comparing each."""
        light, counted = None, {True: 0, False: 0}
        for line in (FOLDER / name).read_text().splitlines():
            word, *rest = line.split()
            if word == "mutant":
                message = bytes.fromhex(rest[1]) if len(rest) > 1 else b""
                status, light = outcome(decode, message)
                self.assertEqual(status, rest[0], line)
                counted[status == "ok"] += 1
            elif word != "update":  # Tiles of one message, which the package does not show.
                self.check(light, line)
        return counted

    def test_of_descriptors(self):
        counted = self.count("mutants.txt", lightwell.Lighting.decode)
        self.assertGreater(min(counted.values()), 1000)
        print(f"damaged descriptors: {sum(counted.values())}")

    def test_of_planes(self):
        counted = self.count("plane_mutants.txt", lambda message: lightwell.PlaneReader().take(message))
        self.assertGreater(min(counted.values()), 1000)
        print(f"damaged messages of planes: {sum(counted.values())}")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
