"""One run at a time on a board or a camera, whoever starts it."""

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .waits import wait_for


def lock_folder() -> Path:
    """Where the locks of this machine are: they hold for all checkouts."""
    folder = Path(os.environ.get("XDG_RUNTIME_DIR") or "/tmp") / f"lightwell-hil-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


@contextmanager
def held(name: str, limit_s: float, folder: Path | None = None) -> Iterator[None]:
    """Holds the lock `name`; TimedOut, naming who has it, where it is not free in time. It ends with the process."""
    path = (folder or lock_folder()) / f"{name}.lock"
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        def free() -> bool:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
            return True

        if not free():
            wait_for(f"{name}, which {holder(path)} holds", free, limit_s, every_s=0.05)
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"process {os.getpid()} since {time.strftime('%H:%M:%S')}".encode(), 0)
        try:
            yield
        finally:
            os.ftruncate(descriptor, 0)
    finally:
        os.close(descriptor)


def holder(path: Path) -> str:
    """What its holder wrote into a lock."""
    return path.read_text(encoding="utf-8").strip() or "somebody"
