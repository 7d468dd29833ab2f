"""A cache of generated folders, keyed by a digest of their inputs."""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from .waits import held

DAYS_KEPT = 30
MOST_KEPT = 4
# Longer than the slowest generator needs on a busy machine.
MAKING_S = 1800.0


def cache_root() -> Path:
    """The folder that cmake/sysroot_aarch64 and cmake/fetch_panoramas use as well; created if missing."""
    named = os.environ.get("LIGHTWELL_CACHE")
    base = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    root = Path(named) if named else Path(base) / "lightwell"
    root.mkdir(parents=True, exist_ok=True)
    return root.resolve()


def _walk(folder: Path) -> Iterator[Path]:
    for entry in sorted(folder.iterdir()):
        if entry.name == "__pycache__":
            continue
        yield entry
        if entry.is_dir() and not entry.is_symlink():
            yield from _walk(entry)


def digest(parts: Iterable[str | Path]) -> str:
    """The first twelve hex digits of a SHA-256. A str contributes its text; a Path its content: a file's bytes and
    executable bit, a folder's tree of these with their names. Times and owners are ignored."""
    sha = hashlib.sha256()

    def add(*words: bytes) -> None:
        for word in words:
            sha.update(str(len(word)).encode() + b":" + word)

    def add_path(name: str, path: Path) -> None:
        if path.is_symlink():
            add(b"link", name.encode(), os.readlink(path).encode())
        elif path.is_dir():
            add(b"folder", name.encode())
        else:
            executable = bool(path.stat().st_mode & stat.S_IXUSR)
            add(b"program" if executable else b"file", name.encode(), path.read_bytes())

    for part in parts:
        if isinstance(part, str):
            add(b"text", part.encode())
            continue
        add_path("", part)
        if part.is_dir():
            for entry in _walk(part):
                add_path(str(entry.relative_to(part)), entry)
    return sha.hexdigest()[:12]


def _sweep(root: Path, kind: str) -> None:
    """Keeps the MOST_KEPT most recently used folders of a kind and removes those unused for DAYS_KEPT days."""
    folders = sorted((folder for folder in root.glob(f"{kind}-*") if folder.is_dir()),
                     key=lambda folder: -folder.stat().st_mtime)
    oldest = time.time() - DAYS_KEPT * 24 * 3600
    for place, folder in enumerate(folders):
        if place >= MOST_KEPT or folder.stat().st_mtime < oldest:
            shutil.rmtree(folder, ignore_errors=True)


def kept(kind: str, key: str, make: Callable[[Path], None], root: Path | None = None) -> Path:
    """The folder KIND-KEY of the cache. If it is missing, `make` fills an empty folder, in one process at a time, which
    is renamed to it after `make` has returned: a run that is killed or fails leaves no incomplete folder of that name.
    Of each kind, the four most recently used folders are kept, for 30 days after their last use."""
    root = root or cache_root()
    folder = root / f"{kind}-{key}"

    def found() -> bool:
        if not folder.is_dir():
            return False
        os.utime(folder)
        return True

    if found():
        return folder
    with held(root / f".{kind}.lock", f"the place of {kind}", MAKING_S):
        if found():
            return folder
        # While the lock is held, such a folder can only be a leftover of a killed run.
        for leftover in root.glob(f".{kind}.tmp.*"):
            shutil.rmtree(leftover, ignore_errors=True)
        # In the cache itself, so that the last step is a rename within one file system.
        work = Path(tempfile.mkdtemp(prefix=f".{kind}.tmp.", dir=root))
        try:
            whole = work / "whole"
            whole.mkdir()
            make(whole)
            whole.rename(folder)
            os.utime(folder)
        finally:
            shutil.rmtree(work, ignore_errors=True)
        _sweep(root, kind)
    return folder
