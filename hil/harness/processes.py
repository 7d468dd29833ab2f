"""Runs programs, and identifies processes across runs, although the kernel reuses process ids."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


def output_of(command: Sequence[str | Path], error: type[Exception]) -> str:
    """What a program prints to stdout. Raises `error`, with the end of its output, if it fails or is not installed."""
    words = [str(word) for word in command]
    try:
        done = subprocess.run(words, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, check=False)
    except FileNotFoundError as missing:
        raise error(f"{words[0]} is not installed: run cmake/setup") from missing
    if done.returncode != 0:
        last = (done.stderr or done.stdout).strip()[-3000:]
        raise error(f"'{' '.join(words)}' failed with {done.returncode}: {last}")
    return done.stdout


@dataclass(frozen=True)
class Process:
    """A process id and the process's start time in kernel ticks (`began`): together unique within a boot."""
    pid: int
    began: int

    @staticmethod
    def of(pid: int) -> Process | None:
        """The process that has this id now; None if there is none or it is a zombie."""
        try:
            text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
        except OSError:
            return None
        # The name in parentheses may contain any character; fields are counted after it (proc(5): field 3 is the
        # state).
        fields = text[text.rindex(")") + 2:].split()
        return None if fields[0] in "ZX" else Process(pid, int(fields[19]))

    @staticmethod
    def current() -> Process:
        process = Process.of(os.getpid())
        assert process is not None
        return process

    def is_alive(self) -> bool:
        return Process.of(self.pid) == self

    def kill(self, timeout_s: float = 10.0) -> None:
        """Sends SIGKILL and waits until the process is gone, at most `timeout_s` seconds."""
        deadline = time.monotonic() + timeout_s
        while self.is_alive() and time.monotonic() < deadline:
            try:
                os.kill(self.pid, signal.SIGKILL)
            except ProcessLookupError:
                return
            time.sleep(0.02)

    def memory_mb(self) -> float:
        """Resident memory in MiB; 0 if the process is gone."""
        try:
            for line in Path(f"/proc/{self.pid}/status").read_text(encoding="ascii").splitlines():
                if line.startswith("VmRSS:"):
                    return int(line.split()[1]) / 1024
        except OSError:
            pass  # The process ended in the meantime.
        return 0.0
