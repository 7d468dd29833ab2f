"""Processes of other runs, told apart from strangers that were given the same number."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Process:
    """A number, and the kernel's tick at which that process began: together never given twice within a boot."""
    pid: int
    began: int

    @staticmethod
    def of(pid: int) -> Process | None:
        """The process that has this number now; None where there is none, or only its exit status is left."""
        try:
            text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
        except OSError:
            return None
        # The name in parentheses may hold anything; fields are counted from behind it (proc(5): 3 is the state).
        fields = text[text.rindex(")") + 2:].split()
        return None if fields[0] in "ZX" else Process(pid, int(fields[19]))

    @staticmethod
    def own() -> Process:
        process = Process.of(os.getpid())
        assert process is not None
        return process

    def is_alive(self) -> bool:
        return Process.of(self.pid) == self

    def kill(self, timeout_s: float = 10.0) -> None:
        """SIGKILL, and waits until it is gone."""
        deadline = time.monotonic() + timeout_s
        while self.is_alive() and time.monotonic() < deadline:
            try:
                os.kill(self.pid, signal.SIGKILL)
            except ProcessLookupError:
                return
            time.sleep(0.02)

    def memory_mb(self) -> float:
        """Resident memory; 0 where it is gone."""
        try:
            for line in Path(f"/proc/{self.pid}/status").read_text(encoding="ascii").splitlines():
                if line.startswith("VmRSS:"):
                    return int(line.split()[1]) / 1024
        except OSError:
            pass  # It ended meanwhile.
        return 0.0
