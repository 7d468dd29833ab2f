"""A board: a complete arm64 machine emulated by QEMU that runs the firmware as its systemd service.

    board = Board("camera", Options(usb_sockets={"cam0": path}))
    board.start()
    print(board.run("uname -m").out, board.grpc())
    board.power_cut()          # the state disk keeps its content
    board.start()
    board.stop()

Each board has its own folder (runs.py) with its process id and addresses (board.json), the state disk, the serial log
and QEMU's sockets. A board keeps running after the process that started it has ended, unless Options.owned is set.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from . import image, qemu
from .network import GRPC_PORT, PORTS, SSH_PORT, Network, TapNetwork, UserNetwork, kernel_words, network_from
from .processes import Process
from .qemu import Qmp, QmpError
from .runs import BoardError, BoardRecord, remove_stale, runs_folder
from .ssh import Ran, Ssh
from .waits import TimedOut, held, say, wait_for

BOOT_S = 240.0
DOWN_S = 60.0


@dataclass(frozen=True)
class Options:
    """`config`: text of probe.textproto, written when the state disk is created; None: hil/image/probe.textproto."""
    build: Path = image.REPOSITORY / "build/board-aarch64"
    cpus: int = 2
    memory_mb: int = 2048
    state_mb: int = 64
    config: str | None = None
    # "user" (forwarded ports), or "tap" (board and host each have an IP address; needs root).
    net: str = "user"
    # Boards on the same wire can reach each other; each needs a different number.
    wire: str = ""
    number: int = 1
    # Ports of the board that the user network forwards in addition to ssh, gRPC and pairing.
    ports: tuple[int, ...] = ()
    # Sockets of programs that emulate USB devices, by device id. The device counts as plugged in while its program
    # listens.
    usb_sockets: dict[str, Path] = field(default_factory=dict)
    # Additional writable raw disks, by serial number.
    disks: dict[str, Path] = field(default_factory=dict)
    qemu_arguments: tuple[str, ...] = ()
    # Added to the kernel's command line; lightwell.eth1=ADDRESS/BITS is the address of a second network card.
    kernel_words: tuple[str, ...] = ()
    # The board belongs to the process that starts it. If that process is gone, the next start of any board ends the
    # board.
    owned: bool = False


def _content(log: Path) -> str:
    """The text of a log; empty if it cannot be read."""
    with suppress(OSError):
        return log.read_text(encoding="utf-8", errors="replace")
    return ""


class Board:
    """One board, identified by its name; several may run at once. Not thread-safe."""

    def __init__(self, name: str = "board", options: Options | None = None) -> None:
        clone = hashlib.sha256(str(image.REPOSITORY).encode()).hexdigest()[:6]
        self.name = name
        self.options = options or Options()
        self.folder = runs_folder() / f"{clone}-{name}"
        self._record = BoardRecord(self.folder)
        self._child: subprocess.Popen[bytes] | None = None
        self._ssh: Ssh | None = None

    def __enter__(self) -> Board:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    # --- state

    @property
    def serial_log(self) -> Path:
        return self.folder / "serial.log"

    @property
    def state_disk(self) -> Path:
        return self.folder / "state.ext4"

    def process(self) -> Process | None:
        """QEMU's process; None if the board does not run."""
        if self._child is not None:
            self._child.poll()  # Reaps QEMU if it has ended.
        record = self._record.load()
        if record is None:
            return None
        process = Process(record["pid"], record["began"])
        return process if process.is_alive() else None

    def running(self) -> bool:
        return self.process() is not None

    def network(self) -> Network:
        """The network of the running board."""
        return network_from(self._need()["network"])

    def _need(self) -> dict[str, Any]:
        record = self._record.load()
        if record is None or self.process() is None:
            raise BoardError(f"the board {self.name} is not running (hil/board up starts it)")
        return record

    def serial_tail(self, lines: int = 20) -> str:
        """The last lines that the board's kernel and systemd printed."""
        return "\n".join(_content(self.serial_log).replace("\r", "").splitlines()[-lines:])

    def _exit_log(self) -> str:
        own = _content(self.folder / "qemu.log").strip()
        return "\n".join(text for text in (self.serial_tail(), own) if text)

    def status(self) -> dict[str, Any]:
        """Whether the board runs, its addresses and its hardware, as JSON data."""
        record = self._record.load() or {}
        process = self.process()
        answer: dict[str, Any] = {"name": self.name, "running": process is not None, "folder": str(self.folder)}
        if process is None:
            return answer
        network = network_from(record["network"])
        answer |= {key: record[key] for key in ("pid", "accelerator", "why", "cpus", "memory_mb", "seconds", "network")}
        answer["ssh"] = "{}:{}".format(*network.reach(SSH_PORT))
        answer["grpc"] = self.grpc()
        answer["resident_mb"] = round(process.memory_mb())
        answer["up_s"] = round(time.time() - record["started"], 1)
        return answer

    def grpc(self) -> str:
        """The probe's URI for clients. With a tap network, start the client with host_command()."""
        host, port = self.network().reach(GRPC_PORT)
        return f"grpc://{host}:{port}"

    def host_command(self, command: Sequence[str]) -> list[str]:
        """`command`, extended so that the process it starts on this machine can reach the board."""
        return self.network().host_command(command)

    # --- start and stop

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Holds the lock that lets only one process at a time start or stop the board."""
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with ExitStack() as stack:
            try:
                stack.enter_context(held(self.folder / "lock", f"the switch of the board {self.name}", BOOT_S))
            except TimedOut as error:
                raise BoardError(str(error)) from error
            yield

    def start(self, *, fresh: bool = False, timeout_s: float = BOOT_S) -> None:
        """Starts the board and waits until it answers by ssh; does nothing if it runs already. The state disk keeps its
        content; `fresh` creates a new one. Raises NoQemu, ImageError, NetworkError, or BoardError with the end of the
        board's log."""
        program = qemu.find()
        remove_stale()
        with self._alone():
            if self.running() and not fresh:
                if self._record.load()["seconds"].get("ssh") is None:
                    self._wait_for_ssh(timeout_s)
                return
            self._end()
            base = image.base()
            firmware = image.firmware(self.options.build)
            if fresh or not self.state_disk.exists():
                config = self.options.config
                if config is None:
                    config = (image.SOURCES / "probe.textproto").read_text(encoding="utf-8")
                made = self.folder / "state.new"
                made.unlink(missing_ok=True)
                image.state(made, self.options.state_mb, config)
                made.rename(self.state_disk)
            self.serial_log.unlink(missing_ok=True)
            self._launch(program, base, firmware)
            self._wait_for_ssh(timeout_s)

    def _launch(self, program: str, base: image.Base, firmware: Path) -> None:
        options = self.options
        accelerator, why = qemu.accelerator(program, base)
        network: Network = (TapNetwork(options.wire or self.folder.name, options.number) if options.net == "tap"
                            else UserNetwork(options.number, tuple(dict.fromkeys((*PORTS, *options.ports)))))
        identity = hashlib.sha256(str(self.folder).encode()).hexdigest()[:32]
        qmp_socket = self.folder / "qmp.sock"
        command = qemu.arguments(
            program, accelerator,
            kernel=base.kernel,
            initrd=base.initrd,
            disks=(qemu.Disk(base.disk, "lw-base"), qemu.Disk(firmware, "lw-firmware"),
                   qemu.Disk(self.state_disk, "lw-state", writable=True),
                   *(qemu.Disk(path, serial, writable=True) for serial, path in options.disks.items())),
            kernel_words=(
                qemu.CONSOLE,
                "quiet",
                "loglevel=4",
                "panic=5",
                "cryptomgr.notests",
                "rcupdate.rcu_expedited=1",
                # Starting a process for each of many small events dominates the boot time of an emulated processor.
                "udev.children_max=2",
                f"systemd.machine_id={identity}",
                "systemd.show_status=auto",
                *kernel_words(options.number, self.name),
                *options.kernel_words,
            ),
            network=network.arguments(),
            qmp=qmp_socket,
            serial_log=self.serial_log,
            cpus=options.cpus,
            memory_mb=options.memory_mb,
            usb_sockets=options.usb_sockets,
            extra=options.qemu_arguments,
        )
        network.open()
        try:
            with open(self.folder / "qemu.log", "wb") as log:
                # A separate session, so that the terminal's Ctrl-C does not reach QEMU.
                self._child = subprocess.Popen(network.host_command(command), stdin=subprocess.DEVNULL,
                                               stdout=log, stderr=log, start_new_session=True)
            process = Process.of(self._child.pid)
            record = {
                "name": self.name,
                "pid": self._child.pid,
                "began": process.began if process else 0,
                "started": time.time(),
                "accelerator": accelerator,
                "why": why,
                "cpus": options.cpus,
                "memory_mb": options.memory_mb,
                "network": network.describe(),
                "seconds": {},
            }
            if options.owned:
                owner = Process.current()
                record["owner"] = {"pid": owner.pid, "began": owner.began}
            self._record.save(record)

            def connect() -> bool:
                self._raise_if_exited()
                try:
                    with Qmp(qmp_socket) as qmp:
                        network.learn(qmp)
                except QmpError:
                    if qmp_socket.exists() and self.running():
                        raise
                    return False
                return True

            wait_for("QEMU to open its socket", lambda: qmp_socket.exists() and connect(), 30, every_s=0.05,
                     state=self._exit_log)
            self._record.save(record | {"network": network.describe()})
        except (OSError, QmpError, TimedOut) as error:
            last = self._exit_log()
            self._end()
            raise BoardError(f"the board {self.name} did not start: {error}\n{last}") from error
        except BaseException:
            self._end()
            raise

    def _raise_if_exited(self) -> None:
        if not self.running():
            raise BoardError(f"the board {self.name} powered off unexpectedly; the end of its log:\n{self._exit_log()}")

    def _wait_for_ssh(self, timeout_s: float) -> None:
        record = self._need()
        ssh = self.ssh()

        def poll() -> bool:
            self._raise_if_exited()
            return ssh.is_reachable() and ssh.open(60)

        try:
            wait_for(f"the board {self.name} to answer by ssh", poll, timeout_s, state=lambda: self.serial_tail(1))
        except TimedOut as error:
            raise BoardError(f"{error}; complete log: {self.serial_log}") from error
        record["seconds"]["ssh"] = round(time.time() - record["started"], 2)
        self._record.save(record)

    def _end(self) -> None:
        """Kills the board's QEMU if it runs, and removes its network, its record and its sockets."""
        record = self._record.load()
        if record is not None and (self.folder / "ssh.sock").exists():
            # Otherwise the ssh client that holds the shared connection waits for a board that is gone.
            self.ssh().close()
        self._ssh = None
        process = self.process()
        if process is not None:
            process.kill()
        if self._child is not None:
            self._child.wait(10)
            self._child = None
        if record is not None:
            network_from(record["network"]).close()
        for name in ("board.json", "qmp.sock", "ssh.sock"):
            (self.folder / name).unlink(missing_ok=True)

    def stop(self, timeout_s: float = DOWN_S) -> bool:
        """Shuts the board down with systemctl. After `timeout_s` QEMU is killed, and the result is False."""
        with self._alone():
            if not self.running():
                self._end()
                return True
            clean = True
            try:
                self.ssh().run("systemctl poweroff --no-block", timeout_s=min(30.0, timeout_s))
                wait_for(f"the board {self.name} to switch off", lambda: not self.running(), timeout_s,
                         state=lambda: self.serial_tail(1))
            except (TimeoutError, TimedOut) as error:
                say(f"{error}; killing QEMU")
                clean = False
            self._end()
            return clean

    def power_cut(self) -> None:
        """Kills QEMU, which simulates a power failure. Data that the board had flushed to its disk stays, the rest is
        lost."""
        with self._alone():
            process = self.process()
            if process is not None:
                process.kill()
            self._end()

    def remove(self) -> None:
        """Kills the board and removes its folder, with its state disk and log."""
        self.power_cut()
        shutil.rmtree(self.folder, ignore_errors=True)

    # --- commands and files

    def ssh(self) -> Ssh:
        """The ssh client of the board."""
        if self._ssh is None:
            record = self._record.load()
            if record is None:
                raise BoardError(f"the board {self.name} is not running (hil/board up starts it)")
            network = network_from(record["network"])
            known = image.keys()
            self._ssh = Ssh(network.reach(SSH_PORT), known.client, known.host, self.folder, network.host_command(()))
        return self._ssh

    def run(self, command: str | Sequence[str], *, timeout_s: float = 60.0, text: str | None = None,
            check: bool = False) -> Ran:
        """See Ssh.run."""
        self._need()
        return self.ssh().run(command, timeout_s=timeout_s, text=text, check=check)

    def copy_in(self, source: Path, target: str, timeout_s: float = 120.0) -> None:
        """Copies a file or folder of this machine to `target` on the board."""
        self._need()
        self.ssh().copy_in(source, target, timeout_s)

    def copy_out(self, source: str, target: Path, timeout_s: float = 120.0) -> None:
        """Copies a file or folder of the board to `target` on this machine."""
        self._need()
        self.ssh().copy_out(source, target, timeout_s)

    def wait_for_service(self, unit: str = "lightwelld.service", timeout_s: float = 180.0) -> float:
        """Waits until systemd reports `unit` as active; lightwelld becomes active when it serves. Returns the time from
        the kernel's start to that moment in seconds of the board's clock. Raises BoardError with the end of the unit's
        journal."""
        shown: dict[str, str] = {}
        restarts: list[int] = []

        def poll() -> bool:
            self._raise_if_exited()
            done = self.run(["systemctl", "show", unit, "-p",
                             "ActiveState,SubState,ActiveEnterTimestampMonotonic,NRestarts"])
            shown.update(line.split("=", 1) for line in done.out.splitlines() if "=" in line)
            restarts.append(int(shown.get("NRestarts", "0")))
            # A unit that was restarted three times is not expected to recover.
            if restarts[-1] >= restarts[0] + 3:
                raise TimedOut(f"{unit} on the board {self.name} failed three times")
            return shown.get("ActiveState") == "active"

        try:
            wait_for(f"{unit} on the board {self.name}", poll, timeout_s, every_s=0.5,
                     state=lambda: " ".join(f"{key}={value}" for key, value in shown.items()))
        except TimedOut as error:
            journal = self.run(["journalctl", "-u", unit, "-n", "20", "--no-pager", "-o", "cat"]).out
            raise BoardError(f"{error}\n{journal}") from error
        return int(shown["ActiveEnterTimestampMonotonic"]) / 1e6

    def write_config(self, text: str, timeout_s: float = 180.0) -> None:
        """Replaces lightwelld's configuration by `text` and restarts lightwelld. Returns when it serves."""
        self.run("cat > /etc/lightwell/probe.textproto.new && mv /etc/lightwell/probe.textproto.new "
                 "/etc/lightwell/probe.textproto", text=text, check=True)
        begun = time.monotonic()
        # This call returns when the service is ready or has failed. Polling by ssh would compete with it for the
        # processor.
        self.run(f"timeout {timeout_s:.0f} systemctl restart lightwelld", timeout_s=timeout_s + 30)
        self.wait_for_service(timeout_s=max(1.0, begun + timeout_s - time.monotonic()))

    # --- QEMU's control protocol

    def qmp(self, command: str, /, **arguments: Any) -> Any:
        """Runs one QMP command in a session of its own and returns its result."""
        self._need()
        with Qmp(self.folder / "qmp.sock") as session:
            return session.command(command, **arguments)
