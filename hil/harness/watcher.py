"""`lightwell watch --json` as a background process, on this machine or on a board, and waits for its output."""

from __future__ import annotations

import json
import subprocess
import tempfile
import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .board import Board
from .runner import TestFailure
from .waits import wait_for


class Watcher(ABC):
    """A context manager that ends the client on exit."""

    # Polling period; each poll reads the whole output.
    every_s: float

    def __enter__(self) -> Watcher:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    @abstractmethod
    def _text(self) -> str:
        """The client's whole output."""

    @abstractmethod
    def end(self) -> None:
        """Ends the client by SIGTERM, so that it still prints its summary. Does nothing the second time."""

    def state(self) -> str:
        """The state of its link for progress messages: its last report and, on a board, the end of its log."""
        lines = self.seconds()
        return json.dumps(lines[-1]) if lines else "no output yet"

    def _lines(self, kind: str) -> list[dict[str, Any]]:
        whole = [json.loads(line) for line in self._text().splitlines(keepends=True) if line.endswith("\n")]
        return [line for line in whole if line["kind"] == kind]

    def seconds(self) -> list[dict[str, Any]]:
        """Its reports so far, one per second."""
        return self._lines("second")

    def summary(self) -> dict[str, Any]:
        """Ends the client and returns its summary."""
        self.end()
        lines = self._lines("summary")
        if not lines:
            raise TestFailure("the client ended without a summary")
        return lines[0]

    def wait_for(self, what: str, limit_s: float, *, since: int, frames: int = 1) -> dict[str, Any]:
        """Waits for the first report after the first `since` ones that counts at least `frames` frames, and returns
        it."""
        def poll() -> dict[str, Any] | None:
            return next((line for line in self.seconds()[since:] if line["frames"] >= frames), None)

        return wait_for(what, poll, limit_s, every_s=self.every_s, state=self.state)

    def next_seconds(self, count: int, limit_s: float = 60, *, skipped: int = 0) -> list[dict[str, Any]]:
        """Waits for `count` new reports, after leaving out the first `skipped` ones, and returns them."""
        since = len(self.seconds()) + skipped
        return wait_for(f"{count} reports of the client",
                        lambda: seen if len(seen := self.seconds()[since:]) >= count else None, limit_s,
                        every_s=self.every_s, state=self.state)

    def back_after(self, what: str, limit_s: float) -> float:
        """Waits until a report for a whole second counts frames; returns the seconds from now until then. The client
        reports a second after it has ended, so the result is up to two seconds more than the light itself took."""
        begun, since = time.monotonic(), len(self.seconds())
        # The report of the current second may count frames from before the fault ended.
        self.wait_for(what, limit_s, since=since + 1)
        return time.monotonic() - begun

    def wait_until_silent(self, limit_s: float = 60) -> None:
        """Waits until a report for a whole second counts no frames."""
        since = len(self.seconds())
        wait_for("the light to stop", lambda: any(line["frames"] == 0 for line in self.seconds()[since + 1:]), limit_s,
                 every_s=self.every_s, state=self.state)


class WatcherHere(Watcher):
    """The client is a process on this machine."""
    every_s = 0.1

    def __init__(self, command: Sequence[str]) -> None:
        self._file = tempfile.NamedTemporaryFile("w+", prefix="lightwell-watch-", encoding="utf-8")
        self._child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=self._file, stderr=subprocess.DEVNULL)

    def __exit__(self, *_: object) -> None:
        self.end()
        self._file.close()

    def _text(self) -> str:
        return Path(self._file.name).read_text(encoding="utf-8")

    def end(self) -> None:
        self._child.terminate()
        self._child.wait(20)


class WatcherOnBoard(Watcher):
    """The client is a process on `board`, at most one on each; its output is read by ssh."""
    every_s = 0.3

    def __init__(self, board: Board, uri: str) -> None:
        self._board = board
        board.run(f"lightwell watch {uri} --json >/run/watch.json 2>/run/watch.err & echo $! >/run/watch.pid",
                  check=True)

    def _text(self) -> str:
        return self._board.run("cat /run/watch.json").out

    def state(self) -> str:
        return f"{super().state()} {self._board.run('tail -n 3 /run/watch.err').out.strip()}".strip()

    def end(self) -> None:
        self._board.run(
            "p=$(cat /run/watch.pid) && rm /run/watch.pid && kill $p && timeout 20 tail -s 0.1 --pid=$p -f "
            "/dev/null; true"
        )
