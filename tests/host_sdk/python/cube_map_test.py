#!/usr/bin/env python3
"""Lighting.cube_map() against the results of C++.

usage: cube_map_test.py ANSWERS_FOLDER VECTORS_FOLDER
"""

import pathlib
import sys
import unittest

import numpy as np

import lightwell

FOLDER = pathlib.Path(sys.argv[1])
VECTORS = pathlib.Path(sys.argv[2])


class CubeMap(unittest.TestCase):
    def test_lamp_is_in_the_middle_of_its_face(self):
        light = lightwell.Lighting.decode((VECTORS / "v1_lamp_at_plus_x.bin").read_bytes())
        texels = light.cube_map(edge=9, dtype=np.float32)
        self.assertEqual((texels.shape, texels.dtype), ((6, 9, 9, 4), np.float32))
        self.assertEqual(np.unravel_index(texels[..., 0].argmax(), texels.shape[:3]), (0, 4, 4))
        self.assertLess(light.cube_map(edge=9, lights=False)[0, 4, 4, 0], texels[0, 4, 4, 0] / 2)
        np.testing.assert_allclose(light.cube_map(edge=9, scale=0.5), texels * [0.5, 0.5, 0.5, 1], rtol=1e-3)

    def test_bad_arguments_are_named(self):
        for name, value in (("edge", 0), ("edge", 65), ("scale", 0), ("scale", float("nan")), ("dtype", np.int32)):
            with self.assertRaisesRegex(ValueError, name):
                lightwell.Lighting().cube_map(**{name: value})

    def test_texels_are_those_of_cpp(self):
        maps = 0
        for line in (FOLDER / "cube_maps.txt").read_text().splitlines():
            word, *rest = line.split()
            if word == "message":
                light = lightwell.Lighting.decode(bytes.fromhex(rest[0]))
                continue
            edge, lights, scale, _, *texels = map(float, rest)
            got = light.cube_map(edge=int(edge), lights=lights == 1, scale=scale, dtype=np.float32)
            expected = np.array(texels, dtype=np.float32).reshape(6, int(edge), int(edge), 3)
            np.testing.assert_array_equal(got[..., :3], expected)
            self.assertTrue((got[..., 3] == 1).all())
            maps += 1
        self.assertGreater(maps, 20)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
