#!/usr/bin/env python3
"""Captured planes of the Python package against the results of C++. Format of the files: answers/plane_answers.hpp.

usage: plane_test.py ANSWERS_FOLDER
"""

import pathlib
import sys
import unittest

import numpy as np

import lightwell
from lightwell import CaptureProgress, Error, PlaneFlag, PlaneLayers, Status, Units, Validity

FOLDER = pathlib.Path(sys.argv[1])


def lines(name):
    for line in (FOLDER / name).read_text().splitlines():
        word, *rest = line.split(" ")
        yield word, rest


def status_of(call):
    try:
        call()
    except Error as error:
        return error.status.name.lower()
    return "ok"


class Numbers(unittest.TestCase):
    """Bit-exact comparison with C++: the same code computes both."""

    def same(self, got, expected):
        np.testing.assert_array_equal(np.asarray(got, np.float32), np.array(expected, np.float32))

    def answer_is(self, answer, row):
        self.assertEqual((answer.validity, answer.flags), (row[0], row[1]))
        self.same(answer.value, row[2:])

    def info_is(self, info, row):
        self.assertEqual((info.validity, info.revision, info.missing_tiles, info.capture, info.texture_edge), row[:5])
        if info.revision == 0:
            self.assertIsNone(info.units)
            return
        self.assertEqual((info.side, *info.texture_position, info.texture_rotation, info.texture_scale), row[5:10])
        self.same([-1 if v is None else v for v in (info.gloss_alpha, info.f0)], row[10:12])
        self.assertEqual(info.units, Units(int(row[12])))

    def camera_is(self, plane, row):
        width, height = int(row[0]), int(row[1])
        made = plane.render(width, height, *row[2:6], row[6:9], row[9:13], PlaneLayers(int(row[13])))
        self.assertEqual((made.validity, made.flags, made.pixels, made.flagged), row[14:])
        self.assertEqual((made.rgb.shape, made.rgb.dtype), ((height, width, 3), np.float32))
        return made

    def guidance_is(self, guidance, row):
        self.assertEqual(guidance.progress, CaptureProgress(int(row[0])))
        zero = np.zeros(3)
        got = (guidance.seen, guidance.gap, *(zero if guidance.next is None else guidance.next), guidance.circle)
        self.assertEqual(got, row[1:])

    def test_of_a_reader(self):
        reader, plane, picture, texture, met = lightwell.PlaneReader(), None, None, None, set()
        for word, rest in lines("planes.txt"):
            met.add(word)
            if word == "take":
                message = bytes.fromhex(rest[2])
                at = int(rest[1]) * 1_000_000
                self.assertEqual(status_of(lambda: reader.take(message, at)), rest[0])
                continue
            row = tuple(float(v) for v in rest)
            if word == "snapshot":
                plane = reader.snapshot(int(row[0]) * 1_000_000)
                texture = plane.texture()
            elif word == "info":
                self.info_is(plane.info(), row)
            elif word == "pose":
                info = plane.info()
                self.assertEqual((*info.position, *info.orientation), row)
            elif word == "radiance":
                self.answer_is(plane.radiance(row[1:3], row[3:6], PlaneLayers(int(row[0]))), row[6:])
            elif word == "specular":
                self.answer_is(plane.specular(row[:3]), row[3:])
            elif word == "texel":
                k = int(row[0])
                self.assertEqual(texture.flags.flat[k], row[1])
                np.testing.assert_allclose(texture.rgb.reshape(-1, 3)[k], row[2:], rtol=1e-5, atol=0)
            elif word == "guidance":
                self.guidance_is(plane.guidance(), row)
            elif word == "probe":
                probe = plane.guidance().probe
                self.assertEqual(row if probe is not None else (0, 0, 0), row)
                if probe is not None:
                    self.assertEqual(tuple(probe), row)
            elif word == "coverage":
                coverage = plane.coverage()
                self.same(coverage.disc[int(row[0])], row[1:3])
                self.assertEqual(coverage.seen[int(row[0])], row[3])
            elif word == "camera":
                picture = self.camera_is(plane, row)
            elif word == "pixel":
                self.assertEqual(picture.pixel_flags.flat[int(row[0])], row[1])
                self.same(picture.rgb.reshape(-1, 3)[int(row[0])], row[2:])
            else:
                self.fail(f"a line of a known kind: {word}")
        self.assertEqual(len(met), 12)
        stats = reader.stats()
        self.assertGreater(stats.messages, 3)
        self.assertGreater(stats.refused, 2)

    def test_of_damaged_messages(self):
        # A new reader for each message: only the message itself decides.
        count = {"ok": 0, "data_loss": 0, "invalid_argument": 0}
        for word, rest in lines("plane_mutants.txt"):
            if word != "mutant":
                continue
            message = bytes.fromhex(rest[1]) if len(rest) > 1 else b""
            found = status_of(lambda: lightwell.PlaneReader().take(message, 0))
            self.assertEqual(found, rest[0])
            count[found] += 1
        for n in count.values():
            self.assertGreater(n, 300)


