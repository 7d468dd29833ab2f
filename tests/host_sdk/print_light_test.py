#!/usr/bin/env python3
"""The example print_light, built for another system, prints the light of a simulated probe: by WebSocket, in plain text
and with TLS, and says clearly what this SDK cannot do.

usage: print_light_test.py NATIVE_BIN [EMULATOR...] PRINT_LIGHT
NATIVE_BIN: the folder with this machine's lightwelld and lightwell. The expectation is what that lightwell prints.
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from simulated_probe import TIMEOUT_S, SimulatedProbe

NATIVE = pathlib.Path(sys.argv[1])
COMMAND = sys.argv[2:]


def wine_local_app_data():
    """LOCALAPPDATA of the Windows that Wine simulates; None without Wine."""
    prefix = [argument.partition("=")[2] for argument in COMMAND if argument.startswith("WINEPREFIX=")]
    if not prefix:
        return None
    folders = list(pathlib.Path(prefix[0]).glob("drive_c/users/*/AppData/Local"))
    return next(folder for folder in folders if "Public" not in folder.parts)


def print_light(uri, environment=None):
    return subprocess.run([*COMMAND, uri], capture_output=True, text=True, timeout=TIMEOUT_S,
                          env={**os.environ, **(environment or {})})


def numbers(line):
    return [float(word) for word in re.findall(r"-?\d+\.?\d*(?:e[-+]\d+)?", line)]


class PrintLight(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def daemon(self, *options):
        return SimulatedProbe(NATIVE, self.folder.name, *options)

    def assert_light(self, printed, uri, environment=None):
        self.assertEqual(printed.returncode, 0, printed.stderr)
        native = subprocess.run([NATIVE / "lightwell", "query", uri, "--normal", "0,1,0", "--json"], check=True,
                                capture_output=True, text=True, env={**os.environ, **(environment or {})})
        expected = json.loads(native.stdout)["rgb"]
        first, *lights = printed.stdout.splitlines()
        self.assertIn("irradiance from above", first)
        # The camera's noise differs from frame to frame.
        for got, wanted in zip(numbers(first), expected, strict=False):
            self.assertAlmostEqual(got, wanted, delta=0.01 * wanted)
        self.assertGreater(len(lights), 0)
        for line in lights:
            x, y, z = numbers(line)
            self.assertAlmostEqual(x * x + y * y + z * z, 1, delta=1e-3)

    def test_by_web_socket(self):
        with self.daemon("--web", "127.0.0.1:0") as daemon:
            (uri,) = daemon.text_after(r"(ws://[^\s]+)")
            self.assert_light(print_light(uri), uri)

    def test_with_tls_and_the_credentials_that_pairing_stored(self):
        keys = ["--web-security", "tls", "--keys", self.folder.name + "/keys"]
        # The SDK looks for credentials in XDG_CONFIG_HOME, on Windows in LOCALAPPDATA.
        if "WINEPREFIX" in "".join(COMMAND):
            print_light("ws://127.0.0.1:1")  # Makes the folders of that Windows.
        store = wine_local_app_data() or pathlib.Path(self.folder.name)
        environment = {"XDG_CONFIG_HOME": str(store)}
        with self.daemon("--web", "127.0.0.1:0", *keys) as daemon:
            (uri,) = daemon.text_after(r"(wss://[^\s]+)")
            refused = print_light(uri, environment)
            self.assertEqual(refused.returncode, 1)
            self.assertIn("pair with the probe", refused.stderr)
            web = uri.partition("://")[2]
            with tempfile.TemporaryDirectory() as pairing_folder, \
                    SimulatedProbe(NATIVE, pairing_folder, "--web", web, *keys, "--pair", "--pair-listen",
                                   "127.0.0.1:0") as pairing:
                where, code = pairing.text_after(r"pairing on (\S+) for .*code (\d{6})\n")
                subprocess.run([NATIVE / "lightwell", "pair", where, "--code", code, "--name", "desk"], check=True,
                               capture_output=True, env={**os.environ, **environment})
            self.addCleanup(lambda: subprocess.run(["rm", "-rf", str(store / "lightwell")], check=False))
            self.assert_light(print_light(uri, environment), uri, environment)

    def test_what_this_sdk_lacks_is_said_with_a_remedy(self):
        for uri, words in (("grpc://127.0.0.1:7420", "without gRPC"), ("usb:", "without libusb"),
                           ("mqtt://127.0.0.1/attic", "without MQTT")):
            refused = print_light(uri)
            self.assertEqual(refused.returncode, 1, uri)
            self.assertIn(words, refused.stderr)

    def test_a_probe_that_is_not_there_is_an_error(self):
        refused = print_light("ws://127.0.0.1:1")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("127.0.0.1:1", refused.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
