"""Runs tests of the roster: boards are started when first needed and ended after their last test, faults of the harness
included."""

import importlib
import signal
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from . import locks, order
from .report import Figure, Result
from .waits import TimedOut, say


class CannotRun(Exception):
    """This machine cannot: the reason, and what would help. A test that ends so is skipped, which is not good."""


class Broken(Exception):
    """What a test found wrong where no number can say it."""


class Measured:
    """What a test writes its figures into."""

    def __init__(self) -> None:
        self.figures: list[Figure] = []

    def figure(self, name: str, measured: float | str, unit: str = "", asked: str = "") -> None:
        """asked: "<= 3", ">= 30", "== 0"; empty: reported."""
        self._add(Figure(name, measured if isinstance(measured, str) else float(measured), unit, asked))

    def time(self, name: str, measured: float, unit: str, asked: str = "") -> None:
        """The same of what a clock says: a time or a rate."""
        self._add(Figure(name, float(measured), unit, asked, timed=True))

    def _add(self, figure: Figure) -> None:
        self.figures.append(figure)
        shown = figure.measured if isinstance(figure.measured, str) else format(figure.measured, ".4g")
        say(f"    {figure.name}: {shown} {figure.unit}{'' if figure.holds else f', and {figure.asked} was asked'}")


# Starts the board that a roster's entry describes, and its peer where a test has one, in a stack that ends them.
StartBoard = Callable[[Any, Any | None, ExitStack], Any]
# Calls a test: function, board, test's entry, figures.
Case = Callable[..., None]


def case_of(test: Any, package: str = "hil.cases") -> Case:
    """The function of hil/cases that a test names. CannotRun would hide a typing mistake: it is an error."""
    file, function = test.name.split(".")
    return getattr(importlib.import_module(f"{package}.{file}"), function)


class _Limit:
    """Ends a test that hangs where it is: between two steps of Python."""

    def __init__(self, seconds: int, what: str) -> None:
        self._seconds, self._what = seconds, what

    def __enter__(self) -> None:
        self._old = signal.signal(signal.SIGALRM, self._over)
        signal.alarm(self._seconds)

    def __exit__(self, *_: object) -> None:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, self._old)

    def _over(self, *_: object) -> None:
        raise TimedOut(f"{self._what} took longer than its {self._seconds} s")


def run(tests: Sequence[Any], boards: dict[str, Any], start: StartBoard, *, seed: int, commit: str, lock_limit_s: float,
        times_judged: bool = True, finished: Callable[[Result], None], case: Callable[[Any], Case] = case_of,
        lock_folder: Path | None = None) -> list[Result]:
    """Every test once; `finished` hears of each when it is over."""
    results = []
    todo = order.shuffled(tests, seed)
    with ExitStack() as everything:
        board, stack, name = None, ExitStack(), ""
        everything.callback(lambda: stack.close())
        for number, test in enumerate(todo, 1):
            say(f"[{number} of {len(todo)}] {test.name}: {test.what}")
            begun = time.monotonic()
            measured = Measured()
            result = Result(test.name, commit, 0, measured.figures, times_judged=times_judged)
            try:
                if board is None or name != test.board or test.peer:
                    stack.close()
                    stack, board, name = ExitStack(), None, test.board
                    # In one order for everybody: two runs never wait for each other.
                    for wanted in sorted(filter(None, (test.board, test.peer))):
                        stack.enter_context(locks.held((lock_folder or locks.lock_folder()) / f"board-{wanted}.lock",
                                                       f"the board {wanted}", lock_limit_s))
                    board = start(boards[test.board], boards[test.peer] if test.peer else None, stack)
                with _Limit(test.limit_s, test.name):
                    case(test)(board, test, measured)
            except CannotRun as why:
                result.skipped = str(why)
            except (TimedOut, Broken) as what:
                result.trouble = str(what)
            except Exception:  # Of a case or a board: shown in the report, and the next test is run.
                result.trouble = traceback.format_exc()
            if not result.skipped and not result.trouble and not measured.figures:
                result.trouble = "it measured nothing"
            result.seconds = time.monotonic() - begun
            if (result.trouble or test.spoils_board) and board is not None:
                # Who knows what it left behind.
                stack.close()
                board = None
            say(f"  {'good' if result.good else 'SKIPPED: ' + result.skipped if result.skipped else 'FAILED'}"
                f" after {result.seconds:.0f} s" + (f"\n{result.trouble}" if result.trouble else ""))
            results.append(result)
            finished(result)
    return results
