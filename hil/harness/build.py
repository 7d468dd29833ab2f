"""Builds the programs of the board, against its sysroot, and of the host from this clone."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path

from . import image
from .waits import say

BOARD_TARGETS = ("lightwelld", "lightwell_cli", "lightwell-calibrate")
HOST_TARGETS = ("lightwell_cli", "lightwelld", "lightwell-usb-camera", "demo_report", "compare_recordings",
                "marker_frames")


class NotBuilt(Exception):
    """Configuring or building failed; the text has the last lines of the log and the log's path."""


def _run(steps: Sequence[Sequence[str | Path]], log: Path) -> None:
    log.parent.mkdir(parents=True, exist_ok=True)
    with open(log, "w", encoding="utf-8") as out:
        for step in steps:
            words = [str(word) for word in step]
            if subprocess.run(words, cwd=image.REPOSITORY, stdin=subprocess.DEVNULL, stdout=out, stderr=out,
                              check=False).returncode:
                last = "\n".join(log.read_text(encoding="utf-8", errors="replace").splitlines()[-20:])
                raise NotBuilt(f"'{' '.join(words)}' failed:\n{last}\ncomplete log: {log}")


def build_for_board(folder: Path) -> None:
    """Builds into `folder`. Configures it anew if the sysroot has changed, because CMake's cache still refers to the
    old one."""
    packages = image.sysroot()
    steps: list[Sequence[str | Path]] = [["cmake", "--build", folder, "--target", *BOARD_TARGETS]]
    try:
        cached = (folder / "CMakeCache.txt").read_text(encoding="utf-8")
        in_use = f"LIGHTWELL_SYSROOT_IN_USE:INTERNAL={packages}\n" in cached
    except FileNotFoundError:
        in_use = False
    if not in_use:
        say("configuring and building the firmware for the board; this takes minutes the first time")
        steps.insert(0, ["cmake", "--fresh", "--preset", "board-aarch64", "-B", folder])
    _run(steps, folder.parent / "board.log")


def build_for_host(folder: Path, panoramas: Path) -> None:
    """Builds into `folder` with the preset dev."""
    say("building the programs of the host")
    _run([["cmake", "--preset", "dev", "-B", folder, f"-DLIGHTWELL_PANORAMA_DIR={panoramas}"],
          ["cmake", "--build", folder, "--target", *HOST_TARGETS]], folder.parent / "host.log")
