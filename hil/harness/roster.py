"""Reads and validates hil/roster.textproto."""

import re
import warnings
from pathlib import Path
from typing import Any

from google.protobuf import text_format

from .messages import message_class
from .vivid import FOURCC

HIL = Path(__file__).resolve().parent.parent
# Former names of fields, in whatever message; their numbers are the same.
_CURRENT_NAMES = {"what": "description", "spoils_board": "needs_fresh_board_after"}
# A string, a comment, or a former name.
_TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])*\'|#.*|\b(' + "|".join(_CURRENT_NAMES) + r")\b(?=\s*:)")


class RosterError(Exception):
    """The roster is invalid: the message names the file, the entry and what to do."""


def _with_current_names(text: str, name: str) -> str:
    def current(token: re.Match[str]) -> str:
        former = token.group(1)
        if not former:
            return token.group()
        line = text.count("\n", 0, token.start()) + 1
        warnings.warn(f"{name}:{line}: field '{former}' is now called '{_CURRENT_NAMES[former]}': the former name is "
                      "deprecated", FutureWarning, stacklevel=4)
        return _CURRENT_NAMES[former]

    return _TOKEN.sub(current, text)


def parse(text: str, name: str) -> Any:
    """The Roster. Raises RosterError if the text cannot be parsed (with line and column) or an entry is invalid; warns
    of former names of fields."""
    roster = message_class(HIL, "roster.proto", "lightwell.hil.Roster")()
    try:
        text_format.Parse(_with_current_names(text, name), roster)
    except text_format.ParseError as error:
        raise RosterError(f"{name}:{error}") from error
    _check(roster, name)
    return roster


def load(path: Path = HIL / "roster.textproto") -> Any:
    return parse(path.read_text(encoding="utf-8"), str(path))


def _check(roster: Any, name: str) -> None:
    names = {}
    for kind in ("board", "camera", "link", "test"):
        seen: set[str] = set()
        for entry in getattr(roster, kind):
            if not entry.name or entry.name in seen:
                raise RosterError(f"{name}: a {kind} is called '{entry.name}'; give each a name of its own")
            seen.add(entry.name)
            if kind in ("board", "camera") and entry.WhichOneof("kind") is None:
                raise RosterError(f"{name}: {kind} {entry.name} is of no kind; see hil/roster.proto")
        names[kind] = seen
    for camera in roster.camera:
        if camera.WhichOneof("kind") == "vivid" and camera.vivid.format not in FOURCC:
            raise RosterError(
                f"{name}: camera {camera.name}: nothing renders '{camera.vivid.format}' for vivid; there are "
                + ", ".join(FOURCC)
            )
    if not roster.test:
        raise RosterError(f"{name}: there is no test in it")
    for test in roster.test:
        if test.name.count(".") != 1:
            raise RosterError(f"{name}: test {test.name}: a name is FILE.FUNCTION of hil/cases")
        if test.limit_s == 0:
            raise RosterError(f"{name}: test {test.name} has no limit_s: how long may it take?")
        for kind in ("board", "camera", "link"):
            wanted = getattr(test, kind)
            # Camera and link are optional, the board is not.
            if (wanted or kind == "board") and wanted not in names[kind]:
                known = ", ".join(sorted(names[kind]))
                raise RosterError(f"{name}: test {test.name} asks for {kind} '{wanted}'; there are {known}")
        if test.peer:
            _check_peer(roster, test, name)


def _check_peer(roster: Any, test: Any, name: str) -> None:
    boards = {board.name: board for board in roster.board}
    if test.peer not in boards:
        raise RosterError(
            f"{name}: test {test.name} asks for peer '{test.peer}'; there are {', '.join(sorted(boards))}"
        )
    if test.peer == test.board:
        raise RosterError(f"{name}: test {test.name}: the peer is another board than {test.board}")
    for board in (boards[test.board], boards[test.peer]):
        if board.WhichOneof("kind") != "qemu" or board.qemu.net != "tap":
            raise RosterError(
                f"{name}: test {test.name}: {board.name} is on no wire with its peer; that needs net: \"tap\""
            )
    if not test.needs_fresh_board_after:
        raise RosterError(f"{name}: test {test.name} has a peer: set needs_fresh_board_after: true")
