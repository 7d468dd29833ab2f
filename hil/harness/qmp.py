"""QEMU's machine protocol (QMP): one connection at a time, JSON lines (QEMU 7.2, docs/interop/qmp-spec.txt)."""

from __future__ import annotations

import json
import socket
import time
from pathlib import Path
from typing import Any


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
