#!/usr/bin/env python3
"""LightField of Python: the results of C++ (answers/field_answers.hpp), arrays, errors, the README's example.

usage: field_test.py ANSWERS_FOLDER VECTORS_FOLDER OTHER_MODULE
  OTHER_MODULE   a module of a light field of another version
"""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

import lightwell
from lightwell import FieldFlag, FieldProbeState, Flag, LightField, Status, Validity

ANSWERS = pathlib.Path(sys.argv[1])
LINES = (ANSWERS / "fields.txt").read_text().splitlines()
EXAMPLE = pathlib.Path(__file__).parents[3] / "host_sdk/bindings/python/examples/light_field.py"


def near(got, expected, tolerance=1e-6):
    """Rounding of the solver's sums depends on the alignment of memory."""
    np.testing.assert_allclose(got, expected, rtol=tolerance, atol=tolerance)


def set_sample(field, words):
    name, *numbers, when, message = words
    v = [float(n) for n in numbers]
    field.set(name, lightwell.Lighting.decode(bytes.fromhex(message)), v[0:3], v[3:7], position_sigma=v[7],
              orientation_sigma=v[8], mid_exposure_ns=int(when))


def whole_field():
    """That of the last lines before its geometry, and the time of its last update."""
    field = LightField()
    for line in LINES:
        word, *rest = line.split()
        if word == "triangle":
            break
        if word == "sample":
            set_sample(field, rest)
        elif word == "update":
            now = int(rest[0])
    field.update(now)
    return field, now


class Answers(unittest.TestCase):
    def test_they_are_those_of_cpp(self):
        field, lights, probes, counts = None, (), (), {}
        for line in LINES:
            word, *rest = line.split()
            counts[word] = counts.get(word, 0) + 1
            if word == "sample":
                set_sample(field, rest)
                continue
            v = [float(n) for n in rest[1 if word == "probe" else 0:]]
            if word == "field":
                field = LightField()
            elif word == "triangle":
                field.set_geometry(np.reshape(v, (3, 3)), [[0, 1, 2]])
            elif word == "update":
                state = field.update(int(rest[0]))
                self.assertEqual([len(state.lights), len(state.probes), state.units], v[1:])
                lights, probes = iter(state.lights), iter(state.probes)
            elif word == "light":
                self.check_light(next(lights), v)
            elif word == "probe":
                got = next(probes)
                self.assertEqual([got.name, got.state], [rest[0], v[0]])
                self.assertEqual([got.lights, got.matched, got.ambiguous], v[5:8])
                near([*got.position, got.scale], v[1:5])
                self.assertEqual(got.reason == "", got.state == FieldProbeState.USED)
            elif word == "at":
                self.check_point(field.at(v[0:3], int(rest[3])), v)
            else:
                answer = field.irradiance(v[0:3], v[3:6], int(rest[6]))
                self.assertEqual((answer.validity, answer.value.shape, answer.value.dtype), (v[7], (3,), np.float32))
                near(answer.value, v[8:11])
        self.assertTrue(counts["light"] > 5 and counts["at"] > 30 and counts["irradiance"] > 90, counts)

    def check_light(self, got, v):
        self.assertEqual([got.id, got.placed, got.probes], v[0:3])
        near(got.position, v[3:6])
        near(got.position_covariance[np.triu_indices(3)], v[6:12])
        np.testing.assert_array_equal(got.position_covariance, got.position_covariance.T)
        near([*got.direction, got.direction_sigma], v[12:16])
        near([*got.intensity, *got.intensity_gradient.ravel(), got.radius], v[16:29])

    def check_point(self, got, v):
        self.assertEqual([got.validity, got.age_ns, got.flags, got.field_flags], [v[4], v[5], v[7], v[8]])
        near([got.error_bound, got.nearest_probe], [v[6], v[9]])
        info = got.light.info()
        self.assertEqual([info.validity, info.light_count, info.band], [v[4], v[10], v[11]])


