#!/usr/bin/env python3
"""The Python package against a lightwelld process: light, environment map, estimator settings, lux reading, shutdown.

usage: python_client_test.py LIGHTWELLD
"""

import math
import re
import select
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np

import lightwell
from lightwell import Error, EstimatorKind, LinkState, Setting, Status, Units, UnseenFill, Validity

LIGHTWELLD = sys.argv[1]
TIMEOUT_S = 60.0
WALL = 0.5
LAMP, LAMP_RADIUS = 200.0, math.radians(8)


def panorama(path):
    """Writes grey walls and a lamp at +X as an uncompressed Radiance image: 128 x 64, rows from the top."""
    width, height = 128, 64
    phi = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    theta = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    x = np.cos(theta)[:, None] * np.sin(phi)[None, :]
    radiance = np.where(np.arccos(x) < LAMP_RADIUS, LAMP, WALL)
    exponent = np.ceil(np.log2(radiance * 1.001))
    mantissa = np.floor(radiance / np.exp2(exponent) * 256).astype(np.uint8)
    pixels = np.stack([mantissa] * 3 + [(exponent + 128).astype(np.uint8)], axis=-1)
    path.write_bytes(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode() + pixels.tobytes())


class Daemon:
    def __init__(self, folder):
        panorama(folder / "room.hdr")
        self.process = subprocess.Popen(
            [LIGHTWELLD, "--listen", "127.0.0.1:0", "--size", "160x120", "--camera", f"sim:{folder}/room.hdr"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        ready, _, _ = select.select([self.process.stdout], [], [], TIMEOUT_S)
        line = self.process.stdout.readline() if ready else ""
        found = re.search(r"listening on (\S+)", line)
        if not found:
            self.process.kill()
            raise AssertionError(f"lightwelld did not start: {line!r} {self.process.communicate()[1]}")
        self.uri = found.group(1)

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        out, err = self.process.communicate(timeout=TIMEOUT_S)
        return self.process.returncode, out, err


class PythonClient(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="lightwell_")
        self.addCleanup(folder.cleanup)
        self.daemon = Daemon(Path(folder.name))
        self.addCleanup(self.daemon.stop)

    def until(self, probe, condition):
        """Waits for a lighting that satisfies the condition and returns it."""
        seen, end = None, time.monotonic() + TIMEOUT_S
        while time.monotonic() < end:
            light = probe.wait_for_next(seen, timeout=TIMEOUT_S)
            if condition(light):
                return light
            seen = light.info().sequence
        raise AssertionError(f"no lighting satisfied the condition within {TIMEOUT_S:g} s")

    def test_client_from_first_light_to_shutdown(self):
        with lightwell.connect(self.daemon.uri, max_age=1.0, connect_timeout=TIMEOUT_S) as probe:
            light = probe.wait_for_next(timeout=TIMEOUT_S)
            lamp = light.lights()[0]
            self.assertLess(np.degrees(np.arccos(np.clip(lamp.direction @ [1, 0, 0], -1, 1))), 1.0)
            answer = light.irradiance([[1, 0, 0], [-1, 0, 0]])
            self.assertEqual((answer.units, answer.refused), (Units.RELATIVE, 0))
            # Units are relative, so the ratio of the lamp's side to the opposite side is compared.
            full = math.pi * (WALL + (LAMP - WALL) * math.sin(LAMP_RADIUS) ** 2)
            ratio = answer.value[0] / answer.value[1] / (full / (math.pi * WALL))
            np.testing.assert_allclose(ratio, 1, atol=0.05)

            info = probe.info()
            self.assertEqual((info.name, info.version), ("lightwell", lightwell.__version__))
            # The probe's counters reach the client about every second.
            end = time.monotonic() + TIMEOUT_S
            while probe.info().frames == 0 and time.monotonic() < end:
                time.sleep(0.05)
            self.assertGreater(probe.info().frames, 0)
            # Both use the same clock, so the offset must be within its uncertainty.
            self.assertLessEqual(abs(info.clock_offset_ns), info.clock_uncertainty_ns + 1_000_000)

            self.assertIsNone(light.environment())
            initial = probe.estimator_config()
            self.assertEqual(initial.estimator, EstimatorKind.PANORAMA)
            self.assertEqual((initial.band, initial.setting), (6, Setting.BALANCED))
            probe.change_estimator(epsilon=0.02, setting="fast", unseen=UnseenFill.MIRROR)
            probe.set_estimator(environment_edge=16)
            self.assertEqual(
                probe.estimator_config(),
                replace(initial, epsilon=0.02, setting=Setting.FAST, unseen=UnseenFill.MIRROR, environment_edge=16))
            mapped = self.until(probe, lambda l: l.environment() is not None)
            self.assertEqual(mapped.environment().levels[0].radiance.shape, (16, 16, 3))
            with self.assertRaises(Error) as refused:
                probe.set_estimator(max_lights=65)
            self.assertEqual(refused.exception.status, Status.INVALID_ARGUMENT)

            factor = probe.report_lux(1234.0, [0, 3, 0])
            self.assertGreater(factor, 0)
            measured = self.until(probe, lambda l: l.info().units == Units.ABSOLUTE)
            luminance = measured.irradiance([0, 1, 0]).value @ [0.2126, 0.7152, 0.0722]
            self.assertAlmostEqual(luminance / 1234.0, 1, delta=0.02)

            code, _, err = self.daemon.stop()
            self.assertEqual(code, 0, err)
            end = time.monotonic() + TIMEOUT_S
            while probe.latest().validity != Validity.STALE and time.monotonic() < end:
                time.sleep(0.01)
            last = probe.latest()
            self.assertEqual(last.validity, Validity.STALE)
            self.assertIn("max_age", last.reason)
            self.assertGreater(last.irradiance([0, 1, 0]).value[0], 0, "the last light stays")
            self.assertNotEqual(probe.stats().state, LinkState.ENDED, "the client keeps trying to reconnect")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
