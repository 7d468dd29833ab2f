#!/usr/bin/env python3
"""A wait ends when its condition holds, at its limit, or with an error."""
import contextlib
import io
import unittest

import harness_path  # noqa: F401
from hil.harness.waits import TimedOut, wait_for


class Waits(unittest.TestCase):
    def wait(self, *arguments, **options):
        self.said = io.StringIO()
        with contextlib.redirect_stderr(self.said):
            return wait_for(*arguments, **options)

    def test_returns_the_result(self):
        answers = iter([None, False, "here"])
        self.assertEqual(self.wait("it", lambda: next(answers), 60, every_s=0.001), "here")

    def test_zero_is_a_result(self):
        self.assertEqual(self.wait("a number", lambda: 0, 60), 0)

    def test_the_timeout_names_the_last_state(self):
        with self.assertRaisesRegex(TimedOut, "waited 0.05 s for the frame and it did not come; last seen: no light"):
            self.wait("the frame", lambda: None, 0.05, every_s=0.01, state=lambda: "no light")

    def test_prints_what_it_waits_for(self):
        with self.assertRaises(TimedOut):
            self.wait("the frame", lambda: None, 0.2, every_s=0.01, progress_period_s=0.05, state=lambda: "no light")
        self.assertIn("waiting for the frame (0 s of 0.2 s); last seen: no light", self.said.getvalue())

    def test_an_error_ends_it(self):
        def broken():
            raise ValueError("gone")

        with self.assertRaisesRegex(ValueError, "gone"):
            self.wait("it", broken, 60)


if __name__ == "__main__":
    unittest.main()
