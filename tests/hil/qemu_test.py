#!/usr/bin/env python3
"""QEMU's command line, and a probe of accelerators that ends whatever the guest does."""
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
    return qemu.Machine(**(made | options)).arguments()


def after(words, option):
    """All words that follow `option`."""
    return [words[index + 1] for index, word in enumerate(words) if word == option]


class Arguments(unittest.TestCase):
    def test_what_is_asked_for_is_there(self):
        words = machine(cpus=3, memory_mb=512)
        self.assertEqual(after(words, "-smp"), ["3"])
        self.assertEqual(after(words, "-m"), ["512"])
        self.assertEqual(after(words, "-append"), ["a b=c"])
        self.assertEqual(after(words, "-cpu"), ["cortex-a72"])
        self.assertIn("unix:/q,server=on,wait=off", words)

    def test_a_disk_is_read_only_unless_it_is_said(self):
        words = machine(disks=(qemu.Disk(pathlib.Path("/base"), "lw-base"),
                               qemu.Disk(pathlib.Path("/state"), "lw-state", writable=True)))
        drives = after(words, "-drive")
        self.assertIn("file=/base,format=raw,readonly=on", drives[0])
        self.assertIn("file=/state,format=raw,readonly=off", drives[1])
        self.assertIn("virtio-blk-pci,drive=disk1,serial=lw-state", after(words, "-device"))

    def test_an_overlay_is_read_as_one(self):
        words = machine(disks=(qemu.Disk(pathlib.Path("/over.qcow2"), "x", writable=True),))
        self.assertIn("format=qcow2", after(words, "-drive")[0])

    def test_a_usb_device_comes_whenever_its_program_listens(self):
        words = machine(usb_sockets=(("cam0", pathlib.Path("/tmp/cam0.sock")),))
        self.assertIn("socket,id=cam0,path=/tmp/cam0.sock,reconnect=1", after(words, "-chardev"))
        self.assertIn("usb-redir,chardev=cam0,id=cam0,bus=xhci.0", after(words, "-device"))

    def test_further_words_come_last(self):
        self.assertEqual(machine(extra=("-snapshot",))[-1], "-snapshot")

    def test_kvm_has_the_machines_own_processor(self):
        self.assertEqual(after(machine(accelerator="kvm"), "-cpu"), ["host"])


class Program(unittest.TestCase):
    def test_missing_is_a_reason(self):
        with unittest.mock.patch.dict(os.environ, {"PATH": "/nonexistent"}):
            with self.assertRaisesRegex(qemu.NoQemu, "qemu-system-aarch64 is not installed"):
                qemu.find()


class Probe(unittest.TestCase):
    def command(self, program):
        return [sys.executable, "-c", program]

    def test_a_kernel_that_speaks_works(self):
        self.assertTrue(qemu.boots(self.command("print('lightwell: the kernel runs')"), 60))

    def test_a_guest_that_hangs_is_ended(self):
        begin = time.monotonic()
        self.assertFalse(qemu.boots(self.command("import time; time.sleep(600)"), 0.5))
        self.assertLess(time.monotonic() - begin, 60)

    def test_a_guest_that_says_nothing_does_not_work(self):
        self.assertFalse(qemu.boots(self.command("pass"), 60))

    def test_no_such_program_does_not_work(self):
        self.assertFalse(qemu.boots(["/nonexistent/qemu"], 60))


class Accelerator(unittest.TestCase):
    def setUp(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        self.enterContext(unittest.mock.patch.dict(os.environ, {"LIGHTWELL_CACHE": folder}))
        self.told = pathlib.Path(folder) / "board-accelerator.json"
        self.base = Base(pathlib.Path(folder))

    def ask(self, *, machine="aarch64", kvm=True, works=True):
        with unittest.mock.patch("platform.machine", return_value=machine), \
                unittest.mock.patch("os.access", return_value=kvm), \
                unittest.mock.patch.object(qemu, "boots", return_value=works) as boots:
            return qemu.accelerator("qemu", self.base)[0], boots.call_count

    def test_another_processor_is_emulated_without_asking(self):
        self.assertEqual(self.ask(machine="x86_64"), ("tcg", 0))

    def test_no_device_is_not_asked(self):
        self.assertEqual(self.ask(kvm=False), ("tcg", 0))

    def test_is_asked_once(self):
        self.assertEqual(self.ask(), ("kvm", 1))
        self.assertEqual(self.ask(), ("kvm", 0))

    def test_a_guest_that_hangs_is_remembered_too(self):
        self.assertEqual(self.ask(works=False), ("tcg", 1))
        self.assertEqual(self.ask(works=True), ("tcg", 0))

    def test_another_boot_of_this_machine_is_asked_again(self):
        self.ask(works=False)
        told = json.loads(self.told.read_text())
        self.told.write_text(json.dumps(told | {"boot": "earlier"}))
        self.assertEqual(self.ask(works=True), ("kvm", 1))

    def test_nonsense_on_disk_is_asked_again(self):
        self.told.write_text("{")
        self.assertEqual(self.ask(), ("kvm", 1))


if __name__ == "__main__":
    unittest.main()
