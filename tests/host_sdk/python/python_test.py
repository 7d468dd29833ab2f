#!/usr/bin/env python3
"""The Python package against the results of C++, and its own features: arrays, errors, threads.

usage: python_test.py ANSWERS_FOLDER VECTORS_FOLDER
"""

import gc
import pathlib
import pickle
import sys
import threading
import time
import unittest

import numpy as np

import answers
import lightwell
from lightwell import Derivation, Error, LinkState, Status, Units, Validity

FOLDER = sys.argv[1]
VECTORS = pathlib.Path(sys.argv[2])
MESSAGES = answers.read(FOLDER)


def connect(speed=0, **options):
    return lightwell.connect(f"replay:{FOLDER}/answers.lwrec?speed={speed}", **options)


def play_out(probe):
    light, seen = None, None
    try:
        while True:
            light = probe.wait_for_next(seen, timeout=60)
            seen = light.info().sequence
    except Error as error:
        if error.status != Status.FAILED_PRECONDITION:
            raise
    return light


class Numbers(unittest.TestCase):
    """Bit-exact comparison with C++: nine digits identify a float."""

    def same(self, got, rows):
        np.testing.assert_array_equal(got, np.array(rows, np.float32))

    def agrees(self, light, message):
        rows = np.array(message.lines["irradiance"])
        answer = light.irradiance(rows[:, :3])
        # Batch queries sum in another order.
        np.testing.assert_allclose(answer.value, rows[:, 3:], rtol=0, atol=1e-5 * np.abs(rows[:, 3:]).max())
        self.assertEqual(answer.value.dtype, np.float32)
        rows = np.array(message.lines["radiance"])
        for roughness in np.unique(rows[:, 3]):
            some = rows[rows[:, 3] == roughness]
            answer = light.radiance(some[:, :3], roughness)
            self.same(answer.value, some[:, 4:])
            self.assertEqual(answer.lights_included, roughness > 0)
        rows = np.array(message.lines["coefficient"])
        self.same(light.radiance_coefficients(), rows[rows[:, 0] == 0][:, 2:])
        self.same(light.irradiance_coefficients(), rows[rows[:, 0] == 1][:, 2:])
        lights = light.lights()
        self.assertEqual(len(lights), len(message.lines["light"]))
        for found, row in zip(lights, message.lines["light"]):
            self.same(found.direction, row[0:3])
            self.same(found.irradiance, row[3:6])
            self.same(found.direction_covariance, row[7:10])
            self.assertEqual((np.float32(found.angular_radius), found.track), (np.float32(row[6]), row[10]))
            self.place_agrees(found, row[11:])
        units, flags, bound, band, _, coverage = message.lines["info"][0]
        info = light.info()
        self.assertEqual((info.sequence, info.units, info.flags, info.band), (message.sequence, units, flags, band))
        self.same([info.bound_total, info.coverage], [bound, coverage])
        # Nine digits of double.
        np.testing.assert_allclose(np.concatenate([info.origin_position, info.origin_orientation]),
                                   message.lines["origin"][0], rtol=1e-8, atol=1e-9)
        self.map_agrees(light.environment(), message)
        for row in message.lines["rotated"][:3]:
            got = light.rotated(row[:4]).irradiance(row[4:7]).value
            scale = np.abs(light.radiance_coefficients()).max() + sum(l.irradiance.max() for l in lights)
            np.testing.assert_allclose(got, row[7:], atol=1e-5 * float(scale))

    def place_agrees(self, found, row):
        if row[0] == 0:
            self.assertEqual((found.distance, found.distance_sigma, found.position), (None, None, None))
            return
        self.same([found.distance, found.distance_sigma], row[:2])
        # A position is computed as double and rounded to float here.
        np.testing.assert_allclose(found.position, row[2:], rtol=1e-6, atol=1e-6)

    def map_agrees(self, environment, message):
        levels, _ = message.lines["map"][0]
        self.assertEqual(0 if environment is None else len(environment.levels), levels)
        for k, (edge, roughness) in enumerate(message.lines["level"]):
            self.assertEqual(environment.levels[k].radiance.shape, (edge, edge, 3))
            self.same(environment.levels[k].roughness, roughness)
        for level, index, *rgb in message.lines["texel"]:
            self.same(environment.levels[int(level)].radiance.reshape(-1, 3)[int(index)], rgb)

    def test_of_messages(self):
        self.assertGreater(len(MESSAGES), 15)
        for message in MESSAGES:
            if message.payload is not None:
                with self.subTest(sequence=message.sequence):
                    self.agrees(lightwell.Lighting.decode(message.payload), message)

    def test_of_a_recording_with_its_map(self):
        with connect() as probe:
            play_out(probe)
            self.agrees(probe.latest(), MESSAGES[-1])
            self.assertIsNone(MESSAGES[-1].payload)
            self.assertIsNotNone(probe.latest().environment())


