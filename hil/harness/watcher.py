"""A client that goes on while something happens, here or on a board: what `lightwell watch --json` says, line by line.

Watcher         what it said, and waits for what it will say
WatcherHere     a process of this machine
WatcherOnBoard  a process of a board, which is read by ssh
"""

from __future__ import annotations

import json
import subprocess
import tempfile
import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from .board import Board
from .runner import Broken
from .waits import wait_for


class Watcher(ABC):
    """Ends the client when it is left."""

    # Between two looks: one costs what reading the lines costs.
    every_s: float

    def __enter__(self) -> Watcher:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()

    @abstractmethod
    def _text(self) -> str:
        """All that it printed."""

    @abstractmethod
    def end(self) -> None:
        """As Ctrl-C would, so that it still sums up. A second time does nothing."""

    def state(self) -> str:
        """What it knows of its link, for people who wait: its last second, and its last words."""
        lines = self.seconds()
        return json.dumps(lines[-1]) if lines else "it has said nothing yet"

    def _lines(self, kind: str) -> list[dict[str, Any]]:
        whole = [json.loads(line) for line in self._text().splitlines(keepends=True) if line.endswith("\n")]
        return [line for line in whole if line["kind"] == kind]

    def seconds(self) -> list[dict[str, Any]]:
        """What it said of each second so far."""
        return self._lines("second")

    def summary(self) -> dict[str, Any]:
        """Ends it; what it said of all."""
        self.end()
        lines = self._lines("summary")
        if not lines:
            raise Broken("the client ended without a summary")
        return lines[0]

    def wait_for(self, what: str, limit_s: float, *, since: int, frames: int = 1) -> dict[str, Any]:
        """The first line after the `since`th in which at least `frames` came."""
        def look() -> dict[str, Any] | None:
            return next((line for line in self.seconds()[since:] if line["frames"] >= frames), None)

        return wait_for(what, look, limit_s, every_s=self.every_s, state=self.state)

    def next_seconds(self, count: int, limit_s: float = 60, *, skipped: int = 0) -> list[dict[str, Any]]:
        """What it says of so many seconds that end from now on, without the first `skipped`."""
        since = len(self.seconds()) + skipped
        return wait_for(
            f"{count} seconds of the client's",
            lambda: seen if len(seen := self.seconds()[since:]) >= count else None,
            limit_s,
            every_s=self.every_s,
            state=self.state,
        )

    def back_after(self, what: str, limit_s: float) -> float:
        """Seconds from now until a whole second of the client's had light in it. It tells each when it is over, so this
        is up to two seconds more than the light itself took."""
        begun, since = time.monotonic(), len(self.seconds())
        # The second that is under way when the fault ends may hold frames of before it.
        self.wait_for(what, limit_s, since=since + 1)
        return time.monotonic() - begun

    def dark(self, limit_s: float = 60) -> None:
        """Until a whole second brought the client nothing."""
        since = len(self.seconds())
        wait_for("the light to stop", lambda: any(line["frames"] == 0 for line in self.seconds()[since + 1:]), limit_s,
                 every_s=self.every_s, state=self.state)


class WatcherHere(Watcher):
    every_s = 0.1

    def __init__(self, command: Sequence[str]) -> None:
        self._file = tempfile.NamedTemporaryFile("w+", prefix="lightwell-watch-", encoding="utf-8")
        self._child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=self._file, stderr=subprocess.DEVNULL)

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()
        self._file.close()

    def _text(self) -> str:
        return Path(self._file.name).read_text(encoding="utf-8")

    def end(self) -> None:
        self._child.terminate()
        self._child.wait(20)


class WatcherOnBoard(Watcher):
    """`lightwell watch URI` on `board`: one at a time on each."""
    every_s = 0.3

    def __init__(self, board: Board, uri: str) -> None:
        self._board = board
        board.run(
            f"lightwell watch {uri} --json >/run/watch.json 2>/run/watch.err & echo $! >/run/watch.pid", check=True
        )

    def _text(self) -> str:
        return self._board.run("cat /run/watch.json").out

    def state(self) -> str:
        return f"{super().state()} {self._board.run('tail -n 3 /run/watch.err').out.strip()}".strip()

    def end(self) -> None:
        self._board.run(
            "p=$(cat /run/watch.pid) && rm /run/watch.pid && kill $p && timeout 20 tail -s 0.1 --pid=$p -f "
            "/dev/null; true"
        )
