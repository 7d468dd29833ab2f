#!/usr/bin/env python3
"""tests/measure/count_instructions on a program whose count is known: count_instructions_test.py KNOWN_COUNT
SYSROOT."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

COUNT = pathlib.Path(__file__).resolve().parents[1] / "measure/count_instructions"
ROUND = 1 + 1000 * 3 + 2  # As known_count.cpp's assembler says.
PROGRAM, SYSROOT = sys.argv[1:3]


def count(*arguments):
    return subprocess.run([COUNT, "--json", "--sysroot", SYSROOT, *arguments], text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE)


class CountInstructions(unittest.TestCase):
    def measure(self, *arguments):
        done = count(*arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_one_thread_is_counted_exactly(self):
        result = self.measure("--work", "20", "40", PROGRAM, "{}", "1")
        self.assertEqual(result["per_unit"], ROUND)
        self.assertEqual(result["work"], [20, 40])
        # Start-up is in the runs, and is not in the difference.
        self.assertGreater(result["instructions"][0], 20 * ROUND)

    def test_every_thread_is_counted(self):
        # Whether a thread waits for another, and so its instructions, differs from run to run: some
        # thousands, of 4.8 million.
        result = self.measure("--work", "200", "600", PROGRAM, "{}", "4")
        self.assertAlmostEqual(result["per_unit"] / (4 * ROUND), 1, delta=0.01)

    def test_repeated_tells_the_spread(self):
        result = self.measure("--repeat", "3", "--work", "20", "40", PROGRAM, "{}", "1")
        self.assertEqual(result["per_unit"], ROUND)
        self.assertEqual(result["spread"], 0)

    def test_without_a_place_for_the_work_it_refuses(self):
        self.assertEqual(count("--work", "20", "40", PROGRAM, "1", "1").returncode, 2)

    def test_work_that_does_not_grow_is_refused(self):
        self.assertEqual(count("--work", "40", "40", PROGRAM, "{}", "1").returncode, 2)

    def test_a_program_that_fails_is_not_a_count(self):
        done = count("--work", "20", "40", PROGRAM, "{}")
        self.assertEqual((done.returncode, done.stdout), (4, ""))
        self.assertIn("exit status 2", done.stderr)

    def test_a_program_that_is_not_for_aarch64_is_not_a_count(self):
        with tempfile.NamedTemporaryFile("w", suffix=".sh") as script:
            script.write("#!/bin/sh\n")
            script.flush()
            pathlib.Path(script.name).chmod(0o755)
            self.assertEqual(count("--work", "20", "40", script.name, "{}").returncode, 4)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