class World(unittest.TestCase):
    def test_near_lamp_is_placed_in_it(self):
        message = (VECTORS / "v1_near_lamp.bin").read_bytes()
        light = lightwell.Lighting.decode(message)
        near, distant = light.lights()
        np.testing.assert_allclose(near.position, [0.3625, -0.125, -0.75], rtol=1e-6)
        self.assertIsNone(distant.position)
        # Left by a quarter about +Y: +X becomes -Z, and -Z becomes -X.
        world = light.in_world([5, -2, 100], [0, np.sqrt(0.5), 0, np.sqrt(0.5)])
        near, distant = world.lights()
        np.testing.assert_allclose(near.position, [4.25, -2.125, 99.6375], rtol=1e-6)
        np.testing.assert_allclose(world.info().origin_position, [4.25, -2.125, 99.9375], rtol=1e-12)
        self.assertAlmostEqual(near.distance, 0.3, 6)
        self.assertIsNone(distant.position)
        self.assertEqual(light.in_world([np.nan, 0, 0], [0, 0, 0, 1]).validity, Validity.INVALID_QUERY)
        with self.assertRaises(ValueError):
            light.in_world([0, 0], [0, 0, 0, 1])


class Engines(unittest.TestCase):
    CHOICES = {"webxr": 1, "arcore": 0, "openxr": 2, "arkit": 0, "unity": 2, "three": 2, "filament": 1, "unreal": 1}

    def test_are_given_what_cpp_gives_them(self):
        met = set()
        for message in MESSAGES:
            if message.payload is None:
                continue
            light = lightwell.Lighting.decode(message.payload)
            for name, (a, b, validity, residual, *numbers) in message.lines["engine"]:
                choices = [int(a), int(b)][:self.CHOICES[name]]
                got = getattr(light, f"to_{name}")(*choices)
                self.assertEqual((got.validity, np.float32(got.residual)), (validity, np.float32(residual)))
                # In the order of the struct, without host times.
                fields = [value for key, value in vars(got).items()
                          if key not in ("validity", "residual", "timestamp", "lastUpdatedTime")]
                np.testing.assert_array_equal(np.concatenate([np.atleast_1d(f) for f in fields]).astype(np.float32),
                                              np.array(numbers, np.float32), name)
                met.add(name)
        self.assertEqual(met, set(self.CHOICES))

    def test_take_a_colour_and_leave_the_residual_out(self):
        light = lightwell.Lighting.decode(MESSAGES[-2].payload)
        plain = light.to_unity(lightwell.UnityPipeline.HIGH_DEFINITION)
        half = light.to_unity(
            lightwell.UnityPipeline.HIGH_DEFINITION, color=0.5 * np.eye(3), residual=lightwell.Residual.LEFT_OUT
        )
        self.assertIsNone(half.residual)
        np.testing.assert_allclose(half.sphericalHarmonicsL2, plain.sphericalHarmonicsL2 / 2, rtol=1e-5, atol=1e-3)
        self.assertEqual(half.intensity, plain.intensity / 2)
        self.assertEqual(light.to_three(color=np.full((3, 3), np.nan)).validity, Validity.INVALID_QUERY)
        self.assertEqual(lightwell.Lighting().to_three().validity, Validity.NONE)
        with self.assertRaises(ValueError):
            light.to_three(color=[1, 2, 3])
        with self.assertRaises(Error):
            light.to_three(2)


