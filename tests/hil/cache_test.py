#!/usr/bin/env python3
"""Cached folders are complete, are made once, and are made anew when their inputs change."""
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import harness_path
from hil.harness import cache


class Digest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (self.folder / "a").write_text("one")
        (self.folder / "sub").mkdir()
        (self.folder / "sub/b").write_text("two")
        self.before = cache.digest([self.folder])

    def differs(self):
        return cache.digest([self.folder]) != self.before

    def test_times_do_not_count(self):
        os.utime(self.folder / "a", (1, 1))
        self.assertFalse(self.differs())

    def test_a_byte_counts(self):
        (self.folder / "sub/b").write_text("twp")
        self.assertTrue(self.differs())

    def test_a_name_counts(self):
        (self.folder / "a").rename(self.folder / "c")
        self.assertTrue(self.differs())

    def test_the_executable_bit_counts(self):
        (self.folder / "a").chmod(0o755)
        self.assertTrue(self.differs())

    def test_a_link_differs_from_its_target(self):
        (self.folder / "a").rename(self.folder / "sub/a")
        (self.folder / "a").symlink_to("sub/a")
        self.assertTrue(self.differs())

    def test_pycache_does_not_count(self):
        (self.folder / "__pycache__").mkdir()
        (self.folder / "__pycache__/a.pyc").write_text("three")
        self.assertFalse(self.differs())

    def test_texts_are_not_concatenated(self):
        self.assertNotEqual(cache.digest(["ab", "c"]), cache.digest(["a", "bc"]))


class Kept(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.made = 0

    def make(self, folder):
        self.made += 1
        (folder / "file").write_text("content")

    def test_the_second_call_reuses_the_folder(self):
        first = cache.kept("thing", "1", self.make, self.root)
        self.assertEqual(cache.kept("thing", "1", self.make, self.root), first)
        self.assertEqual(self.made, 1)
        self.assertEqual((first / "file").read_text(), "content")

    def test_another_key_is_another_folder(self):
        cache.kept("thing", "1", self.make, self.root)
        cache.kept("thing", "2", self.make, self.root)
        self.assertEqual(self.made, 2)

    def test_a_failed_generator_leaves_no_folder(self):
        def fail(folder):
            (folder / "half").write_text("")
            raise RuntimeError("no")

        with self.assertRaises(RuntimeError):
            cache.kept("thing", "1", fail, self.root)
        self.assertEqual([path.name for path in self.root.iterdir()], [".thing.lock"])
        cache.kept("thing", "1", self.make, self.root)
        self.assertEqual(self.made, 1)

    def test_a_killed_generator_leaves_no_valid_folder(self):
        program = (
            "import sys, pathlib, time; sys.path.insert(0, sys.argv[1]); from hil.harness import cache\n"
            "def make(folder):\n    (folder / 'half').write_text('')\n    print('half', flush=True)\n    "
            "time.sleep(600)\n"
            "cache.kept('thing', '1', make, pathlib.Path(sys.argv[2]))"
        )
        child = subprocess.Popen(
            [sys.executable, "-c", program, str(harness_path.ROOT), str(self.root)], stdout=subprocess.PIPE
        )
        self.assertEqual(child.stdout.readline(), b"half\n")
        child.send_signal(signal.SIGKILL)
        child.wait()
        child.stdout.close()
        folder = cache.kept("thing", "1", self.make, self.root)
        self.assertEqual([path.name for path in folder.iterdir()], ["file"])
        self.assertEqual(sorted(path.name for path in self.root.iterdir()), [".thing.lock", "thing-1"])

    def test_concurrent_calls_make_it_once(self):
        def slowly(folder):
            time.sleep(0.3)
            self.make(folder)

        threads = [threading.Thread(target=cache.kept, args=("thing", "1", slowly, self.root)) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(self.made, 1)

    def test_the_most_recently_used_are_kept(self):
        for key in range(cache.MOST_KEPT + 2):
            folder = cache.kept("thing", str(key), self.make, self.root)
            os.utime(folder, (time.time() - 1000 + key,) * 2)
        cache.kept("thing", "new", self.make, self.root)
        left = sorted(path.name for path in self.root.glob("thing-*"))
        self.assertEqual(left, sorted(["thing-new", *(f"thing-{key}" for key in range(3, cache.MOST_KEPT + 2))]))


if __name__ == "__main__":
    unittest.main()
