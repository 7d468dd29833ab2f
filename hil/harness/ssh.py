"""Runs commands on a board and copies files, with OpenSSH's client over one shared connection."""

from __future__ import annotations

import shlex
import socket
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

# is_reachable() as a program. Connecting has a limit of 1 s, because a board that is not up does not answer; the caller
# tries again.
GREETING = """
import socket, sys
connection = socket.create_connection((sys.argv[1], int(sys.argv[2])), timeout=1)
connection.settimeout(float(sys.argv[3]))
sys.exit(connection.recv(4) != b"SSH-")
"""


@dataclass(frozen=True)
class Ran:
    """Result of a command. `status` is its exit status, or 255 if ssh could not reach the board."""
    status: int
    out: str
    err: str


class CommandFailed(Exception):
    """A command failed that had to succeed; the text has the end of its output."""


def _status(command: Sequence[str], timeout_s: float) -> int:
    """The exit status of a command without input and output."""
    return subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                          timeout=timeout_s, check=False).returncode


def _run(command: Sequence[str], timeout_s: float, what: str, text: str | None = None) -> Ran:
    """Runs a command with `text` as its input. Raises TimeoutError, which names `what`."""
    try:
        done = subprocess.run(command, input=text, stdin=subprocess.DEVNULL if text is None else None,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace",
                              timeout=timeout_s, check=False)
    except subprocess.TimeoutExpired as error:
        raise TimeoutError(f"waited {timeout_s:g} s for {what}") from error
    return Ran(done.returncode, done.stdout, done.stderr)


class Ssh:
    """Runs commands as root. `before`: prefix of the client's command line (for a network namespace)."""

    def __init__(self, address: tuple[str, int], key: Path, host_key: Path, folder: Path,
                 before: Sequence[str] = ()) -> None:
        self.address = address
        self._before = list(before)
        known = folder / "known_hosts"
        kind, public = host_key.with_suffix(".pub").read_text(encoding="ascii").split()[:2]
        known.write_text(f"board {kind} {public}\n", encoding="ascii")
        self._options = [
            "-F", "none", "-i", str(key), "-o", "IdentitiesOnly=yes", "-o", "BatchMode=yes", "-o", "LogLevel=ERROR",
            "-o", f"UserKnownHostsFile={known}", "-o", "HostKeyAlias=board", "-o", "StrictHostKeyChecking=yes",
            "-o", "GSSAPIAuthentication=no", "-o", "ConnectTimeout=30",
            # Detects a lost board within half a minute instead of two hours.
            "-o", "ServerAliveInterval=10", "-o", "ServerAliveCountMax=3",
            "-o", "ControlMaster=auto", "-o", f"ControlPath={folder}/ssh.sock", "-o", "ControlPersist=600"]

    def command(self, remote: Sequence[str] = (), *, terminal: bool = False) -> list[str]:
        """The client's complete command line. A `remote` of several words is quoted, so that it arrives as these
        words."""
        host, port = self.address
        text = [remote[0]] if len(remote) == 1 else [shlex.join(remote)] if remote else []
        return [*self._before, "ssh", *self._options, *(["-t"] if terminal else []), "-p", str(port), f"root@{host}",
                *text]

    def is_reachable(self, timeout_s: float = 15.0) -> bool:
        """Whether an ssh server sends its identification at the port. This costs the board less than a login. The limit
        is generous, because each attempt that is given up costs the server a process."""
        host, port = self.address
        try:
            if self._before:
                # The port is only reachable from within the network namespace.
                program = [*self._before, sys.executable, "-c", GREETING, host, str(port), str(timeout_s)]
                return _status(program, timeout_s + 10) == 0
            with socket.create_connection(self.address, timeout=timeout_s) as connection:
                return connection.recv(4) == b"SSH-"
        except (OSError, subprocess.TimeoutExpired):
            return False

    def run(self, remote: str | Sequence[str], *, timeout_s: float = 60.0, text: str | None = None,
            check: bool = False) -> Ran:
        """Runs a command (a str: with the board's shell) with `text` as its input. Raises TimeoutError after
        `timeout_s` (the command may then still run on the board), and with `check` CommandFailed if its status is not
        0."""
        words = [remote] if isinstance(remote, str) else list(remote)
        # open() has made the shared connection. If this command made it, the connection's background process would
        # inherit stderr, and reading that pipe would end only with the connection.
        ran = _run(self.command(words), timeout_s, f"the board to end: {shlex.join(words)}", text)
        if check and ran.status != 0:
            last = (ran.err.strip() or ran.out.strip())[-1000:]
            raise CommandFailed(f"'{' '.join(words)}' ended with {ran.status}: {last}")
        return ran

    def open(self, timeout_s: float) -> bool:
        """Makes the shared connection. Its output is not read, because the pipes would stay open as long as it does."""
        try:
            return _status(self.command(["true"]), timeout_s) == 0
        except subprocess.TimeoutExpired:
            return False

    def close(self) -> None:
        """Ends the shared connection, if there is one."""
        host, port = self.address
        _status([*self._before, "ssh", *self._options, "-O", "exit", "-p", str(port), f"root@{host}"], 10)

    def _copy(self, source: str, target: str, timeout_s: float) -> None:
        command = [*self._before, "scp", "-q", "-p", "-r", *self._options, "-P", str(self.address[1]), source, target]
        ran = _run(command, timeout_s, f"the copy of {source} to {target}")
        if ran.status != 0:
            raise CommandFailed(f"{source} was not copied to {target}: {ran.err.strip()}")

    def copy_in(self, source: Path, target: str, timeout_s: float = 120.0) -> None:
        """Copies a file or folder of this machine to `target` on the board."""
        self._copy(str(source), f"root@{self.address[0]}:{target}", timeout_s)

    def copy_out(self, source: str, target: Path, timeout_s: float = 120.0) -> None:
        """Copies a file or folder of the board to `target` on this machine."""
        self._copy(f"root@{self.address[0]}:{source}", str(target), timeout_s)
