#!/usr/bin/env python3
"""Boots an emulated board, tests it and shuts it down: boot_test.py HOST_CLI BUILD_OF_THE_BOARD.

Exits with 77 and the reason if QEMU or the board's firmware is missing. Times are printed, without limits.
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import unittest

import harness_path  # noqa: F401
import skipping
from hil.harness import board, image, qemu
from hil.harness.waits import wait_for

CLI, BUILD = sys.argv[1], pathlib.Path(sys.argv[2])
NAME = f"boot-test-{os.getpid()}"


def missing():
    try:
        qemu.find()
    except qemu.NoQemu as error:
        return str(error)
    programs = [BUILD / "bin" / name for name in ("lightwelld", "lightwell", "lightwell-calibrate")]
    if absent := [str(program) for program in programs if not program.exists()]:
        return f"not built for the board: {', '.join(absent)} (hil/board up builds them)"
    # Making it needs the network and minutes, so a test does not.
    if not os.environ.get("LIGHTWELL_SYSROOT_AARCH64") and subprocess.run(
            [image.REPOSITORY / "cmake/sysroot_aarch64", "--find"], stdout=subprocess.DEVNULL, check=False).returncode:
        return "there is no arm64 sysroot (cmake/sysroot_aarch64 makes it)"
    return None


class Boot(unittest.TestCase):
    """The tests share one board. They run in the order of their names, which the letters determine."""

    @classmethod
    def setUpClass(cls):
        cls.board = board.Board(NAME, board.Options(build=BUILD, state_mb=32, owned=True))
        cls.addClassCleanup(cls.board.remove)
        begin = time.monotonic()
        cls.board.start(fresh=True)
        status = cls.board.status()
        print(
            f"{status['accelerator']} ({status['why']}): ssh {status['seconds']['ssh']} s after QEMU, "
            f"{time.monotonic() - begin:.1f} s after being asked; {status['resident_mb']} MB of this machine's memory",
            flush=True,
        )

    def out(self, command, **options):
        return self.board.run(command, check=True, **options).out.strip()

    def probe(self):
        """Output of `lightwell info`, run on this machine."""
        return subprocess.run(
            self.board.host_command([CLI, "info", self.board.grpc()]),
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            timeout=120,
            check=False,
        )

    def test_a_it_is_another_machine(self):
        self.assertEqual(self.out("uname -m"), "aarch64")
        self.assertEqual(self.out("hostname"), NAME)

    def test_b_the_firmware_answers_from_outside(self):
        print(f"lightwelld ready {self.board.wait_for_service():.1f} s after the kernel's start", flush=True)
        done = self.probe()
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertRegex(done.stdout, r"name +board ")
        self.assertRegex(done.stdout, r"camera +sim:studio")
        self.assertEqual(self.out("stat -c %U /proc/$(systemctl show -P MainPID lightwelld)"), "lightwell")

    def test_bb_the_watchdog_is_notified(self):
        self.assertEqual(self.out("systemctl show -P WatchdogUSec lightwelld"), "30s")
        ask = "systemctl show -P WatchdogTimestampMonotonic lightwelld"
        first = int(self.out(ask))
        self.assertGreater(first, 0)
        wait_for("the next notification of the watchdog", lambda: int(self.out(ask)) > first, 60)

    def test_c_nothing_failed(self):
        done = self.board.run("systemctl is-system-running --wait", timeout_s=180)
        why = self.board.run("systemctl --failed --no-legend; journalctl -p err -b --no-pager").out
        self.assertEqual(done.out.strip(), "running", why)

    def test_ca_the_firmware_is_that_of_its_packages(self):
        form = "${Package} ${Architecture} ${db:Status-Status}\\n"
        self.assertEqual(self.out(f"dpkg-query -W -f '{form}'").splitlines(),
                         [f"{name} arm64 unpacked" for name in ("liblightwell1", "lightwell-tools", "lightwelld")])
        # The package's own files; the configuration is the board's.
        self.assertEqual(self.out("dpkg --verify | grep -v ' c /etc/' || true"), "")
        self.assertEqual(self.out("readlink /proc/$(systemctl show -P MainPID lightwelld)/exe"), "/usr/bin/lightwelld")

    def test_d_exit_status_arguments_and_input_are_passed(self):
        self.assertEqual(self.board.run("exit 7").status, 7)
        self.assertEqual(self.board.run(["printf", "%s|", "a b", "$c"]).out, "a b|$c|")
        self.assertEqual(self.board.run("cat", text="what goes in").out, "what goes in")
        with self.assertRaises(TimeoutError):
            self.board.run("sleep 60", timeout_s=2)

    def test_e_files_are_copied_in_and_out(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "in").mkdir()
            (folder / "in/data").write_bytes(os.urandom(300_000))
            self.board.copy_in(folder / "in", "/tmp/in")
            self.board.copy_out("/tmp/in/data", folder / "out")
            self.assertEqual((folder / "out").read_bytes(), (folder / "in/data").read_bytes())

    def test_f_disks_are_mounted_with_the_right_modes_and_owners(self):
        self.assertEqual(self.out("findmnt -no FSTYPE /"), "overlay")
        self.assertEqual(self.out("findmnt -no FSTYPE /var/lib/lightwell"), "ext4")
        self.assertEqual(self.out("stat -c %U /etc/lightwell/probe.textproto"), "lightwell")

    def test_g_a_killed_daemon_is_restarted(self):
        before = self.out("systemctl show -P MainPID lightwelld")
        self.out("kill -9 " + before)
        wait_for("systemd to start it again", lambda: self.out("systemctl show -P NRestarts lightwelld") == "1", 60)
        self.board.wait_for_service()
        after = self.out("systemctl show -P MainPID lightwelld")
        self.assertNotEqual(before, after)

    def test_h_the_accelerator_probe_detects_a_running_kernel(self):
        command = qemu.probe_command(qemu.find(), image.base(), "tcg")
        self.assertTrue(qemu.boots(command, 120))
        self.assertFalse(qemu.boots([word.replace("lightwell.probe", "") for word in command], 5),
                         "reported without lightwell.probe")

    def test_h_qemu_answers(self):
        self.assertEqual(self.board.qmp("query-status")["status"], "running")

    def test_i_a_power_cut_keeps_only_the_state_disk(self):
        self.out("echo kept > /var/lib/lightwell/kept; sync; echo gone > /root/gone")
        self.board.power_cut()
        self.assertFalse(self.board.running())
        self.board.start()
        self.assertEqual(self.out("cat /var/lib/lightwell/kept"), "kept")
        self.assertNotEqual(self.board.run("test -e /root/gone").status, 0)
        self.board.wait_for_service()
        self.assertEqual(self.probe().returncode, 0)

    def test_j_the_board_shuts_down_cleanly(self):
        begin = time.monotonic()
        self.assertTrue(self.board.stop(), "the board had to be killed")
        print(f"off {time.monotonic() - begin:.1f} s after being asked", flush=True)
        self.assertFalse(self.board.running())
        # The state disk was unmounted cleanly and needs no repair.
        subprocess.run(["e2fsck", "-fn", self.board.state_disk], check=True, stdout=subprocess.DEVNULL)
        self.assertNotIn(
            "needs_recovery",
            subprocess.run(
                ["dumpe2fs", "-h", self.board.state_disk],
                check=True,
                text=True,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
            ).stdout,
        )


if __name__ == "__main__":
    skipping.main(missing(), [sys.argv[0], "--verbose", "--failfast"])