class Arrays(unittest.TestCase):
    def setUp(self):
        self.light = lightwell.Lighting.decode(MESSAGES[-2].payload)

    def test_the_shape_of_the_questions_is_that_of_the_answers(self):
        for shape in ((3,), (1, 3), (0, 3), (4, 5, 3)):
            normals = np.ones(shape)
            self.assertEqual(self.light.irradiance(normals).value.shape, shape)
            self.assertEqual(self.light.radiance(normals, 0.5).value.shape, shape)

    def test_strided_and_other_types_are_taken(self):
        vertices = np.random.default_rng(3).normal(size=(20, 6))
        straight = self.light.irradiance(vertices[:, 3:].astype(np.float32)).value
        for normals in (vertices[:, 3:], vertices[:, 3:].tolist(), vertices[::-1, 3:][::-1],
                        np.asfortranarray(vertices[:, 3:])):
            np.testing.assert_array_equal(self.light.irradiance(normals).value, straight)
        one_by_one = [self.light.irradiance(n).value for n in vertices[:, 3:]]
        np.testing.assert_allclose(straight, one_by_one, rtol=0, atol=1e-5 * straight.max())

    def test_other_shapes_are_refused(self):
        for bad in (1.0, [1, 2], np.ones((3, 2)), "up"):
            with self.assertRaises(ValueError):
                self.light.irradiance(bad)
        with self.assertRaises(ValueError):
            self.light.rotated([0, 0, 1])
        with self.assertRaises(ValueError):
            self.light.radiance_coefficients(7)

    def test_no_question_is_counted_and_zero(self):
        answer = self.light.irradiance([[0, 1, 0], [0, 0, 0], [np.nan, 0, 1], [0, np.inf, 0], [1e300, 0, 0]])
        self.assertEqual((answer.refused, answer.validity), (4, Validity.INVALID_QUERY))
        self.assertTrue(answer.reason)
        self.assertTrue((answer.value[1:] == 0).all() and (answer.value[0] > 0).all())
        self.assertEqual(self.light.radiance([0, 1, 0], float("nan")).validity, Validity.INVALID_QUERY)
        self.assertEqual(self.light.rotated([0, 0, 0, 0]).validity, Validity.INVALID_QUERY)

    def test_coefficients_are_cut_or_filled_up(self):
        own = self.light.radiance_coefficients()
        self.assertEqual(self.light.radiance_coefficients(2).shape, (9, 3))
        np.testing.assert_array_equal(self.light.radiance_coefficients(2), own[:9])
        constant = lightwell.Lighting.decode(MESSAGES[0].payload)
        self.assertEqual(constant.radiance_coefficients(6).shape, (49, 3))
        self.assertTrue((constant.radiance_coefficients(6)[1:] == 0).all())


