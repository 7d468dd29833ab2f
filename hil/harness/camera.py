"""Controls lightwell-usb-camera, the simulated USB camera, which runs outside of the guest."""

from __future__ import annotations

import json
import socket
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .waits import wait_for


class CameraError(Exception):
    """The camera did not start, or rejected a command; the text says which."""


class UsbCamera:
    """One camera process. `redir`: the usb-redir socket that it creates, one of the board's Options.usb_sockets."""

    def __init__(self, program: Path, redir: Path, scene: str, arguments: Sequence[str] = ()) -> None:
        self.redir = redir
        self._folder = tempfile.TemporaryDirectory(prefix="lightwell-camera-")
        self._control = Path(self._folder.name) / "control"
        self._said = Path(self._folder.name) / "log"
        self._command = [str(program), "--redir", str(redir), "--control", str(self._control), "--scene", scene,
                         *arguments]
        self._child: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> UsbCamera:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        self._folder.cleanup()

    def start(self, timeout_s: float = 180.0) -> None:
        """Starts the camera. Returns when it accepts commands, after it has rendered its frames."""
        self.redir.unlink(missing_ok=True)
        with open(self._said, "wb") as said:
            self._child = subprocess.Popen(self._command, stdin=subprocess.DEVNULL, stdout=said, stderr=said)

        def ready() -> bool:
            if self._child is None or self._child.poll() is not None:
                raise CameraError(f"{' '.join(self._command)} ended at once: {self.log_tail()}")
            return self._control.exists() and self.redir.exists()

        wait_for("the camera to render ahead", ready, timeout_s, every_s=0.05, state=self.log_tail)

    def stop(self) -> None:
        """Ends the camera's process and removes its socket: the board sees it unplugged."""
        if self._child is not None:
            self._child.terminate()
            try:
                self._child.wait(10)
            except subprocess.TimeoutExpired:
                self._child.kill()
                self._child.wait()
            self._child = None
        self.redir.unlink(missing_ok=True)

    def log_tail(self) -> str:
        """The end of its log."""
        return self._said.read_text(encoding="utf-8", errors="replace").strip()[-500:] if self._said.exists() else ""

    def command(self, name: str, **values: Any) -> dict[str, Any]:
        """Sends a command (hil/README.md lists them) and returns the response. Raises CameraError if it is rejected."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as control:
            control.settimeout(20)
            control.connect(str(self._control))
            control.sendall((json.dumps({"command": name, **values}) + "\n").encode())
            with control.makefile(encoding="utf-8") as lines:
                answer: dict[str, Any] = json.loads(lines.readline())
        if not answer.get("ok"):
            raise CameraError(f"the camera rejected {name}: {answer.get('error')}")
        return answer

    def counters(self) -> dict[str, Any]:
        """Its counters since its start or `reset_counters`."""
        return self.command("counters")
