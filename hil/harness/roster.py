"""Reads and validates hil/roster.textproto."""

from pathlib import Path
from typing import Any

from google.protobuf import text_format

from .recording import message_class
from .vivid import FOURCC

HIL = Path(__file__).resolve().parent.parent


class RosterError(Exception):
    """The roster is invalid: the message names the file, the entry and what to do."""


def parse(text: str, name: str) -> Any:
    """The Roster. Raises RosterError if the text cannot be parsed (with line and column) or an entry is invalid."""
    roster = message_class(HIL, "roster.proto", "lightwell.hil.Roster")()
    try:
        text_format.Parse(text, roster)
    except text_format.ParseError as error:
        raise RosterError(f"{name}:{error}") from error
    try:
        _check(roster)
    except RosterError as error:
        raise RosterError(f"{name}: {error}") from error
    return roster


def load(path: Path = HIL / "roster.textproto") -> Any:
    return parse(path.read_text(encoding="utf-8"), str(path))


def _check(roster: Any) -> None:
    names = {}
    for kind in ("board", "camera", "link", "test"):
        seen: set[str] = set()
        for entry in getattr(roster, kind):
            if not entry.name or entry.name in seen:
                raise RosterError(f"a {kind} is called '{entry.name}'; give each a name of its own")
            seen.add(entry.name)
            if kind in ("board", "camera") and entry.WhichOneof("kind") is None:
                raise RosterError(f"{kind} {entry.name} is of no kind; see hil/roster.proto")
        names[kind] = seen
    for camera in roster.camera:
        if camera.WhichOneof("kind") == "vivid" and camera.vivid.format not in FOURCC:
            raise RosterError(f"camera {camera.name}: nothing renders '{camera.vivid.format}' for vivid; there are "
                              + ", ".join(FOURCC))
    if not roster.test:
        raise RosterError("there is no test in it")
    for test in roster.test:
        if test.name.count(".") != 1:
            raise RosterError(f"test {test.name}: a name is FILE.FUNCTION of hil/cases")
        if test.limit_s == 0:
            raise RosterError(f"test {test.name} has no limit_s: how long may it take?")
        for field, kind in (("board", "board"), ("camera", "camera"), ("link", "link"), ("peer", "board")):
            wanted = getattr(test, field)
            # All but the board are optional.
            if (wanted or field == "board") and wanted not in names[kind]:
                known = ", ".join(sorted(names[kind]))
                raise RosterError(f"test {test.name} asks for {field} '{wanted}'; there are {known}")
        if test.peer:
            _check_peer({board.name: board for board in roster.board}, test)


def _check_peer(boards: dict[str, Any], test: Any) -> None:
    if test.peer == test.board:
        raise RosterError(f"test {test.name}: the peer is another board than {test.board}")
    for board in (boards[test.board], boards[test.peer]):
        if board.WhichOneof("kind") != "qemu" or board.qemu.net != "tap":
            raise RosterError(f"test {test.name}: {board.name} is on no wire with its peer; that needs net: \"tap\"")
    if not test.needs_fresh_board_after:
        raise RosterError(f"test {test.name} has a peer: set needs_fresh_board_after: true")
