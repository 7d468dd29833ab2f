"""QEMU: whether it is installed, which accelerator works, its command line, and its machine protocol (QMP): one
connection at a time, JSON lines (QEMU 7.2, docs/interop/qmp-spec.txt)."""

from __future__ import annotations

import json
import os
import platform
import shutil
import socket
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import cache
from .image import Base
from .waits import say

PROGRAM = "qemu-system-aarch64"
PROBE_S = 10.0
CONSOLE = "console=ttyAMA0"


class NoQemu(Exception):
    """QEMU is missing, so no board can run on this machine; tests are skipped with this reason."""


def find() -> str:
    """Full path of QEMU for arm64. Raises NoQemu."""
    path = shutil.which(PROGRAM)
    if path is None:
        raise NoQemu(f"{PROGRAM} is not installed: run cmake/setup (Debian's package qemu-system-arm)")
    return path


def acceleration(name: str) -> list[str]:
    """QEMU's arguments for an accelerator. An emulated processor is that of the smallest supported board."""
    if name == "kvm":
        return ["-machine", "virt,gic-version=host", "-accel", "kvm", "-cpu", "host"]
    return ["-machine", "virt", "-accel", "tcg,thread=multi", "-cpu", "cortex-a72"]


def boots(command: Sequence[str], timeout_s: float) -> bool:
    """Whether the guest that `command` starts reports within `timeout_s` that its kernel runs. It is killed
    afterwards."""
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              timeout=timeout_s, check=False)
    except (subprocess.TimeoutExpired, OSError):
        return False
    return b"lightwell: the kernel runs" in done.stdout


def probe_command(program: str, base: Base, name: str) -> list[str]:
    """Command of a minimal guest: kernel and initrd, which prints one line and powers off."""
    return [program, *acceleration(name), "-smp", "1", "-m", "256", "-nodefaults", "-display", "none",
            "-serial", "stdio", "-no-reboot", "-kernel", str(base.kernel), "-initrd", str(base.initrd),
            "-append", f"{CONSOLE} quiet panic=-1 lightwell.probe"]


def accelerator(program: str, base: Base) -> tuple[str, str]:
    """("kvm" or "tcg", reason). Guests may hang although /dev/kvm can be opened, so a minimal guest is booted, with a
    limit of 10 s. The result is cached until this machine reboots."""
    if platform.machine() != "aarch64":
        return "tcg", f"a processor of {platform.machine()} cannot run arm64 with KVM"
    if not os.access("/dev/kvm", os.R_OK | os.W_OK):
        return "tcg", "/dev/kvm cannot be opened"
    boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    cached = cache.cache_root() / "board-accelerator.json"
    try:
        known = json.loads(cached.read_text(encoding="utf-8"))
        if known["boot"] == boot:
            return known["name"], known["why"]
    except (OSError, ValueError, KeyError):
        pass  # No valid cached result.
    say(f"trying KVM, for {PROBE_S:g} s at most")
    works = boots(probe_command(program, base, "kvm"), PROBE_S)
    name, why = ("kvm", "a guest ran in it") if works else ("tcg", f"no guest ran in KVM within {PROBE_S:g} s")
    written = cached.with_suffix(f".{os.getpid()}")
    written.write_text(json.dumps({"boot": boot, "name": name, "why": why}), encoding="utf-8")
    written.rename(cached)
    return name, why


@dataclass(frozen=True)
class Disk:
    """A file that the board has as a virtio disk with that serial number."""
    path: Path
    serial: str
    writable: bool = False


def arguments(program: str, accelerator: str, *, kernel: Path, initrd: Path, disks: Sequence[Disk],
              kernel_words: Sequence[str], network: Sequence[str], qmp: Path, serial_log: Path, cpus: int = 2,
              memory_mb: int = 2048, usb_sockets: Mapping[str, Path] | None = None,
              extra: Sequence[str] = ()) -> list[str]:
    """The command line of a board. All paths are paths on this machine. `usb_sockets`: usb-redir sockets of programs
    that emulate USB devices, by device id. A device is plugged in when its program starts to listen."""
    words = [program, *acceleration(accelerator), "-smp", str(cpus), "-m", str(memory_mb),
             "-nodefaults", "-display", "none",
             # A board that is started again appends to its log.
             "-chardev", f"file,id=serial,path={serial_log},append=on", "-serial", "chardev:serial",
             "-qmp", f"unix:{qmp},server=on,wait=off",
             "-kernel", str(kernel), "-initrd", str(initrd), "-append", " ".join(kernel_words),
             "-device", "virtio-rng-pci", "-device", "qemu-xhci,id=xhci"]
    for index, disk in enumerate(disks):
        # The format is given, not probed: data in the first block of a raw disk must not be taken for a header.
        kind = "qcow2" if disk.path.suffix == ".qcow2" else "raw"
        access = "off" if disk.writable else "on"
        words += ["-drive", f"if=none,id=disk{index},file={disk.path},format={kind},readonly={access}",
                  "-device", f"virtio-blk-pci,drive=disk{index},serial={disk.serial}"]
    words += network
    for name, path in (usb_sockets or {}).items():
        words += ["-chardev", f"socket,id={name},path={path},reconnect=1",
                  "-device", f"usb-redir,chardev={name},id={name},bus=xhci.0"]
    return [*words, *extra]


class QmpError(Exception):
    """QEMU rejected a command or does not answer."""


class Qmp:
    """A session. QEMU serves one at a time: keep it open only as long as it is needed.

    with Qmp(path) as qmp:
        qmp.command("device_del", id="cam0")
    """

    def __init__(self, path: Path, timeout_s: float = 10.0) -> None:
        self._timeout_s = timeout_s
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._lines = self._socket.makefile("rb")
        try:
            self._socket.settimeout(timeout_s)
            self._socket.connect(str(path))
            greeting = self._read()
            if "QMP" not in greeting:
                raise QmpError(f"{path} does not speak QMP: {greeting}")
            self.command("qmp_capabilities")
        except OSError as error:
            self.__exit__()
            raise QmpError(f"QEMU does not answer at {path}: {error}") from error
        except QmpError:
            self.__exit__()
            raise

    def __enter__(self) -> Qmp:
        return self

    def __exit__(self, *_: object) -> None:
        self._lines.close()
        self._socket.close()

    def _read(self) -> dict[str, Any]:
        try:
            line = self._lines.readline()
        except TimeoutError as error:
            raise QmpError("QEMU did not answer in time") from error
        if not line.endswith(b"\n"):
            raise QmpError("QEMU closed the connection")
        return json.loads(line)

    def command(self, name: str, /, **arguments: Any) -> Any:
        """Runs a command and returns its result. Underscores in argument names become hyphens. Raises QmpError."""
        message: dict[str, Any] = {"execute": name}
        if arguments:
            message["arguments"] = {key.replace("_", "-"): value for key, value in arguments.items()}
        try:
            self._socket.sendall(json.dumps(message).encode() + b"\n")
        except OSError as error:
            raise QmpError(f"QEMU is gone: {error}") from error
        deadline = time.monotonic() + self._timeout_s
        while True:
            if time.monotonic() > deadline:
                raise QmpError("QEMU did not answer in time")
            answer = self._read()
            if "error" in answer:
                raise QmpError(f"{name}: {answer['error'].get('desc', answer['error'])}")
            # Anything else is an event.
            if "return" in answer:
                return answer["return"]

    def monitor(self, line: str) -> str:
        """Runs a command of the human monitor, for functions that QMP lacks, and returns its output."""
        return self.command("human-monitor-command", **{"command-line": line})
