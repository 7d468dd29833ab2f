"""Things that are made once and kept by the content of what they were made from.

cache_root()   where they are
digest()       the name of a content
kept()         finds a folder of that name or makes it: whole or absent, one maker at a time
"""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from .locks import held

DAYS_KEPT = 30
MOST_KEPT = 4
# Longer than the slowest maker needs on a busy machine.
MAKING_S = 1800.0


def cache_root() -> Path:
    """The folder that cmake/sysroot_aarch64 and cmake/fetch_panoramas use as well; made where it is missing."""
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
    """Twelve hex digits. A str counts as itself; a Path as its content: a file's bytes and whether it may be executed,
    a folder's tree of those with names. Times and owners do not count."""
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
    """Removes what was not asked for lately, and of the rest all but the few that were asked for last."""
    folders = sorted(
        (folder for folder in root.glob(f"{kind}-*") if folder.is_dir()), key=lambda folder: -folder.stat().st_mtime
    )
    oldest = time.time() - DAYS_KEPT * 24 * 3600
    for place, folder in enumerate(folders):
        if place >= MOST_KEPT or folder.stat().st_mtime < oldest:
            shutil.rmtree(folder, ignore_errors=True)


def kept(kind: str, key: str, make: Callable[[Path], None], root: Path | None = None) -> Path:
    """The folder KIND-KEY of the cache. Where it is missing, `make` fills an empty folder, which gets that name when
    `make` has returned: a run that is killed or fails leaves nothing that could be taken for whole. Of a kind, the four
    folders stay that were asked for last, none for longer than 30 days."""
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
        # Under the lock, such a folder is what a killed run left.
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
