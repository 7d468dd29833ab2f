"""Waits with a time limit and progress messages."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def say(text: str) -> None:
    """Prints a message to stderr; stdout is reserved for results."""
    print(f"hil: {text}", file=sys.stderr, flush=True)


class TimedOut(Exception):
    """A wait reached its limit; the text says what was waited for, how long, and the last state."""


def wait_for(what: str, poll: Callable[[], T | None], timeout_s: float, *, every_s: float = 0.25,
             progress_period_s: float = 10.0, state: Callable[[], str] = lambda: "") -> T:
    """Calls `poll` every `every_s` seconds until it returns something that is neither None nor False, and returns that.
    Every `progress_period_s` seconds it prints what it waits for, and the text of `state`. `poll` may raise an
    exception to end the wait, if the condition can no longer become true. Raises TimedOut after `timeout_s` seconds."""
    begin = time.monotonic()
    last_message = begin
    while True:
        result = poll()
        if result is not None and result is not False:
            return result
        now = time.monotonic()
        seen = state() if now - begin >= timeout_s or now - last_message >= progress_period_s else ""
        seen = f"; last seen: {seen}" if seen else ""
        if now - begin >= timeout_s:
            raise TimedOut(f"waited {timeout_s:g} s for {what} and it did not come{seen}")
        if now - last_message >= progress_period_s:
            say(f"waiting for {what} ({now - begin:.0f} s of {timeout_s:g} s){seen}")
            last_message = now
        time.sleep(every_s)
