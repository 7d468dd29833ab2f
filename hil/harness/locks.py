"""Exclusive locks between processes."""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .waits import wait_for


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
