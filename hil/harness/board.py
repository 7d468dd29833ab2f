"""A board: a whole machine of its own, in QEMU, that runs the firmware as an appliance does.

Options      what a board is made of
Board        start, stop, power_cut, remove; run, copy_in, copy_out; qmp; serial_tail; status

    board = Board("camera", Options(usb_sockets={"cam0": path}))
    board.start()
    print(board.run("uname -m").out, board.grpc())
    board.power_cut()          # the state's disk stays as it was
    board.start()
    board.stop()

A board is_alive in a folder of its own (runs.py): pid and addresses (board.json), the state's disk, the serial log, QEMU's
sockets. It goes on when the process that started it ends, unless that process said that it owns it (Options.owned).
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from . import image, qemu
from .locks import held
from .network import GRPC_PORT, PORTS, SSH_PORT, Network, TapNetwork, UserNetwork, kernel_words, network_from
from .processes import Process
from .qmp import Qmp, QmpError
from .runs import BoardError, BoardRecord, remove_stale, runs_folder
from .ssh import Ran, Ssh
from .waits import TimedOut, say, wait_for

BOOT_S = 240.0
DOWN_S = 60.0


@dataclass(frozen=True)
class Options:
    """`config`: text of probe.textproto for a state disk that is made, None for hil/image/probe.textproto."""
    build: Path = image.REPOSITORY / "build/board-aarch64"
    cpus: int = 2
    memory_mb: int = 2048
    state_mb: int = 64
    config: str | None = None
    # "user", or "tap" for addresses of their own (root).
    net: str = "user"
    # Boards of one wire see each other, and have different numbers.
    wire: str = ""
    number: int = 1
    # More of the board's ports that the user network forwards, beside ssh, gRPC and pairing.
    ports: tuple[int, ...] = ()
    # Programs that are USB devices, by their ids; a socket that nobody listens at yet is a device not plugged in.
    usb_sockets: dict[str, Path] = field(default_factory=dict)
    # More disks, by their serial numbers; writable, raw.
    disks: dict[str, Path] = field(default_factory=dict)
    qemu_arguments: tuple[str, ...] = ()
    # For the kernel's command line; lightwell.eth1=ADDRESS/BITS is the address of a second network card.
    kernel_words: tuple[str, ...] = ()
    # Ends with the process that starts it: at the latest, the next start of any board cleans it up.
    owned: bool = False


class Board:
    """One board by its name; several may run at once. Not for two threads at a time."""

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

    # --- what is known of it

    @property
    def serial_log(self) -> Path:
        return self.folder / "serial.log"

    @property
    def state_disk(self) -> Path:
        return self.folder / "state.ext4"

    def process(self) -> Process | None:
        """QEMU, while it runs."""
        if self._child is not None:
            self._child.poll()  # Or a QEMU that ended would stay as our zombie.
        told = self._record.told()
        if told is None:
            return None
        process = Process(told["pid"], told["began"])
        return process if process.is_alive() else None

    def running(self) -> bool:
        return self.process() is not None

    def network(self) -> Network:
        """How the running board is reached."""
        return network_from(self._need()["network"])

    def _need(self) -> dict[str, Any]:
        told = self._record.told()
        if told is None or self.process() is None:
            raise BoardError(f"the board {self.name} is not running (hil/board up starts it)")
        return told

    def serial_tail(self, lines: int = 20) -> str:
        """The last that the board's kernel and systemd said."""
        try:
            text = self.serial_log.read_text(encoding="utf-8", errors="replace")
        except OSError:
            return ""
        return "\n".join(text.replace("\r", "").splitlines()[-lines:])

    def _exit_log(self) -> str:
        try:
            own = (self.folder / "qemu.log").read_text(encoding="utf-8", errors="replace").strip()
        except OSError:
            own = ""
        return "\n".join(text for text in (self.serial_tail(), own) if text)

    def status(self) -> dict[str, Any]:
        """For people and programs: whether it runs, how it is reached, what it is made of."""
        told = self._record.told() or {}
        process = self.process()
        answer: dict[str, Any] = {"name": self.name, "running": process is not None, "folder": str(self.folder)}
        if process is None:
            return answer
        network = network_from(told["network"])
        answer |= {key: told[key] for key in ("pid", "accelerator", "why", "cpus", "memory_mb", "seconds", "network")}
        answer["ssh"] = "{}:{}".format(*network.reach(SSH_PORT))
        answer["grpc"] = self.grpc()
        answer["resident_mb"] = round(process.memory_mb())
        answer["up_s"] = round(time.time() - told["started"], 1)
        return answer

    def grpc(self) -> str:
        """The probe's address for clients: those of a namespace are started by host_command()."""
        host, port = self.network().reach(GRPC_PORT)
        return f"grpc://{host}:{port}"

    def host_command(self, command: Sequence[str]) -> list[str]:
        """A command of this machine, as it must be started to reach the board."""
        return self.network().host_command(command)

    # --- on and off

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Starting and stopping is done by one process at a time."""
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with ExitStack() as stack:
            try:
                stack.enter_context(held(self.folder / "lock", f"the switch of the board {self.name}", BOOT_S))
            except TimedOut as error:
                raise BoardError(str(error)) from error
            yield

    def start(self, *, fresh: bool = False, timeout_s: float = BOOT_S) -> None:
        """Switches it on and waits until it answers by ssh; nothing where it runs. The state's disk stays as it was
        left, `fresh` makes a new one. Raises NoQemu, ImageError, NetworkError, or BoardError with its last words."""
        program = qemu.find()
        remove_stale()
        with self._alone():
            if self.running() and not fresh:
                if self._record.told()["seconds"].get("ssh") is None:
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
        machine = qemu.Machine(
            program=program,
            accelerator=accelerator,
            kernel=base.kernel,
            initrd=base.initrd,
            disks=(
                qemu.Disk(base.disk, "lw-base"),
                qemu.Disk(firmware, "lw-firmware"),
                qemu.Disk(self.state_disk, "lw-state", writable=True),
                *(qemu.Disk(path, serial, writable=True) for serial, path in options.disks.items()),
            ),
            kernel_words=(
                qemu.CONSOLE,
                "quiet",
                "loglevel=4",
                "panic=5",
                "cryptomgr.notests",
                "rcupdate.rcu_expedited=1",
                # A process for each of many small events at a time is what costs an emulated processor most.
                "udev.children_max=2",
                f"systemd.machine_id={identity}",
                "systemd.show_status=auto",
                *kernel_words(options.number, self.name),
                *options.kernel_words,
            ),
            network=tuple(network.arguments()),
            qmp=self.folder / "qmp.sock",
            serial_log=self.serial_log,
            cpus=options.cpus,
            memory_mb=options.memory_mb,
            usb_sockets=tuple(options.usb_sockets.items()),
            extra=options.qemu_arguments,
        )
        network.open()
        try:
            with open(self.folder / "qemu.log", "wb") as log:
                # A session of its own: the terminal's Ctrl-C is meant for the harness, not for the board.
                self._child = subprocess.Popen(network.host_command(machine.arguments()), stdin=subprocess.DEVNULL,
                                               stdout=log, stderr=log, start_new_session=True)
            process = Process.of(self._child.pid)
            told = {
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
                owner = Process.own()
                told["owner"] = {"pid": owner.pid, "began": owner.began}
            self._record.tell(told)

            def connect() -> bool:
                self._raise_if_exited()
                try:
                    with Qmp(machine.qmp) as qmp:
                        network.learn(qmp)
                except QmpError:
                    if machine.qmp.exists() and self.running():
                        raise
                    return False
                return True

            wait_for("QEMU to open its socket", lambda: machine.qmp.exists() and connect(), 30, every_s=0.05,
                     state=self._exit_log)
            self._record.tell(told | {"network": network.describe()})
        except (OSError, QmpError, TimedOut) as error:
            last = self._exit_log()
            self._end()
            raise BoardError(f"the board {self.name} did not start: {error}\n{last}") from error
        except BaseException:
            self._end()
            raise

    def _raise_if_exited(self) -> None:
        if not self.running():
            raise BoardError(f"the board {self.name} switched itself off; its last words:\n{self._exit_log()}")

    def _wait_for_ssh(self, timeout_s: float) -> None:
        told = self._need()
        ssh = self.ssh()

        def look() -> bool:
            self._raise_if_exited()
            return ssh.is_reachable() and ssh.open(60).status == 0

        try:
            wait_for(f"the board {self.name} to answer by ssh", look, timeout_s, state=lambda: self.serial_tail(1))
        except TimedOut as error:
            raise BoardError(f"{error}; all of it: {self.serial_log}") from error
        told["seconds"]["ssh"] = round(time.time() - told["started"], 2)
        self._record.tell(told)

    def _end(self) -> None:
        """No QEMU of this board runs afterwards."""
        told = self._record.told()
        if told is not None and (self.folder / "ssh.sock").exists():
            # The client that keeps the connection would wait for a board that is gone.
            self.ssh().close()
        self._ssh = None
        process = self.process()
        if process is not None:
            process.kill()
        if self._child is not None:
            self._child.wait(10)
            self._child = None
        if told is not None:
            network_from(told["network"]).close()
        for name in ("board.json", "qmp.sock", "ssh.sock"):
            (self.folder / name).unlink(missing_ok=True)

    def stop(self, timeout_s: float = DOWN_S) -> bool:
        """Switches it off as an owner does, and pulls the plug where that takes longer than `timeout_s`: False then."""
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
                say(f"{error}; pulling the plug")
                clean = False
            self._end()
            return clean

    def power_cut(self) -> None:
        """Kills QEMU, as a plug that is pulled. What the board had handed to its disk is on it, the rest is lost."""
        with self._alone():
            process = self.process()
            if process is not None:
                process.kill()
            self._end()

    def remove(self) -> None:
        """Power cut, and its folder goes with its state and its log."""
        self.power_cut()
        shutil.rmtree(self.folder, ignore_errors=True)

    # --- inside it

    def ssh(self) -> Ssh:
        """The way in."""
        if self._ssh is None:
            told = self._record.told()
            if told is None:
                raise BoardError(f"the board {self.name} is not running (hil/board up starts it)")
            network = network_from(told["network"])
            known = image.keys()
            self._ssh = Ssh(network.reach(SSH_PORT), known.client, known.host, self.folder, network.host_command(()))
        return self._ssh

    def run(
        self, command: str | Sequence[str], *, timeout_s: float = 60.0, text: str | None = None, check: bool = False
    ) -> Ran:
        """See Ssh.run."""
        self._need()
        return self.ssh().run(command, timeout_s=timeout_s, text=text, check=check)

    def copy_in(self, source: Path, target: str, timeout_s: float = 120.0) -> None:
        """A file or folder of this machine into the board."""
        self._need()
        self.ssh().copy_in(source, target, timeout_s)

    def copy_out(self, source: str, target: Path, timeout_s: float = 120.0) -> None:
        """A file or folder of the board to this machine."""
        self._need()
        self.ssh().copy_out(source, target, timeout_s)

    def wait_for_service(self, unit: str = "lightwelld.service", timeout_s: float = 180.0) -> float:
        """Waits until systemd counts `unit` as active: lightwelld, when it serves. Seconds of the board's clock from
        its kernel's start to that moment. Raises BoardError with the unit's last lines."""
        shown: dict[str, str] = {}
        restarts: list[int] = []

        def look() -> bool:
            self._raise_if_exited()
            done = self.run(
                ["systemctl", "show", unit, "-p", "ActiveState,SubState,ActiveEnterTimestampMonotonic,NRestarts"]
            )
            shown.update(line.split("=", 1) for line in done.out.splitlines() if "=" in line)
            restarts.append(int(shown.get("NRestarts", "0")))
            # What has failed three times from its start will not come.
            if restarts[-1] >= restarts[0] + 3:
                raise TimedOut(f"{unit} on the board {self.name} failed three times")
            return shown.get("ActiveState") == "active"

        try:
            wait_for(f"{unit} on the board {self.name}", look, timeout_s, every_s=0.5,
                     state=lambda: " ".join(f"{key}={value}" for key, value in shown.items()))
        except TimedOut as error:
            journal = self.run(["journalctl", "-u", unit, "-n", "20", "--no-pager", "-o", "cat"]).out
            raise BoardError(f"{error}\n{journal}") from error
        return int(shown["ActiveEnterTimestampMonotonic"]) / 1e6

    def write_config(self, text: str, timeout_s: float = 180.0) -> None:
        """Another configuration for lightwelld, which is started anew with it."""
        self.run(
            "cat > /etc/lightwell/probe.textproto.new && mv /etc/lightwell/probe.textproto.new "
            "/etc/lightwell/probe.textproto",
            text=text,
            check=True,
        )
        begun = time.monotonic()
        # Returns when the service is ready or has failed: looks by ssh would take the processor that it starts with.
        self.run(f"timeout {timeout_s:.0f} systemctl restart lightwelld", timeout_s=timeout_s + 30)
        self.wait_for_service(timeout_s=max(1.0, begun + timeout_s - time.monotonic()))

    # --- around it

    def qmp_session(self, timeout_s: float = 10.0) -> Qmp:
        """QEMU's own commands and events; QEMU serves one session at a time, so close it."""
        self._need()
        return Qmp(self.folder / "qmp.sock", timeout_s)

    def qmp(self, command: str, /, **arguments: Any) -> Any:
        """One command of QEMU's."""
        with self.qmp_session() as session:
            return session.command(command, **arguments)
