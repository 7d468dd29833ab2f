"""Bounded waits that say what they wait for.

say        a line for people
wait_for   until something is seen, or TimedOut
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


def say(text: str) -> None:
    """A line for people, on stderr: stdout is for what was asked for."""
    print(f"hil: {text}", file=sys.stderr, flush=True)


class TimedOut(Exception):
    """What was waited for did not come; the text says what, how long, and what was seen last."""


def wait_for(
    what: str,
    look: Callable[[], T | None],
    timeout_s: float,
    *,
    every_s: float = 0.25,
    progress_period_s: float = 10.0,
    state: Callable[[], str] = lambda: "",
) -> T:
    """Calls `look` every `every_s` seconds until it returns something that is neither None nor False, and returns that.
    Each `progress_period_s` seconds a line says what is waited for, and what `state` says of it. An exception of `look` ends
    the wait: the thing can no longer come. Raises TimedOut after `timeout_s`."""
    begin = time.monotonic()
    told = begin
    while True:
        result = look()
        if result is not None and result is not False:
            return result
        now = time.monotonic()
        seen = state() if now - begin >= timeout_s or now - told >= progress_period_s else ""
        seen = f"; last seen: {seen}" if seen else ""
        if now - begin >= timeout_s:
            raise TimedOut(f"waited {timeout_s:g} s for {what} and it did not come{seen}")
        if now - told >= progress_period_s:
            say(f"waiting for {what} ({now - begin:.0f} s of {timeout_s:g} s){seen}")
            told = now
        time.sleep(every_s)