class Errors(unittest.TestCase):
    def raises(self, status, words):
        test = self

        class Context:
            def __enter__(self):
                return self

            def __exit__(self, kind, error, _):
                test.assertIsInstance(error, Error)
                test.assertEqual(error.status, status)
                test.assertIn(words, str(error))
                return True

        return Context()

    def test_carry_status_and_remedy(self):
        with self.raises(Status.INVALID_ARGUMENT, "grpc://"):
            lightwell.connect("http://here")
        with self.raises(Status.NOT_FOUND, "nowhere"):
            lightwell.connect("replay:/nowhere/ä")
        with self.raises(Status.UNAVAILABLE, "lightwelld"):
            lightwell.connect("ws://127.0.0.1:1", connect_timeout=0.2)
        with self.raises(Status.INVALID_ARGUMENT, "history"):
            connect(history=5000)
        with self.raises(Status.INVALID_ARGUMENT, "max_age"):
            connect(max_age=-1)
        with self.raises(Status.DATA_LOSS, "descriptor"):
            lightwell.Lighting.decode(b"\x01\x02\x03")
        with self.assertRaises(TypeError):
            connect(patience=3)

    def test_integers_that_c_cannot_hold_are_refused_as_they_are(self):
        for history in (2**31, -2**31 - 1, 2**64 + 3):
            with self.assertRaisesRegex(OverflowError, f"history is {history}; it is -2147483648 to 2147483647"):
                connect(history=history)
        light = lightwell.Lighting.decode(MESSAGES[0].payload)
        with self.assertRaisesRegex(OverflowError, "signs"):
            light.to_webxr(2**32)
        self.assertEqual(light.to_webxr(np.int64(1)).validity, light.to_webxr(1).validity)
        with connect() as probe:
            with self.assertRaises(OverflowError):
                probe.at(2**63)
            with self.assertRaises(TypeError):
                probe.at(1.5)

    def test_of_a_recording_that_cannot_be_told(self):
        with connect() as probe:
            with self.raises(Status.FAILED_PRECONDITION, "recording"):
                probe.set_estimator(band=2)
            with self.raises(Status.FAILED_PRECONDITION, "recording"):
                probe.report_lux(100, [0, 1, 0])
            with self.raises(Status.INVALID_ARGUMENT, "band"):
                probe.set_estimator(band=9)
            with self.raises(Status.INVALID_ARGUMENT, "lux"):
                probe.report_lux(float("nan"), [0, 1, 0])
            for change in (probe.change_estimator, probe.set_estimator):
                for name in ("bandwidth", "size", "reserved", "estimator"):
                    with self.assertRaises(TypeError):
                        change(**{name: 2})
                with self.raises(Status.INVALID_ARGUMENT, "fast, balanced, exact"):
                    change(setting="quick")
                with self.raises(Status.INVALID_ARGUMENT, "specular.environment_edge"):
                    change(specular_environment_edge=7)
                with self.raises(Status.FAILED_PRECONDITION, "recording"):
                    change(setting="fastest", unseen=lightwell.UnseenFill.MIRROR, marker_max_faces=3,
                           specular_environment_edge=64, interleave=8, max_bytes=128)
            with self.raises(Status.INVALID_ARGUMENT, "no field"):
                probe.change_estimator()
            with self.raises(Status.FAILED_PRECONDITION, "recording"):
                probe.estimator_config()

    def test_of_a_closed_probe(self):
        probe = connect()
        light = play_out(probe)
        probe.close()
        probe.close()
        with self.raises(Status.FAILED_PRECONDITION, "closed"):
            probe.latest()
        self.assertEqual(light.info().sequence, 113, "lightings live on")

    def test_travel_between_processes(self):
        error = pickle.loads(pickle.dumps(Error(Status.DATA_LOSS, "torn")))
        self.assertEqual((error.status, str(error)), (Status.DATA_LOSS, "torn"))


