"""Records of the boards on this machine, shared by all processes: one folder per board below runs_folder()."""

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
    """An operation on a board failed; the text says which, with the end of the board's log where there is one."""


def runs_folder() -> Path:
    """The folder of all boards; only this user may write to it. Its path is short, because a socket's path is limited
    to 107 bytes."""
    named = os.environ.get("LIGHTWELL_BOARDS")
    folder = Path(named) if named else Path(tempfile.gettempdir()) / f"lightwell-boards-{os.geteuid()}"
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    owner = folder.stat()
    if owner.st_uid != os.geteuid() or stat.S_IMODE(owner.st_mode) & 0o022:
        raise BoardError(f"{folder} may be written by others: set LIGHTWELL_BOARDS to a folder that only you can write")
    return folder


class BoardRecord:
    """A board's board.json: its QEMU process, addresses and owner. It exists while QEMU should run."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "board.json"

    def load(self) -> dict[str, Any] | None:
        """The record; None if there is none or it cannot be read."""
        try:
            return json.loads(self.path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None

    def save(self, record: dict[str, Any]) -> None:
        """Replaces the file atomically."""
        written = self.path.with_suffix(".json.new")
        written.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
        written.rename(self.path)


def remove_stale() -> None:
    """Ends this user's boards whose owner is gone, and removes the records of boards whose QEMU is gone."""
    for path in runs_folder().glob("*/board.json"):
        try:
            record = json.loads(path.read_text(encoding="utf-8"))
            board = Process(record["pid"], record["began"])
            owner = record.get("owner")
            if board.is_alive() and (owner is None or Process(owner["pid"], owner["began"]).is_alive()):
                continue
            if board.is_alive():
                say(f"ending the board {record['name']} of a run that died")
                board.kill()
            network_from(record["network"]).close()
            path.unlink(missing_ok=True)
        except FileNotFoundError:
            continue  # Another process has removed it.
        except (ValueError, KeyError, NetworkError) as error:
            say(f"{path} cannot be cleaned up: {error}")
