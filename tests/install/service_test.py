#!/usr/bin/env python3
"""lightwelld as an installed service: user, sandbox, configuration.

usage: service_test.py CMAKE BUILD
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

CMAKE, BUILD = sys.argv[1], pathlib.Path(sys.argv[2])
SOURCES = pathlib.Path(__file__).resolve().parents[2] / "firmware/app/service"
# The unit's drop-in for the board of hil/image.
BOARD = SOURCES.parents[2] / "hil/image/root/etc/systemd/system/lightwelld.service.d/board.conf"


class Service(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.run_command(CMAKE, "--install", BUILD, "--component", "daemon", "--prefix", "/usr",
                         env=os.environ | {"DESTDIR": str(self.root)})
        self.unit = self.root / "usr/lib/systemd/system/lightwelld.service"

    def run_command(self, *command, env=None):
        done = subprocess.run([str(word) for word in command], env=env, text=True, check=False,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.assertEqual(done.returncode, 0, done.stdout)
        return done.stdout

    def exposure(self):
        """Fails above 2.9."""
        return self.run_command("systemd-analyze", "security", "--offline=yes", "--threshold=29", "--no-pager",
                                self.unit)

    def test_is_sandboxed(self):
        self.exposure()

    def test_is_sandboxed_on_the_board_too(self):
        folder = self.unit.with_suffix(".service.d")
        folder.mkdir()
        (folder / "board.conf").write_text(BOARD.read_text())
        self.exposure()

    def test_the_unit_is_one_that_systemd_understands(self):
        # Only the unit is verified; the systemd units that it names only have to exist.
        for name in ("sysinit.target", "basic.target", "network.target", "multi-user.target", "shutdown.target"):
            (self.unit.parent / name).write_text("[Unit]\n")
        self.assertEqual(self.run_command("systemd-analyze", "verify", "--man=no", f"--root={self.root}",
                                          "lightwelld.service"), "")

    def test_a_camera_that_comes_later_is_not_shut_out(self):
        for line in self.unit.read_text().splitlines():
            self.assertNotRegex(line, "^(DevicePolicy|DeviceAllow|PrivateDevices|ProtectClock)=")

    def test_the_program_is_named_where_it_is_installed(self):
        self.assertIn("\nExecStart=/usr/bin/lightwelld --config /etc/lightwell/probe.textproto\n",
                      self.unit.read_text())
        self.assertNotIn("@", self.unit.read_text().replace("@system-service", "").replace("@privileged", ""))

    def test_it_has_a_user_of_its_own(self):
        (self.root / "etc").mkdir()
        self.run_command("systemd-sysusers", f"--root={self.root}")
        self.assertIn("\nlightwell:x:", "\n" + (self.root / "etc/passwd").read_text())
        video = [line for line in (self.root / "etc/group").read_text().splitlines() if line.startswith("video:")]
        self.assertTrue(video and "lightwell" in video[0].split(":")[3].split(","), video)
        self.assertIn("\nUser=lightwell\n", self.unit.read_text())

    def test_an_owners_configuration_is_left_alone(self):
        given = self.root / "etc/lightwell/probe.textproto"
        self.assertEqual((self.root / "usr/share/lightwell/probe.textproto").read_bytes(),
                         (SOURCES / "probe.textproto").read_bytes())
        for text in ((SOURCES / "probe.textproto").read_text(), "# the owner's\n"):
            if given.exists():
                given.write_text(text)
            self.run_command("systemd-tmpfiles", f"--root={self.root}", "--create", "lightwell.conf")
            self.assertEqual(given.read_text(), text)

    def test_cameras_are_the_groups(self):
        rules = (self.root / "usr/lib/udev/rules.d/70-lightwelld.rules").read_text()
        for device in ("dma_heap", "03e7"):
            self.assertRegex(rules, f'"{device}".*GROUP="video", MODE="0660"')


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
