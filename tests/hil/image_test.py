#!/usr/bin/env python3
"""Content of a board's disks: accounts, units and file systems."""
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import harness_path  # noqa: F401
from hil.harness import image


class Tree(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def write(self, name, text=""):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path


class Accounts(Tree):
    def setUp(self):
        super().setUp()
        self.write("usr/share/base-passwd/passwd.master", "root:*:0:0:root:/root:/bin/bash\n")
        self.write("usr/share/base-passwd/group.master", "root:*:0:\nvideo:*:44:\n")

    def add(self, text):
        image.add_accounts(self.root, self.write("accounts", text))

    def test_users_groups_and_members(self):
        self.add("probe 910 /var/lib/probe video  # why\nnetdev 925 -\n")
        self.assertIn("probe:x:910:910::/var/lib/probe:/usr/sbin/nologin\n", (self.root / "etc/passwd").read_text())
        self.assertNotIn("netdev", (self.root / "etc/passwd").read_text())
        group = (self.root / "etc/group").read_text()
        for line in ("video:*:44:probe\n", "probe:x:910:\n", "netdev:x:925:\n"):
            self.assertIn(line, group)

    def test_accounts_are_not_locked_and_have_no_password(self):
        self.add("")
        self.assertEqual((self.root / "etc/shadow").read_text(), "root:*:19000:0:99999:7:::\n")

    def test_an_unknown_group_is_an_error(self):
        with self.assertRaisesRegex(image.ImageError, "no group vidoe"):
            self.add("probe 910 / vidoe\n")


class Units(Tree):
    def setUp(self):
        super().setUp()
        self.write("usr/lib/systemd/system/ssh.service")
        self.write("etc/systemd/system/own.service")
        self.write("usr/lib/systemd/system-generators/some-generator")

    def set(self, text):
        image.set_units(self.root, self.write("units", text))

    def link(self, name):
        return (self.root / "etc/systemd" / name).readlink()

    def test_links_are_those_of_systemctl(self):
        self.set("enable ssh.service multi-user.target\nenable own.service sysinit.target\nmask ssh.service\n"
                 "silence some-generator\n")
        self.assertEqual(
            str(self.link("system/multi-user.target.wants/ssh.service")), "/usr/lib/systemd/system/ssh.service"
        )
        self.assertEqual(str(self.link("system/sysinit.target.wants/own.service")), "/etc/systemd/system/own.service")
        self.assertEqual(str(self.link("system/ssh.service")), "/dev/null")
        self.assertEqual(str(self.link("system-generators/some-generator")), "/dev/null")
        self.assertEqual(self.link("system/default.target").name, "multi-user.target")

    def test_misspelt_names_are_errors(self):
        for line in ("enable shh.service multi-user.target", "mask shh.service", "silence other", "start ssh.service",
                     "enable ssh.service"):
            with self.subTest(line), self.assertRaises(image.ImageError):
                self.set(line)


class Sources(unittest.TestCase):
    def test_the_files_of_the_repository_exist(self):
        for name in ("accounts", "units", "modules", "probe.textproto", "initrd_init", "root/etc/fstab"):
            self.assertTrue((image.SOURCES / name).stat().st_size, name)

    def test_account_numbers_are_unique(self):
        numbers = [line[1] for line in image._lines(image.SOURCES / "accounts")]
        self.assertEqual(len(numbers), len(set(numbers)))

    def test_the_initrd_is_a_script_that_a_shell_can_read(self):
        subprocess.run(["sh", "-n", image.SOURCES / "initrd_init"], check=True)


class Disks(Tree):
    def debugfs(self, disk, command):
        return subprocess.run(
            ["debugfs", "-R", command, disk], text=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True
        ).stdout

    def sound(self, disk):
        subprocess.run(["e2fsck", "-fn", disk], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def test_has_the_content_of_the_tree(self):
        self.write("tree/bin/program", "x" * 100_000).chmod(0o755)
        self.write("tree/deep/er/file", "text")
        (self.root / "tree/link").symlink_to("deep")
        disk = self.root / "disk"
        image.make_ext4(self.root / "tree", disk, "lw-test", journal=False, room_mb=1)
        self.sound(disk)
        self.assertEqual(self.debugfs(disk, "cat /deep/er/file"), "text")
        self.assertIn("lw-test", self.debugfs(disk, "show_super_stats -h"))
        self.assertNotIn("has_journal", self.debugfs(disk, "show_super_stats -h"))
        shown = self.debugfs(disk, "stat /bin/program")
        self.assertRegex(shown, r"Mode:\s+0755")
        self.assertRegex(shown, r"User:\s+0\s+Group:\s+0")

    def test_hard_links_are_counted_once(self):
        big = self.write("tree/a", "x" * 20_000_000)
        for name in "bcde":
            (self.root / f"tree/{name}").hardlink_to(big)
        image.make_ext4(self.root / "tree", self.root / "disk", "lw-test", journal=False, room_mb=1)
        self.assertLess((self.root / "disk").stat().st_size, 40_000_000)

    def test_state_has_a_journal_free_space_and_the_configuration(self):
        disk = self.root / "state"
        image.state(disk, 16, "probe_name: \"x\"\n")
        self.sound(disk)
        stats = self.debugfs(disk, "show_super_stats -h")
        self.assertIn("has_journal", stats)
        self.assertEqual(self.debugfs(disk, "cat /etc/probe.textproto"), "probe_name: \"x\"\n")
        numbers = dict(line.split(":", 1) for line in stats.splitlines() if ":" in line)
        free_mb = int(numbers["Free blocks"]) * int(numbers["Block size"]) / 2**20
        self.assertGreater(free_mb, 12)
        self.assertLess(free_mb, 24)

    def test_the_error_for_a_missing_build_says_what_to_do(self):
        with self.assertRaisesRegex(image.ImageError, "cmake --preset board-aarch64"):
            image.firmware(self.root / "nowhere")


if __name__ == "__main__":
    for tool in ("mke2fs", "debugfs", "e2fsck"):
        assert shutil.which(tool), f"{tool} is not installed: run cmake/setup"
    unittest.main()
