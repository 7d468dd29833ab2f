"""The vivid driver's loopback as a camera: formats that UVC lacks, at the driver's full rate; every frame is counted
and every byte compared."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from hil.cases.same_light import same_light
from hil.harness import recording
from hil.harness.rig import Rig, processed_frames
from hil.harness.runner import Measured, TestFailure
from hil.harness.vivid import VividLoop, render

# A tmpfs: an emulated disk would be slower than the stream.
_FOLDER = "/run/vivid"
_RECORDED = 32


@contextmanager
def recording_disk(rig: Rig) -> Iterator[None]:
    """Mounts the tmpfs into which the board records; removes it on exit."""
    rig.board.run(
        f"mkdir -p {_FOLDER} && mount -t tmpfs -o size=600m,uid=$(id -u lightwell) tmpfs {_FOLDER}", check=True
    )
    try:
        yield
    finally:
        rig.board.run(f"systemctl stop lightwelld; umount {_FOLDER} && rmdir {_FOLDER}; true", timeout_s=60)


def measure_loop(rig: Rig, test: Any, measured: Measured, *, dropping: bool = True) -> None:
    """Measures the frame rate and compares the frame counts; with `dropping` a second time while the driver drops half
    of the frames; then compares the bytes of frames, which rig.folder / loop.lwr holds afterwards. Needs
    recording_disk()."""
    camera = rig.camera_entry(test.camera).vivid
    calibration, pictures = render(rig.tools.host / "lightwelld", camera)
    # lightwelld may still be configured for a device node that vivid is about to create, and would open it.
    rig.board.run("systemctl stop lightwelld", check=True, timeout_s=60)
    rig.board.run("cat > /etc/lightwell/rig.textproto", text=calibration, check=True)
    more = 'calibration: "rig.textproto"\n'
    with VividLoop(rig.board, camera, pictures) as loop:
        text = (f'uri: "v4l2:{loop.device}?format={camera.format}" width: {camera.width} height: {camera.height} '
                f"frame_rate: {loop.rate}")
        # The rate that an emulated processor reaches without the firmware.
        measured.time("frames that the kernel's own tool takes in the firmware's place", loop.tool_frame_rate(), "/s")
        uri = rig.configure(text, more=more)
        time.sleep(3)  # Excludes the start of the stream.
        _check_frame_counts(rig, loop, uri, measured, seconds=5)
        if dropping:
            loop.drop(50)
            _check_frame_counts(rig, loop, uri, measured, seconds=5, dropped=50)
            loop.drop(0)
        _record(rig, text, more)
        if not loop.feeds():
            raise TestFailure("v4l2-ctl, which feeds the loop, ended")
    _bytes(rig, pictures, measured)


def compare_light(rig: Rig, measured: Measured) -> None:
    """Compares the light of board and desktop for the frames that measure_loop recorded."""
    thinned = rig.folder / "thinned.lwr"
    # Few enough frames per second for both to process each, because the arithmetic is to be compared.
    recording.thin(rig.folder / "loop.lwr", thinned, apart=6, frames=5)
    rig.board.copy_in(thinned, f"{_FOLDER}/thinned.lwr")
    same_light(rig, thinned, f"{_FOLDER}/thinned.lwr", measured, board_s=4, desktop_s=8)


def _check_frame_counts(
    rig: Rig, loop: VividLoop, uri: str, measured: Measured, *, seconds: float, dropped: int = 0
) -> None:
    """vivid makes a frame at each tick of its clock, whether it is captured or not: the firmware must have received
    each or counted it as lost. `dropped`: percentage of frames that the driver drops."""
    def sample() -> tuple[float, dict[str, Any], float]:
        before = time.monotonic()
        return before, rig.info(uri), time.monotonic()

    asked, first, answered = sample()
    summary = rig.watch(uri, seconds)
    asked_again, last, answered_again = sample()
    grown = {
        name: last[name] - first[name]
        for name in ("frames", "frames_lost", "estimates", "captures_dropped", "estimates_failed")
    }
    took = (asked_again + answered_again - asked - answered) / 2
    # The counters were read at some moment between query and response.
    least, most = loop.rate * (asked_again - answered), loop.rate * (answered_again - asked)
    seen = grown["frames"] + grown["frames_lost"]
    what = f"{dropped} % kept by vivid: " if dropped else ""
    measured.time(f"{what}frames into the firmware", grown["frames"] / took, "/s", "" if dropped else ">= 31")
    measured.time(f"{what}descriptors at the client", summary["frames_per_s"], "/s", ">= 1")
    measured.figure(f"{what}frames that vivid's clock made ({loop.rate:g}/s)", loop.rate * took)
    measured.figure(f"{what}frames that came", grown["frames"])
    # Five standard deviations below the mean of the randomly dropped frames.
    fewest = max(0.0, least * dropped / 100 - 5 * (least * dropped / 100) ** 0.5)
    measured.figure(f"{what}frames counted as lost", grown["frames_lost"], "", f">= {fewest:.0f}" if dropped else "")
    measured.figure(
        f"{what}frames more or fewer than the clock made between the looks",
        max(0.0, least - seen, seen - most),
        "",
        "<= 8",
    )
    measured.figure(
        f"{what}frames that were neither estimated nor counted as dropped",
        abs(grown["frames"] - processed_frames(grown)),
        "",
        "<= 4",
    )
    if not dropped:
        measured.figure("where the board's two processors' time goes, %", rig.profile(3))


def _record(rig: Rig, text: str, more: str) -> None:
    """Records _RECORDED frames as the firmware's camera delivers them into rig.folder / loop.lwr."""
    rig.configure(text, more=more + f'record {{ path: "{_FOLDER}/loop.lwr" }}\n')
    rig.wait_for_recorded(_RECORDED)
    rig.board.run("systemctl stop lightwelld", check=True, timeout_s=60)
    # A recording that is truncated at any byte can be read up to there.
    rig.board.run(
        f"cd {_FOLDER} && size=$(stat -c %s loop.lwr) && frames={_RECORDED} && "
        "head -c $(( size < frames * 700000 ? size : frames * 700000 )) loop.lwr > some.lwr && rm loop.lwr",
        check=True,
    )
    rig.board.copy_out(f"{_FOLDER}/some.lwr", rig.folder / "loop.lwr")


def _bytes(rig: Rig, pictures: list[bytes], measured: Measured) -> None:
    """Each recorded frame equals one of the frames that were fed, byte for byte."""
    number = {picture: at for at, picture in enumerate(pictures)}
    frames = recording.read(rig.folder / "loop.lwr")[1]
    shown = [(frame.sequence, number.get(frame.data)) for frame in frames]
    measured.figure("frames whose bytes were looked at", len(shown), "", f">= {_RECORDED // 2}")
    measured.figure(
        "of these, frames that are none of the pictures that were fed",
        sum(1 for _, at in shown if at is None),
        "",
        "== 0",
    )
    measured.figure(
        "different pictures among them", len({at for _, at in shown if at is not None}), "", f">= {len(pictures) // 2}"
    )
    # Output and capture run at independent clocks, so a frame may be repeated or left out.
    steps = [
        (b - a) % len(pictures)
        for (m, a), (n, b) in zip(shown, shown[1:])
        if n == m + 1 and a is not None and b is not None
    ]
    measured.figure(
        "neighbours of which the second shows the next picture", 100 * steps.count(1) / max(1, len(steps)), "%"
    )
