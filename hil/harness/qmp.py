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
        qmp.wait_event("DEVICE_DELETED", 10, device="cam0")
    """

    def __init__(self, path: Path, timeout_s: float = 10.0) -> None:
        self._events: list[dict[str, Any]] = []
        self._buffer = b""
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._deadline = time.monotonic() + timeout_s
        self._timeout_s = timeout_s
        try:
            self._socket.settimeout(timeout_s)
            self._socket.connect(str(path))
            greeting = self._read()
            if "QMP" not in greeting:
                raise QmpError(f"{path} does not speak QMP: {greeting}")
            self.command("qmp_capabilities")
        except OSError as error:
            self._socket.close()
            raise QmpError(f"QEMU does not answer at {path}: {error}") from error
        except QmpError:
            self._socket.close()
            raise

    def __enter__(self) -> Qmp:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def _read(self) -> dict[str, Any]:
        while b"\n" not in self._buffer:
            left = self._deadline - time.monotonic()
            if left <= 0:
                raise QmpError("QEMU did not answer in time")
            self._socket.settimeout(left)
            try:
                chunk = self._socket.recv(65536)
            except TimeoutError as error:
                raise QmpError("QEMU did not answer in time") from error
            if not chunk:
                raise QmpError("QEMU closed the connection")
            self._buffer += chunk
        line, self._buffer = self._buffer.split(b"\n", 1)
        return json.loads(line)

    def command(self, name: str, /, **arguments: Any) -> Any:
        """Runs a command and returns its result. Underscores in argument names become hyphens. Raises QmpError."""
        message: dict[str, Any] = {"execute": name}
        if arguments:
            message["arguments"] = {key.replace("_", "-"): value for key, value in arguments.items()}
        self._deadline = time.monotonic() + self._timeout_s
        try:
            self._socket.sendall(json.dumps(message).encode() + b"\n")
        except OSError as error:
            raise QmpError(f"QEMU is gone: {error}") from error
        while True:
            answer = self._read()
            if "event" in answer:
                self._events.append(answer)
            elif "error" in answer:
                raise QmpError(f"{name}: {answer['error'].get('desc', answer['error'])}")
            else:
                return answer["return"]

    def monitor(self, line: str) -> str:
        """Runs a command of the human monitor, for functions that QMP lacks, and returns its output."""
        return self.command("human-monitor-command", **{"command-line": line})

    def wait_event(self, name: str, timeout_s: float, **data: Any) -> dict[str, Any]:
        """Waits for an event of that name whose data contains these entries, and returns it. Events since the session
        began count; each is returned once. Raises QmpError after `timeout_s`."""
        self._deadline = time.monotonic() + timeout_s
        while True:
            for index, event in enumerate(self._events):
                if event["event"] == name and data.items() <= event.get("data", {}).items():
                    return self._events.pop(index)
            try:
                self._events.append(self._read())
            except QmpError as error:
                seen = ", ".join(event["event"] for event in self._events) or "none"
                raise QmpError(f"no event {name} {data or ''} within {timeout_s:g} s: {error}; seen: {seen}") from error
