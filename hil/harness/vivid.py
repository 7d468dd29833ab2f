"""Loopback of the kernel's vivid driver: a camera on the board that delivers the frames written to its output."""

from __future__ import annotations

import re
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import recording
from .board import Board
from .runner import TestFailure
from .waits import wait_for

# The formats that pass through it and that the simulated sensor renders: V4L2's codes by lightwelld's names. Of these,
# UVC has only YUYV and NV12.
FOURCC = {"bayer10": "RG10", "bayer12": "RG12", "rgb8": "RGB3", "yuyv": "YUYV", "nv12": "NV12"}
PICTURES = 12
_FEEDER = "vivid-feeder"
_FILE = "/run/vivid.raw"


def render(daemon: Path, camera: Any) -> tuple[str, list[bytes]]:
    """The calibration in text form and PICTURES consecutive frames of the scene of a Vivid entry of the roster, from
    this machine's lightwelld."""
    with tempfile.TemporaryDirectory(prefix="lightwell-vivid-") as folder:
        file, said = Path(folder) / "frames.lwr", Path(folder) / "said"
        command = [daemon, "--camera", f"{camera.scene}&sensor={camera.format}&frames={PICTURES}",
                   "--listen", "127.0.0.1:0", "--size", f"{camera.width}x{camera.height}", "--frame-rate", "30",
                   "--record", file]
        with open(said, "wb") as log, subprocess.Popen(command, stdout=log, stderr=log) as child:
            def enough() -> bool:
                if child.poll() is not None:
                    raise TestFailure(f"lightwelld ended: {said.read_text(encoding='utf-8')}")
                # Every format has at least one byte per pixel.
                return file.exists() and file.stat().st_size > 4 * PICTURES * camera.width * camera.height

            try:
                wait_for("pictures to be rendered", enough, 120, every_s=0.1)
            finally:
                child.terminate()
        calibration, frames = recording.read(file)
    pictures = [frame.data for frame in frames[:PICTURES]]
    if len(set(pictures)) != PICTURES:
        raise TestFailure(f"of {len(pictures)} frames of {camera.scene} only {len(set(pictures))} differ: frames "
                          "cannot be identified")
    return calibration, pictures


class VividLoop:
    """Plays `pictures` repeatedly through the loopback on a board. `device`: the capture device; `rate`: its frame rate
    in frames per second."""

    def __init__(self, board: Board, camera: Any, pictures: Sequence[bytes]) -> None:
        self.device, self.rate = "", 0.0
        self._board = board
        self._camera = camera
        self._pictures = pictures

    def __enter__(self) -> VividLoop:
        # HDMI on both sides: the loopback needs the same kind of connector, size, format and timings.
        if self._board.run("modprobe vivid n_devs=1 node_types=0x101 num_inputs=1 input_types=3 num_outputs=1 "
                           "output_types=1").status:
            raise TestFailure("the board's kernel has no vivid")
        try:
            self._start()
        except BaseException:
            self._end()
            raise
        return self

    def _node(self, name: str) -> str:
        found = self._board.run(f"grep -lx {name} /sys/class/video4linux/video*/name", check=True).out.split()
        return "/dev/" + Path(found[0]).parent.name

    def _start(self) -> None:
        self.device, output = self._node("vivid-000-vid-cap"), self._node("vivid-000-vid-out")
        size = f"width={self._camera.width},height={self._camera.height}"
        shape = f"{size},pixelformat={FOURCC[self._camera.format]}"
        with tempfile.NamedTemporaryFile(prefix="lightwell-vivid-") as file:
            for picture in self._pictures:
                file.write(picture)
            file.flush()
            self._board.copy_in(Path(file.name), _FILE)
        # osd_text_mode 2: without the text that the driver otherwise draws into each frame.
        self._board.run(
            f"for d in {self.device} {output}; do v4l2-ctl -d $d --set-dv-bt-timings cvt,{size},fps=60 || exit 1; "
            "done; "
            f"v4l2-ctl -d {self.device} --set-ctrl=osd_text_mode=2,loop_video=1 --set-fmt-video={shape} && "
            f"v4l2-ctl -d {output} --set-fmt-video-out={shape} && "
            f"systemd-run --quiet --collect --unit={_FEEDER} -p StandardOutput=null -p StandardError=null "
            f"v4l2-ctl -d {output} --stream-out-mmap=4 --stream-from={_FILE} --stream-loop",
            check=True,
        )
        said = self._board.run(f"v4l2-ctl -d {self.device} --get-parm", check=True).out
        self.rate = float(said.split("Frames per second:")[1].split()[0])

    def tool_frame_rate(self, seconds: float = 3) -> float:
        """Frames per second that v4l2-ctl captures, from their sequence numbers. No other program may have the device
        open."""
        capture = f"v4l2-ctl -d {self.device} --stream-mmap=4 --stream-count={seconds * self.rate:.0f} --verbose 2>&1"
        said = self._board.run(capture, check=True, timeout_s=10 * seconds + 30).out
        numbers = [int(number) for number in re.findall(r"seq:\s*(\d+)", said)]
        if len(numbers) < 2:
            raise TestFailure(f"v4l2-ctl captured nothing from vivid: {said[-500:]}")
        return self.rate * (len(numbers) - 1) / (numbers[-1] - numbers[0])

    def drop(self, percent: int) -> None:
        """Makes the driver drop that percentage of its frames at random; their sequence numbers are missing then."""
        self._board.run(f"v4l2-ctl -d {self.device} --set-ctrl=percentage_of_dropped_buffers={percent}", check=True)

    def feeds(self) -> bool:
        """Whether frames are still being written into the loopback."""
        return self._board.run(["systemctl", "is-active", "--quiet", _FEEDER]).status == 0

    def __exit__(self, kind: object, *_: object) -> None:
        if not self._end() and kind is None:
            raise TestFailure("vivid cannot be unloaded: a program has it open")

    def _end(self) -> bool:
        # In this order, because the driver cannot be unloaded while a program has it open.
        unload = f"systemctl stop lightwelld {_FEEDER}; rm -f {_FILE}; modprobe -r vivid"
        return self._board.run(unload, timeout_s=90).status == 0
