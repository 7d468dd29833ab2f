#!/usr/bin/env python3
"""Tests cmake/setup and cmake/packages.txt against the help and the leading comment. usage: packages.py --root DIR"""

import argparse
import re
import subprocess
import sys
import unittest
from pathlib import Path

DEMO_LIMIT = 20


class Packages(unittest.TestCase):
    root: Path

    def setup(self, *arguments: str) -> subprocess.CompletedProcess:
        return subprocess.run([self.root / "cmake/setup", *arguments], capture_output=True, text=True, check=False)

    def names(self, *purpose: str) -> set[str]:
        done = self.setup(*purpose, "--list")
        self.assertEqual(done.returncode, 0, done.stderr)
        names = done.stdout.split()
        self.assertEqual(len(names), len(set(names)), "a package is listed twice")
        return set(names)

    def test_the_demo_needs_few_packages(self) -> None:
        self.assertLessEqual(len(self.names("demo")), DEMO_LIMIT)
        self.assertIn("build-essential", self.names("demo"))

    def test_the_demo_of_a_plane_needs_tags_as_well(self) -> None:
        self.assertEqual(self.names("specular") - self.names("demo"), {"libapriltag-dev", "libceres-dev"})
        self.assertLess(self.names("demo"), self.names("specular"))

    def test_the_whole_list_is_the_union_of_all_purposes(self) -> None:
        demo, tests, board = self.names("demo"), self.names("tests"), self.names("board")
        windows = self.names("windows")
        self.assertEqual(self.names(), demo | tests | board | windows)
        for purpose in (demo, tests, board, windows):
            self.assertLess(purpose, self.names())
        self.assertIn("qemu-system-arm", board - tests)
        self.assertIn("clang-format", tests - board)

    def test_marks_are_known(self) -> None:
        for number, line in enumerate((self.root / "cmake/packages.txt").read_text(encoding="utf-8").splitlines(), 1):
            marks = line.split("#")[0].split()[1:]
            self.assertRegex(" ".join(marks), r"^((board|guest|amd64)( |$))?(for:d?t?b?s?w?)?$",
                             f"line {number}: {line}")
            self.assertFalse("guest" in marks and len(marks) > 1, f"line {number}: a guest is not for this machine")

    def test_usage(self) -> None:
        for wrong in (("demon",), ("--demo",), ("demo", "tests"), ("demo", "--list", "--check")):
            done = self.setup(*wrong)
            self.assertEqual(done.returncode, 2, wrong)
            self.assertRegex(done.stderr, re.escape("usage: cmake/setup [demo | specular | tests | board | windows]"))
        self.assertEqual(self.setup("board", "--help").returncode, 0)

    def test_missing_packages_are_part_of_the_list(self) -> None:
        done = self.setup("demo", "--check")
        self.assertIn(done.returncode, (0, 1), done.stderr)
        self.assertLessEqual(set(done.stdout.split()), self.names("demo"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--root", type=Path, required=True)
    arguments, rest = parser.parse_known_args()
    Packages.root = arguments.root
    unittest.main(argv=[sys.argv[0], *rest])