class Arrays(unittest.TestCase):
    def test_positions_and_normals_are_broadcast(self):
        field, now = whole_field()
        positions = np.array([[0, 1, 0], [0.8, 0.5, -0.4], [np.nan, 0, 0]])
        normals = np.array([[0, 1, 0], [0.6, 0, -0.8], [0, -1, 0], [0, 0, 0]], np.float32)
        answer = field.irradiance(positions[:, None], normals[None], now)
        self.assertEqual(answer.value.shape, (3, 4, 3))
        for name in ("validity", "age_ns", "error_bound", "flags", "field_flags", "nearest_probe"):
            self.assertEqual(getattr(answer, name).shape, (3, 4), name)
        for i in range(2):
            here = field.at(positions[i], now)
            near(answer.value[i, :3], here.light.irradiance(normals[:3]).value)
            self.assertTrue((answer.validity[i, :3] == Validity.VALID).all())
            self.assertTrue((answer.field_flags[i] == here.field_flags).all())
        invalid = answer.validity == Validity.INVALID_QUERY
        np.testing.assert_array_equal(invalid, [[0, 0, 0, 1], [0, 0, 0, 1], [1, 1, 1, 1]])
        self.assertFalse(answer.value[invalid].any())
        self.assertEqual(field.irradiance(np.empty((0, 3)), [0, 1, 0], now).value.shape, (0, 3))

    def test_lists_of_other_types_and_orders_are_taken(self):
        field, now = whole_field()
        expected = field.irradiance([0, 1, 0], [0, 1, 0], now).value
        near(field.irradiance(np.array([[0, 9], [1, 9], [0, 9]]).T, (0, 1, 0), now).value[0], expected)
        near(field.irradiance(np.zeros((2, 3), np.float16) + [0, 1, 0], np.int64([0, 1, 0]), now).value, [expected] * 2)

    def test_a_probe_can_be_removed(self):
        field, now = whole_field()
        self.assertTrue(field.at([-1.45, 1.2, -1.35], now).field_flags & FieldFlag.CONTRADICTION)
        field.remove("other")
        self.assertNotIn("other", [p.name for p in field.update(now).probes])
        here = field.at([-1.45, 1.2, -1.35], now)
        self.assertFalse(here.field_flags & FieldFlag.CONTRADICTION)
        self.assertNotIn(Flag.UNSURE, here.flags)
        self.assertTrue(np.isfinite(here.error_bound))

    def test_geometry_can_be_removed(self):
        field, now = whole_field()
        before = field.at([0, 1, 0], now).light.irradiance([0, 1, 0]).value
        field.set_geometry([[-9, 1.3, -9], [9, 1.3, -9], [0, 1.3, 9]], [[0, 1, 2]])
        field.update(now)
        self.assertLess(field.at([0, 1, 0], now).light.irradiance([0, 1, 0]).value[0], before[0])
        field.set_geometry([], [])
        field.update(now)
        near(field.at([0, 1, 0], now).light.irradiance([0, 1, 0]).value, before)


class Errors(unittest.TestCase):
    def refusal(self, status, text, call, *arguments, **more):
        with self.assertRaisesRegex(lightwell.Error, text) as raised:
            call(*arguments, **more)
        self.assertEqual(raised.exception.status, status)

    def test_they_are_named(self):
        field, now = whole_field()
        light = field.at([0, 1, 0], now).light
        self.refusal(Status.INVALID_ARGUMENT, "typical_distance", LightField, typical_distance=-1)
        self.refusal(Status.FAILED_PRECONDITION, "no light", field.set, "a", lightwell.Lighting(), [0, 0, 0])
        self.refusal(Status.INVALID_ARGUMENT, "name", field.set, "", light, [0, 0, 0])
        self.refusal(Status.INVALID_ARGUMENT, "pose", field.set, "a", light, [0, np.nan, 0])
        self.refusal(Status.INVALID_ARGUMENT, "sigma", field.set, "a", light, [0, 0, 0], position_sigma=-1)
        self.refusal(Status.NOT_FOUND, "no probe", field.remove, "nobody")
        self.refusal(Status.INVALID_ARGUMENT, "index 7", field.set_geometry, np.zeros((3, 3)), [[0, 1, 7]])
        for call, arguments in ((field.at, ([0, 0],)), (field.irradiance, ([0, 0, 0], [0, 1])),
                                (field.irradiance, (np.zeros((2, 3)), np.zeros((3, 3)))),
                                (field.set, ("a", light, [0, 0, 0], [0, 0, 1]))):
            with self.assertRaises(ValueError):
                call(*arguments)
        with self.assertRaises(OverflowError):
            field.update(2**63)

    def run_with_module(self, module):
        """What a process says whose library has this module, or none, beside it."""
        with tempfile.TemporaryDirectory() as folder:
            library = pathlib.Path(folder) / "liblightwell.so.1"
            shutil.copy(os.environ["LIGHTWELL_LIBRARY"], library)
            if module:
                (library.parent / "lightwell").mkdir()
                shutil.copy(module, library.parent / "lightwell/lightwell_field.so")
            code = ("import lightwell\ntry:\n  lightwell.LightField()\n"
                    "except lightwell.Error as e:\n  print(e.status.name, e)")
            environment = {**os.environ, "LIGHTWELL_LIBRARY": str(library)}
            return subprocess.run([sys.executable, "-B", "-c", code], env=environment, capture_output=True, text=True,
                                  check=True).stdout

    def test_a_module_that_is_missing_or_of_another_version_is_named(self):
        for module in (None, pathlib.Path(__file__)):
            said = self.run_with_module(module)
            self.assertRegex(said, "^FAILED_PRECONDITION .*lightwell/lightwell_field.so.*lightwell-tools")
        self.assertRegex(self.run_with_module(sys.argv[3]), "^FAILED_PRECONDITION .*is of another version")


class Example(unittest.TestCase):
    def test_it_prints_the_light_at_a_point(self):
        recording = f"replay:{ANSWERS}/answers.lwrec?speed=0"
        done = subprocess.run([sys.executable, "-B", EXAMPLE, "0,1,0", f"{recording}@0,1,0.1"],
                              capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertRegex(done.stdout, r"^\d lights in space, 1 probes\n"
                                      r"irradiance from above \[.*[1-9].*\] within [\dinf.]+\n$")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
