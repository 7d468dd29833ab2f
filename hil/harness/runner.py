"""Runs tests of the roster. A board is started when first needed and ended after its last test, also if the harness
fails."""

import importlib
import random
import signal
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from . import waits
from .report import Figure, Result
from .waits import TimedOut, say


class CannotRun(Exception):
    """This machine cannot run the test; the text says why and what to do. The test counts as skipped, which is not
    good."""


class TestFailure(Exception):
    """A failed expectation that is not a measured value."""


class Measured:
    """Collects a test's figures."""

    def __init__(self) -> None:
        self.figures: list[Figure] = []

    def figure(self, name: str, measured: float | str, unit: str = "", asked: str = "") -> None:
        """Adds a value. `asked` is its limit: "<= 3", ">= 30", "== 0"; empty: the value is only reported."""
        self._add(Figure(name, measured if isinstance(measured, str) else float(measured), unit, asked))

    def time(self, name: str, measured: float, unit: str, asked: str = "") -> None:
        """As figure(), for a time or a rate."""
        self._add(Figure(name, float(measured), unit, asked, timed=True))

    def _add(self, figure: Figure) -> None:
        self.figures.append(figure)
        missed = "" if figure.holds else f", but the limit is {figure.asked}"
        say(f"    {figure.name}: {figure.value} {figure.unit}{missed}")


# Starts the board of a roster entry, and the peer if the test has one; registers their end in the ExitStack.
StartBoard = Callable[[Any, Any | None, ExitStack], Any]
# A test function; its arguments are the board's rig, the test's entry and its figures.
Case = Callable[..., None]


def case_of(test: Any, package: str = "hil.cases") -> Case:
    """The function of hil/cases that a test names. An unknown name raises an ordinary error, not CannotRun, so that a
    misspelt name fails."""
    file, function = test.name.split(".")
    return getattr(importlib.import_module(f"{package}.{file}"), function)


@contextmanager
def _limit(seconds: int, what: str) -> Iterator[None]:
    """Raises TimedOut in the test after a time limit, by SIGALRM."""
    def over(*_: object) -> None:
        raise TimedOut(f"{what} took longer than its {seconds} s")

    old = signal.signal(signal.SIGALRM, over)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, old)


def shuffled(tests: Sequence[Any], seed: int) -> list[Any]:
    """A random order, reproducible from a seed, so that no test depends on another. Tests of one board are adjacent, as
    starting a board takes long, and those that need a fresh board after them (`needs_fresh_board_after`) come last."""
    chance = random.Random(seed)
    boards = sorted({test.board for test in tests})
    chance.shuffle(boards)
    out: list[Any] = []
    for board in boards:
        mine = sorted((test for test in tests if test.board == board), key=lambda test: test.name)
        chance.shuffle(mine)
        out += sorted(mine, key=lambda test: test.needs_fresh_board_after)
    return out


def run(tests: Sequence[Any], boards: dict[str, Any], start: StartBoard, *, seed: int, commit: str, lock_limit_s: float,
        check_times: bool = True, finished: Callable[[Result], None], case: Callable[[Any], Case] = case_of,
        lock_folder: Path | None = None) -> list[Result]:
    """Runs every test once in a random order and calls `finished` with each result."""
    results = []
    todo = shuffled(tests, seed)
    with ExitStack() as everything:
        board, stack, name = None, ExitStack(), ""
        everything.callback(lambda: stack.close())
        for number, test in enumerate(todo, 1):
            say(f"[{number} of {len(todo)}] {test.name}: {test.description}")
            begun = time.monotonic()
            measured = Measured()
            result = Result(test.name, commit, 0, measured.figures, check_times=check_times)
            try:
                if board is None or name != test.board or test.peer:
                    stack.close()
                    stack, board, name = ExitStack(), None, test.board
                    # All runs take the locks in the same order, so that they cannot deadlock.
                    for wanted in sorted(filter(None, (test.board, test.peer))):
                        stack.enter_context(waits.held((lock_folder or waits.lock_folder()) / f"board-{wanted}.lock",
                                                       f"the board {wanted}", lock_limit_s))
                    board = start(boards[test.board], boards[test.peer] if test.peer else None, stack)
                with _limit(test.limit_s, test.name):
                    case(test)(board, test, measured)
            except CannotRun as why:
                result.skipped = str(why)
            except (TimedOut, TestFailure) as what:
                result.error = str(what)
            except Exception:  # Any error of a case or a board is reported, and the next test runs.
                result.error = traceback.format_exc()
            if not result.skipped and not result.error and not measured.figures:
                result.error = "it measured nothing"
            result.seconds = time.monotonic() - begun
            if (result.error or test.needs_fresh_board_after) and board is not None:
                # The state of the board is unknown.
                stack.close()
                board = None
            say(f"  {'good' if result.good else 'SKIPPED: ' + result.skipped if result.skipped else 'FAILED'}"
                f" after {result.seconds:.0f} s" + (f"\n{result.error}" if result.error else ""))
            results.append(result)
            finished(result)
    return results
