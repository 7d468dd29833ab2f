"""The test fixture of hil/cases: a board with its firmware, simulated cameras and clients."""

from __future__ import annotations

import json
import os
import platform
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import qemu
from .board import Board, Options
from .image import NotBuilt, build_for_board, build_for_host
from .processes import output_of
from .runner import CannotRun, TestFailure
from .waits import wait_for
from .watcher import Watcher, WatcherHere

# The firmware's counters of frames.
COUNTERS = ("frames", "frames_lost", "estimates", "estimates_failed", "captures_dropped")
# The camera's counters of frames damaged by injected faults.
_DAMAGED = ("torn", "shortened", "marked")
# Thread pools of gRPC 1.51, by the thread names that the kernel shows. Executor threads are kept, at most two per core.
# The event engine has one thread per core and at least two, and starts one more per second while all are busy, which
# ends after 30 s without work. gRPC does not limit these; the tests apply the executors' limit to them, too.
_EXECUTORS = ("default-executo", "resolver-execut")
_ENGINE = "event_engine"
_REST_S = 1.8
# Time for frames in flight to pass kernel, firmware, network and client after the camera has stopped sending.
_UNDER_WAY_S = 0.5


class UsbCamera:
    """One process of lightwell-usb-camera, the simulated USB camera, which runs outside of the guest. `redir`: the
    usb-redir socket that it creates, one of the board's Options.usb_sockets."""

    def __init__(self, program: Path, redir: Path, scene: str, arguments: Sequence[str] = ()) -> None:
        self.redir = redir
        self._folder = tempfile.TemporaryDirectory(prefix="lightwell-camera-")
        self._control = Path(self._folder.name) / "control"
        self._said = Path(self._folder.name) / "log"
        self._command = [str(program), "--redir", str(redir), "--control", str(self._control), "--scene", scene,
                         *arguments]

    def __enter__(self) -> UsbCamera:
        """Starts the camera. Returns when it accepts commands, after it has rendered its frames."""
        self.redir.unlink(missing_ok=True)
        with open(self._said, "wb") as said:
            self._child = subprocess.Popen(self._command, stdin=subprocess.DEVNULL, stdout=said, stderr=said)

        def ready() -> bool:
            if self._child.poll() is not None:
                raise TestFailure(f"{' '.join(self._command)} ended at once: {self.log_tail()}")
            return self._control.exists() and self.redir.exists()

        wait_for("the camera to render ahead", ready, 180, every_s=0.05, state=self.log_tail)
        return self

    def __exit__(self, *_: object) -> None:
        """Ends the camera's process and removes its socket: the board sees it unplugged."""
        self._child.terminate()
        try:
            self._child.wait(10)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        self.redir.unlink(missing_ok=True)
        self._folder.cleanup()

    def log_tail(self) -> str:
        """The end of its log."""
        return self._said.read_text(encoding="utf-8", errors="replace").strip()[-500:] if self._said.exists() else ""

    def command(self, name: str, **values: Any) -> dict[str, Any]:
        """Sends a command (hil/README.md lists them) and returns the response. Raises TestFailure if it is rejected."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as control:
            control.settimeout(20)
            control.connect(str(self._control))
            control.sendall((json.dumps({"command": name, **values}) + "\n").encode())
            with control.makefile(encoding="utf-8") as lines:
                answer: dict[str, Any] = json.loads(lines.readline())
        if not answer.get("ok"):
            raise TestFailure(f"the camera rejected {name}: {answer.get('error')}")
        return answer

    def counters(self) -> dict[str, Any]:
        """Its counters since its start or `reset_counters`."""
        return self.command("counters")


@dataclass(frozen=True)
class Tools:
    """Folders of the source tree, of this machine's programs and of the board's build."""
    root: Path
    host: Path
    board: Path

    def facts(self) -> dict[str, str]:
        cores = os.cpu_count()
        return {"host": f"{platform.machine()}, {cores} cores, Linux {platform.release()}"}

    def report_command(self, recording: Path, scene: str, camera: Any, exposures: Sequence[str],
                       *more: str | Path) -> list[str]:
        """The command that compares a recording with the true light of its scene: see hil/report/main.cpp."""
        words = [self.host / "demo_report", "--recording", recording, "--camera", scene, "--width", camera.width,
                 "--height", camera.height, "--frame-rate", camera.frame_rate, *more]
        for exposure in exposures:
            words += ["--exposure-s", exposure]
        return [str(word) for word in words]


def prepare(root: Path, built: tuple[Path, Path] | None = None) -> Tools:
    """Builds the programs of host and board, which takes minutes the first time. `built`: build folders of host and
    board to use as they are instead. Raises CannotRun if QEMU is not installed or `built` lacks a program; NotBuilt if
    a build fails."""
    try:
        qemu.find()
    except qemu.NoQemu as why:
        raise CannotRun(str(why)) from why
    os.environ["LIGHTWELL_PANORAMA_DIR"] = panoramas = output_of([root / "cmake/fetch_panoramas"], NotBuilt).strip()
    host, board = built or (root / "build/dev", root / "build/board-aarch64")
    if built:
        for program in (host / "bin/lightwell-usb-camera", board / "bin/lightwelld"):
            if not program.exists():
                raise CannotRun(f"{program} is not built: tests/run builds it")
        return Tools(root, host / "bin", board)
    build_for_host(host, Path(panoramas))
    build_for_board(board)
    return Tools(root, host / "bin", board)


@contextmanager
def open_rig(board: Any, roster: Any, tools: Tools, peer: Any | None = None) -> Iterator[Rig]:
    """Starts the board, and a second one on the same wire if `peer` is given; ends both on exit."""
    kind = board.WhichOneof("kind")
    if kind != "qemu":
        raise CannotRun(f"the bench {board.name} ({board.bench.ssh}) is not attached to this machine")
    with tempfile.TemporaryDirectory(prefix="lightwell-rig-") as folder, ExitStack() as stack:
        socket = Path(folder) / "cam0"
        machine = _start_board(board, tools, stack, usb_sockets={"cam0": socket})
        second = None
        if peer is not None:
            second = _start_board(peer, tools, stack, wire=machine.folder.name, number=2)
            # The peer's firmware would be a second probe and would compete with the first for the host's processors.
            second.run("systemctl mask --runtime --now lightwelld", check=True)
        yield Rig(machine, socket, roster, tools, Path(folder), second)


def _start_board(board: Any, tools: Tools, stack: ExitStack, **more: Any) -> Board:
    """Starts the board of a roster entry with a new state disk; `stack` ends it. `more`: further Options."""
    options = Options(build=tools.board, cpus=board.qemu.cpus or 2, memory_mb=board.qemu.memory_mb or 2048,
                      net=board.qemu.net or "user", owned=True, **more)
    machine = Board(f"hil-{board.name}", options)
    # Registered before the start, because QEMU may run although start() fails. A power cut is enough: the next board
    # has a new state disk, and board.costs measures the regular shutdown.
    stack.callback(machine.power_cut)
    machine.start(fresh=True)
    return machine


def processed_frames(grown: Mapping[str, float]) -> float:
    """The number of received frames whose outcome the firmware has counted: estimated, dropped for a newer frame, or
    failed. `grown`: increments of the counters."""
    return grown["estimates"] + grown["captures_dropped"] + grown["estimates_failed"]


class Rig:
    """One board with its cameras and clients. `peer`: the second board on its wire, if the test has one."""

    def __init__(self, board: Board, socket: Path, roster: Any, tools: Tools, folder: Path,
                 peer: Board | None = None) -> None:
        self.board = board
        self.peer = peer
        self.tools = tools
        self.folder = folder
        self._socket = socket
        self._cameras = {camera.name: camera for camera in roster.camera}

    # --- cameras

    def camera_entry(self, name: str) -> Any:
        """The roster entry of a camera."""
        return self._cameras[name]

    @contextmanager
    def usb_camera(self, name: str, *, scene: str = "", arguments: Sequence[str] = ()) -> Iterator[UsbCamera]:
        """A simulated camera of the roster, plugged in until exit. Waits until the board has its video device, and on
        exit until that is gone."""
        camera = self._cameras[name].usb_simulated
        program = self.tools.host / "lightwell-usb-camera"
        with UsbCamera(program, self._socket, scene or camera.scene, arguments) as running:
            self.wait_for_video()
            yield running
        self.wait_for_no_video()

    def video_devices(self) -> list[str]:
        """Device nodes of USB cameras that deliver frames. Each camera has a second node for metadata, which is left
        out."""
        found = self.board.run(
            "for d in /sys/class/video4linux/video*; do [ -e $d ] && readlink -f $d/device/driver | grep -q uvc "
            "&& [ $(cat $d/index) = 0 ] && basename $d; done; true"
        ).out
        return sorted(f"/dev/{name}" for name in found.split())

    def wait_for_video(self, limit_s: float = 60) -> str:
        """Waits until udev has made a device node, and returns it."""
        return wait_for("uvcvideo's device", lambda: self.video_devices() or None, limit_s, every_s=0.3)[0]

    def wait_for_no_video(self, limit_s: float = 60) -> None:
        wait_for("the camera's device to go", lambda: not self.video_devices(), limit_s, every_s=0.3)

    def camera_calibration(self, scene: str, what: str) -> str:
        """The calibration of a simulated camera in text form; `what` is WIDTHxHEIGHT:FORMAT."""
        return output_of([self.tools.host / "lightwell-usb-camera", "--scene", scene, "--calibration", what],
                         TestFailure)

    # --- the firmware

    def configure(self, camera: str, *, more: str = "", grpc: str = "security: LINK_SECURITY_PLAIN",
                  timeout_s: float = 240) -> str:
        """Restarts lightwelld with `camera` (text of a CameraConfig), `grpc` (of a GrpcConfig) and `more` fields of the
        configuration. Returns the URI for clients when it serves."""
        self.board.write_config(f'probe_name: "board"\ncamera {{ {camera} }}\n'
                                f'grpc {{ listen_address: "0.0.0.0:7420" {grpc} }}\n' + more, timeout_s)
        return self.board.grpc()

    def daemon(self) -> dict[str, int]:
        """State of lightwelld's process: `pid`, resident memory (`rss_kb`) and its anonymous part (`own_kb`) in KiB,
        `threads` without gRPC's pools, open file descriptors (`handles`), and `restarts` by systemd."""
        shown = self.board.run(
            "p=$(systemctl show -p MainPID --value lightwelld); echo pid $p; "
            "systemctl show -p NRestarts lightwelld | sed 's/NRestarts=/restarts /'; "
            "sed -n 's/^VmRSS:/rss_kb/p; s/^RssAnon:/own_kb/p' /proc/$p/status; "
            f"echo threads $(cat /proc/$p/task/*/comm | grep -vcxE '{'|'.join((*_EXECUTORS, _ENGINE))}'); "
            "echo handles $(ls /proc/$p/fd | wc -l)",
            check=True,
        ).out
        return {name: int(value) for name, value, *_ in (line.split() for line in shown.splitlines())}

    def pool_threads(self) -> dict[str, tuple[int, int]]:
        """For each of gRPC's thread pools in lightwelld: its number of threads, and the limit of that number."""
        shown = self.board.run("nproc --all; cat /proc/$(pidof lightwelld)/task/*/comm", check=True).out.split("\n")
        bound = 2 * int(shown[0])
        return {name: (shown.count(name), bound) for name in (*_EXECUTORS, _ENGINE)}

    def snapshot(self, camera: UsbCamera, uri: str) -> dict[str, float]:
        """Counters of camera and firmware with the time of the query ("at"). They are read by two queries, one directly
        after the other. Frames that an injected fault withheld do not count as dropped by the camera."""
        at = time.monotonic()
        counts = camera.counters()["counters"]
        info = self.info(uri)
        dropped = sum(counts[name] for name in ("busy", "replaced", "unrendered", "aborted"))
        damaged = sum(counts[name] for name in _DAMAGED)
        return {"at": at, "sent": counts["sent"] + damaged, "camera_dropped": dropped, "damaged": damaged,
                **{name: info[name] for name in COUNTERS}}

    def at_rest(self, camera: UsbCamera, uri: str, watcher: Watcher) -> dict[str, float]:
        """A snapshot while no frame is in flight, so that counters of input and output can be compared; adds the
        client's counts ("arrived", "missing"). The camera sends nothing from "at" until "until", which is less than the
        2 s after which the firmware restarts it; returns afterwards. Repeated, four times at most, if this machine was
        too busy."""
        streams: Callable[[], int] = lambda: camera.counters()["counters"]["streams"]
        for _ in range(4):
            before = streams()
            camera.command("silence", seconds=_REST_S)
            begun = time.monotonic()
            time.sleep(_UNDER_WAY_S)
            known = len(watcher.seconds())
            counters = self.snapshot(camera, uri)
            # The client's report of the second with the last frames must be complete before the next frames arrive.
            lines = wait_for("the client's second to end",
                             lambda: watcher.seconds() if len(watcher.seconds()) > known else None, 10, every_s=0.05)
            late = time.monotonic() - begun
            watcher.wait_for("light after the rest", 60, since=len(lines))
            if late <= _REST_S and streams() == before:
                return counters | {"at": begun, "until": begun + _REST_S, "missing": lines[-1]["gaps"],
                                   "arrived": sum(line["frames"] for line in lines)}
        raise TestFailure(f"four snapshots of a silent camera took more than {_REST_S} s each, or the firmware "
                          "restarted the camera: this machine is too busy")

    def idle_percent(self, seconds: float) -> float:
        """Percentage of the board's processor time that is idle over `seconds`. lightwelld must be running."""
        stat = "head -1 /proc/stat"
        shown = self.board.run(f"pidof lightwelld >/dev/null && {stat} && sleep {seconds} && {stat}", check=True,
                               timeout_s=seconds + 60).out
        first, second = ([int(word) for word in line.split()[1:]] for line in shown.splitlines())
        grown = [b - a for a, b in zip(first, second)]
        return 100 * (grown[3] + grown[4]) / max(1, sum(grown))

    def wait_for_recorded(self, frames: int, limit_s: float = 120) -> None:
        """Waits until lightwelld has recorded so many frames."""
        uri = self.board.grpc()
        wait_for(f"{frames} frames to be recorded", lambda: self.info(uri)["frames_recorded"] >= frames, limit_s,
                 every_s=1)

    # --- clients, as separate processes outside of the board

    def client(self, words: Sequence[str], *, timeout_s: float = 90, good: Collection[int] = (0,),
               environment: Mapping[str, str] | None = None) -> str:
        """The output of `lightwell` with these arguments. Raises TestFailure if its exit status is not in `good`, or it
        does not end within `timeout_s`."""
        command = self.board.host_command([str(self.tools.host / "lightwell"), *words])
        try:
            done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=timeout_s,
                                  env={**os.environ, **(environment or {})})
        except subprocess.TimeoutExpired as error:
            raise TestFailure(f"{' '.join(words)} did not end within {timeout_s:.0f} s") from error
        if done.returncode not in good:
            journal = self.board.run("journalctl -u lightwelld -n 15 --no-pager -o cat").out
            raise TestFailure(f"lightwell {' '.join(words)} ended with {done.returncode}: {done.stderr.strip()}\n"
                              f"{journal}")
        return done.stdout

    def watch(self, uri: str, seconds: float, environment: Mapping[str, str] | None = None) -> dict[str, Any]:
        """The summary of `lightwell watch --json`."""
        words = ["watch", uri, "--seconds", str(seconds), "--json"]
        return json.loads(self.client(words, timeout_s=seconds + 60, environment=environment).splitlines()[-1])

    @contextmanager
    def watcher(self, uri: str) -> Iterator[Watcher]:
        """`lightwell watch` as a background process."""
        command = self.board.host_command([str(self.tools.host / "lightwell"), "watch", uri, "--json"])
        with WatcherHere(command) as running:
            yield running

    def record(self, uri: str, seconds: float, file: Path) -> None:
        """Records descriptors into a new file; an existing file is deleted first, because it would be continued."""
        file.unlink(missing_ok=True)
        self.client(["record", uri, str(file), "--seconds", str(seconds)], timeout_s=seconds + 60)

    def record_all(self, seconds: float, *probes: tuple[str, Path]) -> None:
        """Records probes at the same time: the URI of each, and its file."""
        with ThreadPoolExecutor() as clients:
            for recorded in [clients.submit(self.record, uri, seconds, file) for uri, file in probes]:
                recorded.result()

    def info(self, uri: str) -> dict[str, Any]:
        """The probe's identity and counters."""
        return json.loads(self.client(["info", uri, "--json", "--no-map"]))

    # --- firmware on this machine ("desktop"), and evaluation programs

    @contextmanager
    def desktop_daemon(self, camera: str, *words: str | Path) -> Iterator[str]:
        """Runs lightwelld on this machine with that camera and further arguments; yields its URI."""
        with open(self.folder / "desktop.log", "w+", encoding="utf-8") as said, subprocess.Popen(
                [self.tools.host / "lightwelld", "--camera", camera, "--listen", "127.0.0.1:0", *words], stdout=said,
                stderr=subprocess.STDOUT) as child:
            def address() -> str | None:
                text = Path(said.name).read_text(encoding="utf-8")
                if child.poll() is not None:
                    raise TestFailure(f"the desktop's lightwelld ended: {text}")
                found = [line for line in text.splitlines() if line.startswith("lightwelld: listening on ")]
                return found[0].split()[-1] if found else None

            try:
                yield wait_for("the desktop's lightwelld", address, 120, every_s=0.05)
            finally:
                child.terminate()

    def record_here(self, uri: str, seconds: float, file: Path) -> None:
        """As record(), for a probe on this machine."""
        file.unlink(missing_ok=True)
        output_of([self.tools.host / "lightwell", "record", uri, file, "--seconds", str(seconds)], TestFailure)

    def marker_frames(self, folder: Path, pictures: Sequence[str], *, noisy: int, period_s: float) -> None:
        """Converts path-traced images of a marker to frames of a webcam for the replay camera: see
        hil/report/marker_frames_main.cpp."""
        output_of([self.tools.host / "marker_frames", folder, "--picture", ",".join(pictures), "--noisy", str(noisy),
                   "--period-s", str(period_s)], TestFailure)

    def book_frames(self, folder: Path, *, frames: int, sequence: int, width: int, height: int,
                    period_s: float) -> None:
        """Renders the first `frames` of a sequence of a glossy book for the replay camera: see
        hil/report/book_frames_main.cpp."""
        output_of([self.tools.host / "book_frames", folder, "--frames", str(frames), "--sequence", str(sequence),
                   "--width", str(width), "--height", str(height), "--period-s", str(period_s)], TestFailure)

    def compare(self, one: Path, other: Path) -> dict[str, float]:
        """Differences between the light of two recordings: see hil/report/compare_main.cpp."""
        return json.loads(output_of([self.tools.host / "compare_recordings", one, other], TestFailure))

    def evaluate(self, recording: Path, scene: str, camera: Any, exposures: Sequence[str] = ()) -> dict[str, float]:
        """Compares a recording with the true light of its scene; returns demo_report's summary."""
        done = subprocess.run(self.tools.report_command(recording, scene, camera, exposures, "--json"),
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if done.returncode > 1:
            raise TestFailure(f"demo_report ended with {done.returncode}: {done.stderr}")
        return json.loads(done.stdout)
