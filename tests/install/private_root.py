"""A copy of this machine's file system in which packages can be installed without changing the machine."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path


def output_of(*command: str | Path, **options) -> str:
    """stdout and stderr of a command. Raises RuntimeError with both if it fails."""
    done = subprocess.run([str(word) for word in command], text=True, check=False, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **options)
    if done.returncode != 0:
        raise RuntimeError(f"'{' '.join(map(str, command))}' ended with {done.returncode}:\n{done.stdout}")
    return done.stdout


def enter_mount_namespace() -> str:
    """Starts this program again in a mount namespace of its own, so that its mounts end with it. Returns at once in the
    new program, with an empty text, or with the reason why this process may not mount."""
    if os.environ.get("LIGHTWELL_MOUNT_NAMESPACE") == str(os.getppid()):
        return ""
    if os.geteuid() != 0:
        return "only root may mount and install packages"
    unshare = ["unshare", "--mount", "--propagation", "private"]
    if subprocess.run([*unshare, "mount", "-t", "tmpfs", "tmpfs", "/mnt"], check=False, capture_output=True).returncode:
        return "this machine does not permit mounts"
    # By a child: the process that ctest has started stays the one that it waits for.
    environment = os.environ | {"LIGHTWELL_MOUNT_NAMESPACE": str(os.getpid())}
    sys.exit(subprocess.run([*unshare, sys.executable, *sys.argv], env=environment, check=False).returncode)


class PrivateRoot:
    """The root file system below a tmpfs that takes all writes. Other file systems of the machine are not in it."""

    def __enter__(self) -> PrivateRoot:
        self._folder = tempfile.TemporaryDirectory()
        base = Path(self._folder.name)
        output_of("mount", "-t", "tmpfs", "-o", "mode=755", "tmpfs", base)
        for name in ("upper", "work", "root"):
            (base / name).mkdir()
        self.path = base / "root"
        output_of("mount", "-t", "overlay", "overlay", self.path,
                  "-o", f"lowerdir=/,upperdir={base}/upper,workdir={base}/work")
        output_of("mount", "-t", "proc", "proc", self.path / "proc")
        output_of("mount", "--rbind", "/dev", self.path / "dev")
        output_of("mount", "-t", "tmpfs", "tmpfs", self.path / "tmp")
        return self

    def __exit__(self, *_) -> None:
        output_of("umount", "--recursive", "--lazy", self._folder.name)
        self._folder.cleanup()

    def command(self, *words: str | Path) -> list[str]:
        """The command line that runs `words` in this root."""
        return ["env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL=C.UTF-8", "HOME=/root",
                "DEBIAN_FRONTEND=noninteractive", "chroot", str(self.path), *map(str, words)]

    def run(self, *words: str | Path) -> str:
        return output_of(*self.command(*words))