class Objects(unittest.TestCase):
    """Virtual objects on a plane; the scene is that of write_objects() in answers/plane_answers.cpp."""

    def setUp(self):
        self.rows, reader, self.lighting = {}, lightwell.PlaneReader(), None
        for word, rest in lines("plane_objects.txt"):
            if word == "take":
                reader.take(bytes.fromhex(rest[0]), 0)
            elif word == "lighting":
                self.lighting = lightwell.Lighting.decode(bytes.fromhex(rest[0]))
            else:
                self.rows.setdefault(word, []).append([float(v) for v in rest])
        self.plane = reader.snapshot(0)
        self.mesh = lightwell.Mesh([[0, 0, 0.05], [0.06, 0, 0.05], [0, 0.06, 0.07]], [[0, 2, 1]])

    def texels_are(self, image, word):
        rows = np.array(self.rows[word])
        self.assertGreater(len(rows), 50)
        np.testing.assert_array_equal(image.reshape(-1, image.shape[-1])[rows[:, 0].astype(int)],
                                      rows[:, 1:].astype(np.float32))

    def test_reflections_are_those_of_cpp(self):
        reflector = lightwell.PlaneReflector()
        made = reflector.render(self.plane, self.mesh, [[5, 4, 3], [9, 9, 9], [1, 2, 3]], (0, -0.2, 0.3), 0.3, 0.3,
                                centre=(0.01, -0.01), columns=64, rows=64)
        self.assertEqual([[made.validity, made.texels]], self.rows["reflection"])
        self.texels_are(np.concatenate([made.reflected, made.hidden[..., None]], axis=-1), "reflected")
        with self.assertRaises(ValueError):
            reflector.render(self.plane, self.mesh, [[1, 1, 1]] * 2, (0, 0, 1), 0.3, 0.3)

    def test_shadows_are_those_of_cpp(self):
        made = lightwell.ShadowCaster().cast(self.lighting, self.mesh, 0.3, 0.3, columns=64, rows=64)
        self.assertEqual((made.no_light, made.ignored_triangles), (False, 0))
        self.texels_are(made.ratios, "shadow")

    def test_the_planes_light_is_that_of_cpp(self):
        light = lightwell.PlaneLight()
        light.update(self.plane)
        for row in self.rows["light"]:
            answer = light.irradiance(row[:3], row[3:6], PlaneLayers(int(row[6])))
            self.light_is(answer, row[7:])
        for row in self.rows["light_in"]:
            self.light_is(light.irradiance_in(self.lighting, row[:3], row[3:6]), row[6:])

    def light_is(self, answer, row):
        self.assertEqual([answer.validity, answer.flags, answer.source], row[:3])
        np.testing.assert_array_equal(answer.value, np.array(row[3:], np.float32))


class Features(unittest.TestCase):
    def test_arrays_are_broadcast(self):
        plane = self.plane()
        points = np.zeros((2, 3, 2))
        points[..., 0] = np.linspace(-0.05, 0.05, 3)
        many = plane.radiance(points, (0, 0, 0.5))
        self.assertEqual((many.value.shape, many.validity.shape), ((2, 3, 3), (2, 3)))
        one = plane.radiance(points[1, 2], (0, 0, 0.5))
        np.testing.assert_array_equal(many.value[1, 2], one.value)
        self.assertEqual(one.validity, Validity.VALID)
        self.assertEqual(plane.diffuse(points).value.shape, (2, 3, 3))
        with self.assertRaises(ValueError):
            plane.radiance((0, 0, 0), (0, 0, 1))

    def test_a_probe_has_the_plane_of_a_recording(self):
        with lightwell.connect(f"replay:{FOLDER}/planes.lwrec?speed=0", plane=True) as probe:
            self.wait_for_the_end(probe)
            self.assertEqual(probe.plane().info().capture, 8)
            into = lightwell.Plane()
            self.assertIs(probe.plane(into), into)
            self.assertEqual(into.validity, Validity.VALID)
        with lightwell.connect(f"replay:{FOLDER}/planes.lwrec?speed=0") as probe:
            self.wait_for_the_end(probe)
            self.assertEqual(probe.plane().validity, Validity.NONE)

    def test_without_data_there_is_no_plane(self):
        plane = lightwell.Plane()
        self.assertEqual(plane.validity, Validity.NONE)
        self.assertIsNone(plane.texture())
        self.assertEqual(plane.radiance((0, 0), (0, 0, 1)).validity, Validity.NONE)
        self.assertEqual(plane.radiance((np.nan, 0), (0, 0, 1)).validity, Validity.INVALID_QUERY)
        self.assertEqual(plane.render(4, 3, 1, 1, 0, 0, (0, 0, -1)).validity, Validity.INVALID_QUERY)
        with self.assertRaises(Error) as caught:
            lightwell.PlaneReader().take(b"\xff")
        self.assertEqual(caught.exception.status, Status.DATA_LOSS)
        self.assertEqual(PlaneFlag(3), PlaneFlag.UNSEEN_DIRECTION | PlaneFlag.CLIPPED_DIRECTION)

    @staticmethod
    def plane():
        reader = lightwell.PlaneReader()
        for word, rest in lines("planes.txt"):
            if word == "take" and rest[0] == "ok" and int(rest[1]) < 1000:
                reader.take(bytes.fromhex(rest[2]))
        return reader.snapshot()

    @staticmethod
    def wait_for_the_end(probe):
        try:
            seen = None
            while True:
                seen = probe.wait_for_next(seen, timeout=60).info().sequence
        except Error as error:
            if error.status != Status.FAILED_PRECONDITION:
                raise


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
