#!/usr/bin/env python3
"""Records of boards left by dead runs, and hil/board without a running board. No board is booted here."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest
import unittest.mock

import harness_path
from hil.harness import board
from hil.harness.processes import Process
from hil.harness.ssh import Ssh

NOBODY = {"pid": 2**22 + 1, "began": 1}


class Runs(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.environment = os.environ | {
            "LIGHTWELL_BOARDS": str(self.folder),
            "LIGHTWELL_CACHE": str(self.folder / "cache"),
        }
        self.enterContext(unittest.mock.patch.dict(os.environ, self.environment))

    def sleeper(self):
        """A process that stands for a running QEMU."""
        child = subprocess.Popen(["sleep", "600"])
        self.addCleanup(child.wait)
        self.addCleanup(child.kill)
        return child

    def make_board(self, name, process, owner=None):
        made = board.Board(name)
        made.folder.mkdir(parents=True)
        record = {"name": name, "pid": process["pid"], "began": process["began"], "started": time.time(),
                "accelerator": "tcg", "why": "", "cpus": 2, "memory_mb": 64, "seconds": {},
                "network": {"kind": "user", "number": 1, "ports": {"22": 1, "7420": 7}}}
        if owner:
            record["owner"] = owner
        (made.folder / "board.json").write_text(json.dumps(record))
        return made

    def of(self, child):
        process = Process.of(child.pid)
        return {"pid": process.pid, "began": process.began}


class Stale(Runs):
    def test_a_board_of_a_dead_run_is_ended(self):
        child = self.sleeper()
        made = self.make_board("a", self.of(child), owner=NOBODY)
        board.remove_stale()
        self.assertEqual(child.wait(10), -9)
        self.assertFalse(made.running())
        self.assertFalse((made.folder / "board.json").exists())

    def test_a_board_of_a_running_process_is_kept(self):
        child = self.sleeper()
        own = Process.current()
        made = self.make_board("a", self.of(child), owner={"pid": own.pid, "began": own.began})
        board.remove_stale()
        self.assertIsNone(child.poll())
        self.assertTrue(made.running())

    def test_a_board_without_an_owner_is_kept(self):
        child = self.sleeper()
        made = self.make_board("a", self.of(child))
        board.remove_stale()
        self.assertTrue(made.running())
        self.assertEqual(made.status()["grpc"], "grpc://127.0.0.1:7")

    def test_another_process_with_the_same_id_is_not_killed(self):
        child = self.sleeper()
        made = self.make_board("a", self.of(child) | {"began": 1}, owner=NOBODY)
        self.assertFalse(made.running())
        board.remove_stale()
        self.assertIsNone(child.poll())
        self.assertFalse((made.folder / "board.json").exists())

    def test_power_cut_kills(self):
        child = self.sleeper()
        made = self.make_board("a", self.of(child))
        made.power_cut()
        self.assertEqual(child.wait(10), -9)
        self.assertFalse(made.running())

    def test_boards_of_different_names_have_different_folders(self):
        self.assertNotEqual(board.Board("a").folder, board.Board("b").folder)

    def test_a_folder_that_others_may_write_is_rejected(self):
        self.folder.chmod(0o777)
        with self.assertRaisesRegex(board.BoardError, "written by others"):
            board.Board("a")

    def test_a_command_on_a_board_that_does_not_run_is_an_error(self):
        with self.assertRaisesRegex(board.BoardError, "not running"):
            board.Board("a").run("true")


class Commands(unittest.TestCase):
    def test_words_are_quoted_for_the_remote_shell(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (folder / "host.pub").write_text("ssh-ed25519 AAAA comment\n")
        ssh = Ssh(("127.0.0.1", 7), folder / "client", folder / "host", folder)
        self.assertEqual(ssh.command(["ls", "a b"])[-1], "ls 'a b'")
        self.assertEqual(ssh.command(["ls | wc"])[-1], "ls | wc")
        self.assertEqual((folder / "known_hosts").read_text(), "board ssh-ed25519 AAAA\n")


class Cli(Runs):
    def hil_board(self, *words, **environment):
        return subprocess.run(
            [sys.executable, harness_path.HIL / "board", *words],
            text=True,
            env=self.environment | environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            check=False,
        )

    def test_status_without_a_board(self):
        done = self.hil_board("status", "--json")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(json.loads(done.stdout)["running"], False)

    def test_down_without_a_board_succeeds(self):
        self.assertEqual(self.hil_board("down").returncode, 0)

    def test_ssh_without_a_board_is_an_error(self):
        done = self.hil_board("ssh", "true")
        self.assertEqual(done.returncode, 3)
        self.assertIn("not running", done.stderr)

    def test_without_qemu_it_is_skipped_with_the_reason(self):
        for verb in (("up",), ("run", "true")):
            done = self.hil_board(*verb, PATH="/nonexistent")
            self.assertEqual(done.returncode, 77, done.stderr)
            self.assertIn("SKIP: qemu-system-aarch64 is not installed", done.stderr)

    def test_wrong_usage(self):
        for words in ((), ("fly",), ("run",), ("up", "--usb", "cam0")):
            self.assertEqual(self.hil_board(*words).returncode, 2, words)

    def test_help_has_examples_and_exit_status(self):
        shown = self.hil_board("--help").stdout
        for word in ("examples:", "exit:", "hil/board up", "77"):
            self.assertIn(word, shown)


if __name__ == "__main__":
    unittest.main()
