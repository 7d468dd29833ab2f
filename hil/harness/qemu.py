"""QEMU: whether it is here, what may drive its processor, and its command line.

find()          the program, or why there is none
accelerator()   kvm where a guest was seen to run in it, else tcg
Machine         what a board is made of; arguments() is its command line
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from . import cache
from .image import Base
from .waits import say

PROGRAM = "qemu-system-aarch64"
PROBE_S = 10.0
CONSOLE = "console=ttyAMA0"


class NoQemu(Exception):
    """A board cannot run on this machine at all: tests are skipped with this reason."""


def find() -> str:
    """Full path of QEMU for arm64 boards."""
    path = shutil.which(PROGRAM)
    if path is None:
        raise NoQemu(f"{PROGRAM} is not installed (Debian's qemu-system-arm; cmake/setup installs it)")
    return path


def acceleration(name: str) -> list[str]:
    """QEMU's words for an accelerator. The processor is that of the smallest supported board where it is emulated."""
    if name == "kvm":
        return ["-machine", "virt,gic-version=host", "-accel", "kvm", "-cpu", "host"]
    return ["-machine", "virt", "-accel", "tcg,thread=multi", "-cpu", "cortex-a72"]


def boots(command: Sequence[str], timeout_s: float) -> bool:
    """Whether the board of `command` says within `timeout_s` that its kernel runs; it is killed then."""
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              timeout=timeout_s, check=False)
    except (subprocess.TimeoutExpired, OSError):
        return False
    return b"lightwell: the kernel runs" in done.stdout


def probe_command(program: str, base: Base, name: str) -> list[str]:
    """The smallest board there is: a kernel and the initrd, which says a word and switches off."""
    return [
        program,
        *acceleration(name),
        "-smp",
        "1",
        "-m",
        "256",
        "-nodefaults",
        "-display",
        "none",
        "-serial",
        "stdio",
        "-no-reboot",
        "-kernel",
        str(base.kernel),
        "-initrd",
        str(base.initrd),
        "-append",
        f"{CONSOLE} quiet panic=-1 lightwell.probe",
    ]


def accelerator(program: str, base: Base) -> tuple[str, str]:
    """("kvm" or "tcg", why). /dev/kvm may open and its guests hang, so one is booted within 10 s; what came of it is
    kept until this machine boots again."""
    if platform.machine() != "aarch64":
        return "tcg", f"a processor of {platform.machine()} cannot run arm64 by KVM"
    if not os.access("/dev/kvm", os.R_OK | os.W_OK):
        return "tcg", "/dev/kvm cannot be opened"
    boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    told = cache.cache_root() / "board-accelerator.json"
    try:
        known = json.loads(told.read_text(encoding="utf-8"))
        if known["boot"] == boot:
            return known["name"], known["why"]
    except (OSError, ValueError, KeyError):
        pass  # Not asked before, or by another version: it is asked now.
    say(f"trying KVM, for {PROBE_S:g} s at most")
    works = boots(probe_command(program, base, "kvm"), PROBE_S)
    name, why = ("kvm", "a guest ran in it") if works else ("tcg", f"no guest ran in KVM within {PROBE_S:g} s")
    written = told.with_suffix(f".{os.getpid()}")
    written.write_text(json.dumps({"boot": boot, "name": name, "why": why}), encoding="utf-8")
    written.rename(told)
    return name, why


@dataclass(frozen=True)
class Disk:
    """A file that the board sees as a virtio disk with that serial number."""
    path: Path
    serial: str
    writable: bool = False


@dataclass(frozen=True)
class Machine:
    """A board's hardware. All paths are this machine's."""
    program: str
    accelerator: str
    kernel: Path
    initrd: Path
    disks: tuple[Disk, ...]
    kernel_words: tuple[str, ...]
    network: tuple[str, ...]
    qmp: Path
    serial_log: Path
    cpus: int = 2
    memory_mb: int = 2048
    # Sockets of USB devices' programs, by their ids (usb-redir); one that does not listen yet is plugged in when it
    # does.
    usb_sockets: tuple[tuple[str, Path], ...] = ()
    extra: tuple[str, ...] = ()

    def arguments(self) -> list[str]:
        words = [self.program, *acceleration(self.accelerator), "-smp", str(self.cpus), "-m", str(self.memory_mb),
                 "-nodefaults", "-display", "none",
                 # A board that is started again goes on writing where it was.
                 "-chardev", f"file,id=serial,path={self.serial_log},append=on", "-serial", "chardev:serial",
                 "-qmp", f"unix:{self.qmp},server=on,wait=off",
                 "-kernel", str(self.kernel), "-initrd", str(self.initrd), "-append", " ".join(self.kernel_words),
                 "-device", "virtio-rng-pci", "-device", "qemu-xhci,id=xhci"]
        for index, disk in enumerate(self.disks):
            # Told, not probed: what a board writes into the first block of a raw disk must not make it another format.
            kind = "qcow2" if disk.path.suffix == ".qcow2" else "raw"
            access = "off" if disk.writable else "on"
            words += ["-drive", f"if=none,id=disk{index},file={disk.path},format={kind},readonly={access}",
                      "-device", f"virtio-blk-pci,drive=disk{index},serial={disk.serial}"]
        words += self.network
        for name, path in self.usb_sockets:
            words += ["-chardev", f"socket,id={name},path={path},reconnect=1",
                      "-device", f"usb-redir,chardev={name},id={name},bus=xhci.0"]
        return [*words, *self.extra]
