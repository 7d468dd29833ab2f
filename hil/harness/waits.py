"""Waits with a time limit and progress messages, and exclusive locks between processes."""

from __future__ import annotations

import fcntl
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
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


def lock_folder() -> Path:
    """The folder of the locks that all checkouts of this user share."""
    folder = Path(os.environ.get("XDG_RUNTIME_DIR") or "/tmp") / f"lightwell-hil-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


@contextmanager
def held(path: Path, what: str, limit_s: float) -> Iterator[None]:
    """Holds an exclusive flock() on `path`; `what` completes the message "waiting for ...". Raises TimedOut, which
    names the process that holds it, if it is not free within `limit_s` seconds. The kernel releases it when the process
    ends."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        def free() -> bool:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
            return True

        wait_for(what, free, limit_s, every_s=0.05,
                 state=lambda: f"{path.read_text(encoding='ascii') or 'somebody'} has it")
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"process {os.getpid()} since {time.strftime('%H:%M:%S')}".encode(), 0)
        try:
            yield
        finally:
            os.ftruncate(descriptor, 0)
    finally:
        os.close(descriptor)
