"""Time and memory that the board itself needs: the figures of hil/README.md."""

from __future__ import annotations

import time
from typing import Any

from hil.harness.rig import Rig
from hil.harness.runner import Measured


def costs(rig: Rig, test: Any, measured: Measured) -> None:
    """Measures shutdown, boot, memory and the daemon's start."""
    board = rig.board
    begun = time.monotonic()
    measured.figure("ended by itself when it was told to", str(board.stop()), "", "== True")
    measured.time("down, clean", time.monotonic() - begun, "s")
    begun = time.monotonic()
    # With a new state disk, independent of earlier tests.
    board.start(fresh=True)
    measured.time("from QEMU's start to ssh", time.monotonic() - begun, "s")
    board.wait_for_service()
    measured.time("to lightwelld READY, a simulated camera of 160x120 rendered on the board", time.monotonic() - begun,
                  "s")
    status = board.status()
    measured.figure("memory of the host's, lightwelld running", status["resident_mb"], "MB")
    used = board.run("free -m | awk '/^Mem/ {print $3}'", check=True).out
    measured.figure("memory used in the board", float(used), "MB")
    measured.figure("lightwelld's memory", rig.daemon()["rss_kb"] / 1024, "MB")
    # Linking OpenCV's imgcodecs would add a hundred libraries and three seconds to each start.
    libraries = board.run("ldd /usr/bin/lightwelld | wc -l", check=True).out
    measured.figure("libraries that lightwelld loads", float(libraries), "", "<= 140")
    measured.time("to load them (lightwelld --help), best of three",
                  min(_seconds(rig, "lightwelld --help") for _ in range(3)), "s")
    failed = board.run("systemctl --failed --plain --no-legend", check=True).out.split("\n")
    measured.figure("units that failed", sum(1 for line in failed if line.strip()), "", "== 0")
    measured.time("one command by ssh, best of five", min(_seconds(rig, "true") for _ in range(5)), "s")


def _seconds(rig: Rig, command: str) -> float:
    """Duration of a command on the board, run by ssh, in seconds."""
    begun = time.monotonic()
    rig.board.run(command, check=True)
    return time.monotonic() - begun
