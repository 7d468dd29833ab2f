#!/usr/bin/env python3
"""QEMU's command line, and the accelerator probe, which ends whatever the guest does."""
import json
import os
import pathlib
import sys
import tempfile
import time
import unittest
import unittest.mock

import harness_path  # noqa: F401
from hil.harness import qemu
from hil.harness.image import Base


def machine(**options):
    made = {
        "program": "qemu",
        "accelerator": "tcg",
        "kernel": pathlib.Path("/k"),
        "initrd": pathlib.Path("/i"),
        "disks": (),
        "kernel_words": ("a", "b=c"),
        "network": ("-netdev", "user,id=net0"),
        "qmp": pathlib.Path("/q"),
        "serial_log": pathlib.Path("/s"),
    }
    return qemu.arguments(**(made | options))


def after(words, option):
    """All words that follow `option`."""
    return [words[index + 1] for index, word in enumerate(words) if word == option]


class Arguments(unittest.TestCase):
    def test_options_become_arguments(self):
        words = machine(cpus=3, memory_mb=512)
        self.assertEqual(after(words, "-smp"), ["3"])
        self.assertEqual(after(words, "-m"), ["512"])
        self.assertEqual(after(words, "-append"), ["a b=c"])
        self.assertEqual(after(words, "-cpu"), ["cortex-a72"])
        self.assertIn("unix:/q,server=on,wait=off", words)

    def test_a_disk_is_read_only_by_default(self):
        words = machine(disks=(qemu.Disk(pathlib.Path("/base"), "lw-base"),
                               qemu.Disk(pathlib.Path("/state"), "lw-state", writable=True)))
        drives = after(words, "-drive")
        self.assertIn("file=/base,format=raw,readonly=on", drives[0])
        self.assertIn("file=/state,format=raw,readonly=off", drives[1])
        self.assertIn("virtio-blk-pci,drive=disk1,serial=lw-state", after(words, "-device"))

    def test_an_overlay_has_the_format_qcow2(self):
        words = machine(disks=(qemu.Disk(pathlib.Path("/over.qcow2"), "x", writable=True),))
        self.assertIn("format=qcow2", after(words, "-drive")[0])

    def test_a_usb_device_reconnects_to_its_program(self):
        words = machine(usb_sockets={"cam0": pathlib.Path("/tmp/cam0.sock")})
        self.assertIn("socket,id=cam0,path=/tmp/cam0.sock,reconnect=1", after(words, "-chardev"))
        self.assertIn("usb-redir,chardev=cam0,id=cam0,bus=xhci.0", after(words, "-device"))

    def test_further_words_come_last(self):
        self.assertEqual(machine(extra=("-snapshot",))[-1], "-snapshot")

    def test_kvm_has_the_machines_own_processor(self):
        self.assertEqual(after(machine(accelerator="kvm"), "-cpu"), ["host"])


class Program(unittest.TestCase):
    def test_a_missing_program_is_reported(self):
        with unittest.mock.patch.dict(os.environ, {"PATH": "/nonexistent"}):
            with self.assertRaisesRegex(qemu.NoQemu, "qemu-system-aarch64 is not installed"):
                qemu.find()


class Probe(unittest.TestCase):
    def command(self, program):
        return [sys.executable, "-c", program]

    def test_a_guest_that_reports_its_kernel_works(self):
        self.assertTrue(qemu.boots(self.command("print('lightwell: the kernel runs')"), 60))

    def test_a_guest_that_hangs_is_ended(self):
        begin = time.monotonic()
        self.assertFalse(qemu.boots(self.command("import time; time.sleep(600)"), 0.5))
        self.assertLess(time.monotonic() - begin, 60)

    def test_a_guest_without_output_does_not_work(self):
        self.assertFalse(qemu.boots(self.command("pass"), 60))

    def test_no_such_program_does_not_work(self):
        self.assertFalse(qemu.boots(["/nonexistent/qemu"], 60))


class Accelerator(unittest.TestCase):
    def setUp(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        self.enterContext(unittest.mock.patch.dict(os.environ, {"LIGHTWELL_CACHE": folder}))
        self.cached = pathlib.Path(folder) / "board-accelerator.json"
        self.base = Base(*(pathlib.Path(folder) / name for name in ("vmlinuz", "initrd", "base.ext4")))

    def choose(self, *, machine="aarch64", kvm=True, works=True):
        with unittest.mock.patch("platform.machine", return_value=machine), \
                unittest.mock.patch("os.access", return_value=kvm), \
                unittest.mock.patch.object(qemu, "boots", return_value=works) as boots:
            return qemu.accelerator("qemu", self.base)[0], boots.call_count

    def test_another_processor_is_emulated_without_a_probe(self):
        self.assertEqual(self.choose(machine="x86_64"), ("tcg", 0))

    def test_without_dev_kvm_there_is_no_probe(self):
        self.assertEqual(self.choose(kvm=False), ("tcg", 0))

    def test_the_result_is_cached(self):
        self.assertEqual(self.choose(), ("kvm", 1))
        self.assertEqual(self.choose(), ("kvm", 0))

    def test_a_failure_is_cached_too(self):
        self.assertEqual(self.choose(works=False), ("tcg", 1))
        self.assertEqual(self.choose(works=True), ("tcg", 0))

    def test_a_reboot_of_this_machine_invalidates_the_cache(self):
        self.choose(works=False)
        cached = json.loads(self.cached.read_text())
        self.cached.write_text(json.dumps(cached | {"boot": "earlier"}))
        self.assertEqual(self.choose(works=True), ("kvm", 1))

    def test_an_invalid_cache_file_is_ignored(self):
        self.cached.write_text("{")
        self.assertEqual(self.choose(), ("kvm", 1))


if __name__ == "__main__":
    unittest.main()
