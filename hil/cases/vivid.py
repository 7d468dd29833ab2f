"""vivid's loop as a camera: formats that UVC lacks, at the driver's full rate, every frame counted and every byte
looked at."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from hil.cases.same_light import same_light
from hil.harness import recording
from hil.harness.rig import Rig, processed_frames
from hil.harness.runner import Broken, Measured
from hil.harness.vivid import VividLoop, render

# A disk in memory: an emulated one would be slower than the frames.
_ROOM = "/run/vivid"
_RECORDED = 32


@contextmanager
def room(rig: Rig) -> Iterator[None]:
    """Where the board records."""
    rig.board.run(f"mkdir -p {_ROOM} && mount -t tmpfs -o size=600m,uid=$(id -u lightwell) tmpfs {_ROOM}", check=True)
    try:
        yield
    finally:
        rig.board.run(f"systemctl stop lightwelld; umount {_ROOM} && rmdir {_ROOM}; true", timeout_s=60)


def measure_loop(rig: Rig, test: Any, measured: Measured, *, dropping: bool = True) -> None:
    """Rate and account, then the same with frames that the driver keeps (`dropping`), then the bytes, which rig.folder
    / loop.lwr holds afterwards. In a room()."""
    camera = rig.described(test.camera).vivid
    calibration, pictures = render(rig.tools.host / "lightwelld", camera)
    # What it was told before may be a device that vivid will make: it would have it open.
    rig.board.run("systemctl stop lightwelld", check=True, timeout_s=60)
    rig.board.run("cat > /etc/lightwell/rig.textproto", text=calibration, check=True)
    more = 'calibration: "rig.textproto"\n'
    with VividLoop(rig.board, camera, pictures) as loop:
        text = (f'uri: "v4l2:{loop.device}?format={camera.format}" width: {camera.width} height: {camera.height} '
                f"frame_rate: {loop.rate}")
        # What the driver itself has no time for on an emulated processor.
        measured.time("frames that the kernel's own tool takes in the firmware's place", loop.taken_by_the_tool(), "/s")
        uri = rig.configure(text, more=more)
        time.sleep(3)  # A stream that has just begun is not what is measured.
        _check_frame_counts(rig, loop, uri, measured, seconds=5)
        if dropping:
            loop.drop(50)
            _check_frame_counts(rig, loop, uri, measured, seconds=5, dropped=50)
            loop.drop(0)
        _record(rig, text, more)
        if not loop.feeds():
            raise Broken("v4l2-ctl, which feeds the loop, ended")
    _bytes(rig, pictures, measured)


def compare_light(rig: Rig, measured: Measured) -> None:
    """What the board and the desktop make of the frames that measure_loop recorded."""
    thinned = rig.folder / "thinned.lwr"
    # So few a second that both take each: what is compared is arithmetic.
    recording.thin(rig.folder / "loop.lwr", thinned, apart=6, frames=5)
    rig.board.copy_in(thinned, f"{_ROOM}/thinned.lwr")
    same_light(rig, thinned, f"{_ROOM}/thinned.lwr", measured, board_s=4, desktop_s=8)


def _check_frame_counts(rig: Rig, loop: VividLoop, uri: str, measured: Measured, *, seconds: float, dropped: int = 0) -> None:
    """vivid makes a frame at each tick of its clock, whether somebody takes it or not: that is what must have come or
    be counted."""
    def look() -> tuple[float, dict[str, Any], float]:
        before = time.monotonic()
        return before, rig.info(uri), time.monotonic()

    asked, first, answered = look()
    summary = rig.watch(uri, seconds)
    asked_again, last, answered_again = look()
    grown = {
        name: last[name] - first[name]
        for name in ("frames", "frames_lost", "estimates", "captures_dropped", "estimates_failed")
    }
    took = (asked_again + answered_again - asked - answered) / 2
    # A look is of some moment between question and answer.
    least, most = loop.rate * (asked_again - answered), loop.rate * (answered_again - asked)
    seen = grown["frames"] + grown["frames_lost"]
    what = f"{dropped} % kept by vivid: " if dropped else ""
    measured.time(f"{what}frames into the firmware", grown["frames"] / took, "/s", "" if dropped else ">= 31")
    measured.time(f"{what}descriptors at the client", summary["frames_per_s"], "/s", ">= 1")
    measured.figure(f"{what}frames that vivid's clock made ({loop.rate:g}/s)", loop.rate * took)
    measured.figure(f"{what}frames that came", grown["frames"])
    # Five standard deviations below the mean of what is drawn by lot.
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
    """Some frames as the firmware's camera delivered them, into rig.folder / loop.lwr."""
    rig.configure(text, more=more + f'record {{ path: "{_ROOM}/loop.lwr" }}\n')
    rig.wait_for_recorded(_RECORDED)
    rig.board.run("systemctl stop lightwelld", check=True, timeout_s=60)
    # What is cut off at any byte can be read up to there.
    rig.board.run(
        f"cd {_ROOM} && size=$(stat -c %s loop.lwr) && frames={_RECORDED} && "
        "head -c $(( size < frames * 700000 ? size : frames * 700000 )) loop.lwr > some.lwr && rm loop.lwr",
        check=True,
    )
    rig.board.copy_out(f"{_ROOM}/some.lwr", rig.folder / "loop.lwr")


def _bytes(rig: Rig, pictures: list[bytes], measured: Measured) -> None:
    """Each recorded frame is one of the pictures that were fed, byte for byte, and they follow each other."""
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
    # Output and camera tick each for itself: of two neighbours one may show the other's picture again, or leave one
    # out.
    steps = [
        (b - a) % len(pictures)
        for (m, a), (n, b) in zip(shown, shown[1:])
        if n == m + 1 and a is not None and b is not None
    ]
    measured.figure(
        "neighbours of which the second shows the next picture", 100 * steps.count(1) / max(1, len(steps)), "%"
    )
