"""vivid's loop: a camera of the board's own kernel that shows what is written into its output.

FOURCC      formats that go through it and that the product's sensor model renders
render      pictures of a scene, by this machine's lightwelld
VividLoop   the driver, loaded and fed
"""

from __future__ import annotations

import re
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from . import recording
from .board import Board
from .runner import Broken
from .waits import wait_for

# By the names that lightwelld gives them, as V4L2 does. Of these UVC has YUYV and NV12 alone.
FOURCC = {"bayer10": "RG10", "bayer12": "RG12", "rgb8": "RGB3", "yuyv": "YUYV", "nv12": "NV12"}
PICTURES = 12
_FEEDER = "vivid-feeder"
_FILE = "/run/vivid.raw"


def render(daemon: Path, camera: Any) -> tuple[str, list[bytes]]:
    """Calibration, as text, and a dozen pictures that follow each other in the scene of a Vivid entry of the roster."""
    with tempfile.TemporaryDirectory(prefix="lightwell-vivid-") as folder:
        file, said = Path(folder) / "frames.lwr", Path(folder) / "said"
        command = [
            daemon,
            "--camera",
            f"{camera.scene}&sensor={camera.format}&ring={PICTURES}",
            "--listen",
            "127.0.0.1:0",
            "--size",
            f"{camera.width}x{camera.height}",
            "--frame-rate",
            "30",
            "--record",
            file,
        ]
        with (
            open(said, "wb") as log,
            subprocess.Popen([str(word) for word in command], stdout=log, stderr=log) as child,
        ):
            def enough() -> bool:
                if child.poll() is not None:
                    raise Broken(f"lightwelld ended: {said.read_text(encoding='utf-8')}")
                # No format has less than a byte a pixel.
                return file.exists() and file.stat().st_size > 4 * PICTURES * camera.width * camera.height

            try:
                wait_for("pictures to be rendered", enough, 120, every_s=0.1)
            finally:
                child.terminate()
        calibration, frames = recording.read(file)
    pictures = [frame.data for frame in frames[:PICTURES]]
    if len(set(pictures)) != PICTURES:
        raise Broken(
            f"of {len(pictures)} pictures of {camera.scene} {len(set(pictures))} differ: nothing could be told apart"
        )
    return calibration, pictures


class VividLoop:
    """Pictures, one after the other and again and again, through the loop of a board. `device`: whom a camera's reader
    opens; `rate`: how many frames a second the driver makes."""

    def __init__(self, board: Board, camera: Any, pictures: Sequence[bytes]) -> None:
        self.device, self.rate = "", 0.0
        self._board = board
        self._camera = camera
        self._pictures = pictures

    def __enter__(self) -> VividLoop:
        # HDMI on both sides: the loop wants the same kind, size, format and signal.
        if self._board.run(
            "modprobe vivid n_devs=1 node_types=0x101 num_inputs=1 input_types=3 num_outputs=1 output_types=1"
        ).status:
            raise Broken("the board's kernel has no vivid")
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
        # osd_text_mode 2: without the text that the driver writes over each picture.
        self._board.run(
            f"for d in {self.device} {output}; do v4l2-ctl -d $d --set-dv-bt-timings cvt,{size},fps=60 || exit 1; "
            f"done; "
            f"v4l2-ctl -d {self.device} --set-ctrl=osd_text_mode=2,loop_video=1 --set-fmt-video={shape} && "
            f"v4l2-ctl -d {output} --set-fmt-video-out={shape} && "
            f"systemd-run --quiet --collect --unit={_FEEDER} -p StandardOutput=null -p StandardError=null "
            f"v4l2-ctl -d {output} --stream-out-mmap=4 --stream-from={_FILE} --stream-loop",
            check=True,
        )
        said = self._board.run(f"v4l2-ctl -d {self.device} --get-parm", check=True).out
        self.rate = float(said.split("Frames per second:")[1].split()[0])

    def taken_by_the_tool(self, seconds: float = 3) -> float:
        """Frames a second that v4l2-ctl gets, by their numbers; nobody else may have the device open."""
        said = self._board.run(
            f"v4l2-ctl -d {self.device} --stream-mmap=4 --stream-count={seconds * self.rate:.0f} --verbose 2>&1",
            check=True,
            timeout_s=10 * seconds + 30,
        ).out
        numbers = [int(number) for number in re.findall(r"seq:\s*(\d+)", said)]
        if len(numbers) < 2:
            raise Broken(f"v4l2-ctl got nothing of vivid: {said[-500:]}")
        return self.rate * (len(numbers) - 1) / (numbers[-1] - numbers[0])

    def drop(self, percent: int) -> None:
        """So many of the frames that the driver makes are kept by it, at random; their numbers are missing."""
        self._board.run(f"v4l2-ctl -d {self.device} --set-ctrl=percentage_of_dropped_buffers={percent}", check=True)

    def feeds(self) -> bool:
        """Whether pictures still go in."""
        return self._board.run(["systemctl", "is-active", "--quiet", _FEEDER]).status == 0

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self._end() and kind is None:
            raise Broken("vivid cannot be unloaded: somebody has it open")

    def _end(self) -> bool:
        # In this order: the driver stays as long as somebody has it open.
        return (
            self._board.run(
                f"systemctl stop lightwelld {_FEEDER}; rm -f {_FILE}; modprobe -r vivid", timeout_s=90
            ).status
            == 0
        )