class Connection(unittest.TestCase):
    def test_tells_who_and_how(self):
        with connect() as probe:
            play_out(probe)
            info, stats = probe.info(), probe.stats()
            self.assertEqual((info.name, info.version, info.id, info.calibration_id), ("attic", "0.1.0", 7, 9))
            self.assertEqual((stats.state, stats.received, stats.maps), (LinkState.ENDED, 14, 2))
            self.assertEqual(stats.last_error, "")

    def test_answers_grow_stale_and_say_so(self):
        with connect(max_age=0.05) as probe:
            play_out(probe)
            time.sleep(0.1)
            light = probe.latest()
            self.assertEqual(light.validity, Validity.STALE)
            self.assertIn("50 ms", light.reason)
            self.assertGreaterEqual(light.age_ns, 50_000_000)
            answer = light.irradiance([0, 1, 0])
            self.assertEqual((answer.validity, answer.units), (Validity.STALE, Units.ABSOLUTE))

    def test_the_past_is_asked_by_pythons_own_clock(self):
        # At the original speed, because extrapolation by at() needs descriptors as far back as it extrapolates.
        with connect(speed=1, max_age=60) as probe:
            play_out(probe)
            self.assertEqual(probe.at(time.monotonic_ns()).info().sequence, 113)
            newest = probe.latest().info()
            for ahead, derivation in ((0, Derivation.MEASURED), (1_000_000, Derivation.EXTRAPOLATED),
                                      (500_000_000, Derivation.HELD)):
                self.assertEqual(probe.at(newest.mid_exposure_ns + ahead).info().derivation, derivation)
        with connect(max_age=60, extrapolation=0) as probe:
            play_out(probe)
            newest = probe.latest().info()
            self.assertEqual(probe.at(newest.mid_exposure_ns + 1_000_000).info().derivation, Derivation.HELD)
            self.assertEqual(probe.at(0).validity, Validity.BEFORE_HISTORY)

    def test_a_lighting_is_filled_again(self):
        with connect() as probe:
            light = lightwell.Lighting()
            self.assertEqual((light.validity, light.reason), (Validity.NONE, "no descriptor has come yet"))
            play_out(probe)
            self.assertIs(probe.latest(into=light), light)
            self.assertEqual(light.info().sequence, 113)
            kept = light.copy()
            del light
            gc.collect()
            self.assertEqual(kept.info().sequence, 113)

    def test_other_threads_run_while_one_waits(self):
        with connect() as probe:
            play_out(probe)
            # Many descriptors at intervals of 0.5 ms, the last after 1.5 s.
            with lightwell.connect(f"replay:{FOLDER}/threads.lwrec?speed=0.05") as slow:
                ticks = []
                thread = threading.Thread(target=lambda: [ticks.append(time.sleep(0.001)) for _ in range(20)])
                thread.start()
                seen = slow.wait_for_next(timeout=60).info().sequence
                for _ in range(5):
                    seen = slow.wait_for_next(seen, timeout=60).info().sequence
                thread.join()
                self.assertEqual(len(ticks), 20)

    def test_close_while_another_thread_waits(self):
        probe = lightwell.connect(f"replay:{FOLDER}/threads.lwrec?speed=0.0001")
        seen = probe.wait_for_next(timeout=60).info().sequence
        caught = []

        def wait():
            try:
                probe.wait_for_next(seen, timeout=3600)
            except Error as error:
                caught.append(error.status)

        thread = threading.Thread(target=wait)
        thread.start()
        time.sleep(0.05)
        probe.close()
        thread.join(timeout=60)
        self.assertFalse(thread.is_alive())
        self.assertEqual(caught, [Status.FAILED_PRECONDITION])

    def test_close_leaves_a_probe_that_is_in_use_alone(self):
        probe = connect()
        # The guard that every method holds during a call into C.
        with probe._used() as raw:
            probe.close()
            self.assertEqual(probe._raw, raw)
            with self.assertRaises(Error):
                probe.latest()
            self.assertEqual(probe._raw, raw)
        self.assertIsNone(probe._raw)

    def test_many_threads_ask_at_once(self):
        wrong = []

        def ask(probe):
            last = 0
            while last < 3000 and probe.stats().state != LinkState.ENDED:
                light = probe.latest()
                if light.validity == Validity.NONE:
                    continue
                sequence = light.info().sequence
                if sequence < last or abs(light.lights()[0].irradiance[0] / sequence - 1) > 1e-3:
                    wrong.append(sequence)
                last = sequence

        with lightwell.connect(f"replay:{FOLDER}/threads.lwrec?speed=2") as probe:
            threads = [threading.Thread(target=ask, args=(probe,)) for _ in range(3)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        self.assertEqual(wrong, [])


class Public(unittest.TestCase):
    def test_everything_public_is_explained(self):
        for name in lightwell.__all__:
            self.assertTrue(getattr(lightwell, name).__doc__, name)
        for kind in (lightwell.Probe, lightwell.Lighting):
            for name in vars(kind):
                if not name.startswith("_") and name not in ("copy", "validity", "age_ns"):
                    self.assertTrue(getattr(kind, name).__doc__, name)

    def test_the_enumerations_are_the_headers(self):
        from lightwell._abi import lib
        for kind, prefix in ((lightwell.Residual, "LW_RESIDUAL_"), (lightwell.ShSigns, "LW_SH_"),
                             (lightwell.MainLight, "LW_MAIN_LIGHT_"), (lightwell.UnityPipeline, "LW_UNITY_"),
                             (lightwell.ThreeLights, "LW_THREE_"), (lightwell.OpenXrHarmonics, "LW_OPENXR_")):
            for member in kind:
                self.assertEqual(getattr(lib, prefix + member.name), member.value)
        for kind, prefix in (
            (Status, "LW_"),
            (Validity, "LW_"),
            (Units, "LW_"),
            (Derivation, "LW_"),
            (LinkState, "LW_LINK_"),
            (lightwell.Flag, "LW_FLAG_"),
        ):
            for member in kind:
                self.assertEqual(getattr(lib, prefix + member.name), member.value)
        flags = {"LW_FLAG_" + name for name in lightwell.Flag.__members__}
        self.assertEqual({name for name in dir(lib) if name.startswith("LW_FLAG_")}, flags, "no flag is left out")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
