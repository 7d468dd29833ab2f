"""What is known of boards on this machine, from process to process: a folder each, below runs_folder().

runs_folder    where they are
BoardRecord    board.json of one: its QEMU, its addresses, who owns it
remove_stale   what a run left that died
"""

from __future__ import annotations

import json
import os
import stat
import tempfile
from pathlib import Path
from typing import Any

from .network import NetworkError, network_from
from .processes import Process
from .waits import say


class BoardError(Exception):
    """A board does not do what it was asked; the text says what was seen of it."""


def runs_folder() -> Path:
    """Where boards live: short, because a socket's path holds 107 bytes, and this user's alone."""
    named = os.environ.get("LIGHTWELL_BOARDS")
    folder = Path(named) if named else Path(tempfile.gettempdir()) / f"lightwell-boards-{os.geteuid()}"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    owner = folder.stat()
    if owner.st_uid != os.geteuid() or stat.S_IMODE(owner.st_mode) & 0o022:
        raise BoardError(f"{folder} may be written by others: set LIGHTWELL_BOARDS to a folder of your own")
    return folder


class BoardRecord:
    """board.json: there while its QEMU should run."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "board.json"

    def told(self) -> dict[str, Any] | None:
        try:
            return json.loads(self.path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None

    def tell(self, told: dict[str, Any]) -> None:
        """Whole or not at all."""
        written = self.path.with_suffix(".json.new")
        written.write_text(json.dumps(told, indent=2) + "\n", encoding="utf-8")
        written.rename(self.path)


def remove_stale() -> None:
    """Ends boards of this user whose owner is gone, and forgets those whose QEMU is."""
    for path in runs_folder().glob("*/board.json"):
        try:
            told = json.loads(path.read_text(encoding="utf-8"))
            board = Process(told["pid"], told["began"])
            owner = told.get("owner")
            if board.is_alive() and (owner is None or Process(owner["pid"], owner["began"]).is_alive()):
                continue
            if board.is_alive():
                say(f"ending the board {told['name']} of a run that died")
                board.kill()
            network_from(told["network"]).close()
            path.unlink(missing_ok=True)
        except FileNotFoundError:
            continue  # Another run was faster.
        except (ValueError, KeyError, NetworkError) as error:
            say(f"{path} cannot be cleaned up: {error}")
