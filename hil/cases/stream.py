"""Streams frames from a camera through kernel, firmware and network, and checks that every frame is counted. vivid's
loopback has formats that UVC lacks, at the driver's full rate; there, every byte is compared, too."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hil.harness import recording
from hil.harness.rig import COUNTERS, Rig, UsbCamera, processed_frames
from hil.harness.runner import Measured, TestFailure
from hil.harness.vivid import VividLoop, render
from hil.harness.watcher import Watcher

# Duration of a measurement.
_SECONDS = 8.0
# Of recordings of vivid's loopback.
_LOOP_FOLDER = "/run/vivid"
_RECORDED = 32
# A lost frame is detected by the sequence number of the next one, so one lost directly before a pause is not yet
# counted.
MAX_UNCOUNTED = "<= 1"


def camera_text(rig: Rig, camera: Any, device: str, *, exposure: str = "") -> str:
    """lightwelld's CameraConfig for a simulated camera with the device node `device`; `exposure`: appended to its
    URI."""
    # The calibration holds for the camera's neutral white balance, 6500 K; the firmware's default is 5000 K.
    uri = (f"v4l2:{device}?format={camera.format.lower()}&white_balance=6500" if camera.backend == "v4l2"
           else f"libcamera:1?format={camera.format.lower()}")
    return (f'uri: "{uri}{exposure}" width: {camera.width} height: {camera.height} frame_rate: {camera.frame_rate}')


def ahead(camera: Any, exposures: str = "") -> list[str]:
    """Arguments that make the camera render its frames in advance, which leaves this machine's processor to the
    board."""
    text = f"{camera.width}x{camera.height}:{camera.format.lower()}:{camera.frame_rate:.0f}"
    return ["--ahead", text + (f":{exposures}" if exposures else "")]


def calibrate(rig: Rig, camera: Any, scene: str = "") -> str:
    """Writes the camera's calibration to the board; returns the configuration field that refers to it."""
    text = rig.camera_calibration(scene or camera.scene, f"{camera.width}x{camera.height}:{camera.format.lower()}")
    rig.board.run("cat > /etc/lightwell/rig.textproto", text=text, check=True)
    return 'calibration: "rig.textproto"\n'


@contextmanager
def streaming(rig: Rig, test: Any, *, camera: Any = None, scene: str = "", arguments: Sequence[str] = (),
              more: str = "") -> Iterator[tuple[UsbCamera, str, Watcher]]:
    """A simulated USB camera, lightwelld that uses it, and a connected client that receives light. `camera` and
    `scene`: instead of those of the test's camera in the roster; `more`: further fields of the configuration."""
    camera = camera or rig.camera_entry(test.camera).usb_simulated
    with rig.usb_camera(test.camera, scene=scene, arguments=[*arguments, *ahead(camera)]) as outside:
        uri = rig.configure(camera_text(rig, camera, rig.wait_for_video()), more=calibrate(rig, camera, scene) + more)
        with rig.watcher(uri) as watcher:
            watcher.wait_for("light", 60, since=0)
            yield outside, uri, watcher


def unknown_to_client(grown: Mapping[str, float], measured: Measured) -> None:
    """Adds a figure: between two snapshots at rest, every frame either arrived at the client as a descriptor or is
    missing in its sequence numbers (dropped by the estimator, or lost before). `grown`: increments of the counters."""
    known = grown["arrived"] + grown["missing"]
    measured.figure("frames that the client neither got as light nor knows as missing",
                    abs(processed_frames(grown) + grown["frames_lost"] - known), "", MAX_UNCOUNTED)


def measure_stream(rig: Rig, test: Any, measured: Measured) -> None:
    """Streams for _SECONDS and compares the frame counters of camera, firmware, estimator and client."""
    with streaming(rig, test, arguments=["--pace", "rate"]) as (outside, uri, watcher):
        time.sleep(4)  # Excludes the start of the stream.
        begun = rig.at_rest(outside, uri, watcher)
        time.sleep(_SECONDS)
        ended = rig.at_rest(outside, uri, watcher)
        rss = rig.daemon()["rss_kb"]
        idle = rig.idle_percent(4)
        summary = watcher.summary()
    took = ended["at"] - begun["until"]
    grown = {name: ended[name] - begun[name] for name in ended}
    measured.time("frames into the firmware", grown["frames"] / took, "/s", ">= 29")
    measured.time("descriptors at the client", grown["arrived"] / took, "/s", ">= 1")
    measured.time("frames that the camera sent", grown["sent"] / took, "/s")
    measured.figure("frames that the camera could not hand over, counted by it", grown["camera_dropped"])
    measured.figure("frames that the camera sent", grown["sent"])
    measured.figure("of these, frames that the firmware counted as lost", grown["frames_lost"])
    measured.figure("frames sent that neither came nor were counted as lost",
                    abs(grown["sent"] - grown["frames"] - grown["frames_lost"]), "", MAX_UNCOUNTED)
    measured.figure("captures dropped for the estimator's sake, a newer one being there", grown["captures_dropped"])
    measured.figure("frames that were neither estimated nor counted as dropped",
                    abs(grown["frames"] - processed_frames(grown)), "", "== 0")
    unknown_to_client(grown, measured)
    measured.time("from delivery to the client, p50", summary["latency_p50_ms"] or float("nan"), "ms")
    measured.time("from delivery to the client, p99", summary["latency_p99_ms"] or float("nan"), "ms")
    measured.figure("a descriptor, median", summary["bytes_p50"] or float("nan"), "bytes")
    measured.figure("lightwelld's memory", rss / 1024, "MB")
    measured.time("idle time of the board's two processors", idle, "%")


# Tests of the roster that differ only in their camera.
usb_camera_yuyv = usb_camera_nv12 = usb_camera_mjpeg = libcamera = measure_stream


def vivid_bayer10(rig: Rig, test: Any, measured: Measured) -> None:
    """Another kernel driver, with a raw format that UVC lacks."""
    with recording_disk(rig):
        measure_loop(rig, test, measured)


def vivid_bayer12(rig: Rig, test: Any, measured: Measured) -> None:
    """The same with 12 bits; the light of the recorded frames is compared with the desktop's."""
    with recording_disk(rig):
        measure_loop(rig, test, measured, dropping=False)
        compare_light(rig, measured)


def limits(rig: Rig, test: Any, measured: Measured) -> None:
    """The highest frame rate of the emulated board at several sizes: the camera sends as fast as the board accepts."""
    camera = rig.camera_entry(test.camera).usb_simulated
    # A static scene has few frames to render in advance.
    still = camera.scene.split("&yaw_rate=")[0]
    for width, height in ((640, 480), (1280, 720), (1920, 1080)):
        sized = type(camera)()
        sized.CopyFrom(camera)
        sized.width, sized.height, sized.frame_rate = width, height, 60
        with streaming(rig, test, camera=sized, scene=still, arguments=["--pace", "free"]) as (outside, uri, watcher):
            begun, since = rig.snapshot(outside, uri), len(watcher.seconds())
            idle = rig.idle_percent(6)
            ended, lines = rig.snapshot(outside, uri), watcher.seconds()[since:]
        took = ended["at"] - begun["at"]
        measured.time(f"{width}x{height}: frames into the firmware", (ended["frames"] - begun["frames"]) / took, "/s")
        measured.time(f"{width}x{height}: descriptors at the client",
                      sum(line["frames"] for line in lines) / max(1, len(lines)), "/s")
        measured.time(f"{width}x{height}: idle time of the board's two processors", idle, "%")


@contextmanager
def recording_disk(rig: Rig) -> Iterator[None]:
    """Mounts a tmpfs, into which the board records, because an emulated disk would be slower than the stream."""
    rig.board.run(f"mkdir -p {_LOOP_FOLDER} && mount -t tmpfs -o size=600m,uid=$(id -u lightwell) tmpfs {_LOOP_FOLDER}",
                  check=True)
    try:
        yield
    finally:
        rig.board.run(f"systemctl stop lightwelld; umount {_LOOP_FOLDER} && rmdir {_LOOP_FOLDER}; true", timeout_s=60)


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
    rig.board.copy_in(thinned, f"{_LOOP_FOLDER}/thinned.lwr")
    same_light(rig, thinned, f"{_LOOP_FOLDER}/thinned.lwr", measured, board_s=4, desktop_s=8)


def same_light(rig: Rig, frames: Path, there: str, measured: Measured, *, board_s: float = 6,
               desktop_s: float = 14) -> None:
    """Plays a recording of frames through both, for `board_s` and `desktop_s` seconds. `there`: its path on the board,
    `frames`: on this machine."""
    on_board, on_desktop = rig.folder / "board.lwr", rig.folder / "desktop.lwr"
    # In a loop, so that a client receives frames whenever it connects.
    uri = rig.configure(f'uri: "replay:{there}?loop=0"')
    rig.record(uri, board_s, on_board)
    dropped = rig.info(uri)["captures_dropped"]
    with rig.desktop_daemon(f"replay:{frames}?loop=0") as desktop:
        rig.record_here(desktop, desktop_s, on_desktop)
    measured.figure("captures that the board dropped, after which its smoothing is another", dropped, "", "== 0")
    # Sums over pixels use SIMD lanes, four with NEON, eight or sixteen with AVX, so floats are added in another order.
    # The difference must stay below the quantization on the wire, half a step of 13 bits of each coefficient.
    measure_difference(rig, on_board, on_desktop, measured, least=20, irradiance_percent=0.02, direction_deg=0.01)


def measure_difference(rig: Rig, on_board: Path, on_desktop: Path, measured: Measured, *, least: int,
                       irradiance_percent: float, direction_deg: float) -> None:
    """Adds figures with limits: at least `least` descriptors in both recordings, and the largest differences of
    irradiance (percent) and of light directions (degrees)."""
    apart = rig.compare(on_board, on_desktop)
    measured.figure("descriptors that both made", apart["both"], "", f">= {least}")
    measured.figure("of these, with every number of their light the same", apart["same"])
    measured.figure("irradiance: RMS of the difference by RMS of the light, largest", 100 * apart["irradiance"], "%",
                    f"<= {irradiance_percent}")
    measured.figure("directions of lights, largest difference", apart["direction_deg"], "deg", f"<= {direction_deg}")
    measured.figure("lights that only one of them found", apart["unmatched"], "", "== 0")


def _check_frame_counts(rig: Rig, loop: VividLoop, uri: str, measured: Measured, *, seconds: float,
                        dropped: int = 0) -> None:
    """vivid makes a frame at each tick of its clock, whether it is captured or not: the firmware must have received
    each or counted it as lost. `dropped`: percentage of frames that the driver drops."""
    def sample() -> tuple[float, dict[str, Any], float]:
        before = time.monotonic()
        return before, rig.info(uri), time.monotonic()

    asked, first, answered = sample()
    summary = rig.watch(uri, seconds)
    asked_again, last, answered_again = sample()
    grown = {name: last[name] - first[name] for name in COUNTERS}
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
    measured.figure(f"{what}frames more or fewer than the clock made between the looks",
                    max(0.0, least - seen, seen - most), "", "<= 8")
    measured.figure(f"{what}frames that were neither estimated nor counted as dropped",
                    abs(grown["frames"] - processed_frames(grown)), "", "<= 4")
    if not dropped:
        measured.time("idle time of the board's two processors", rig.idle_percent(3), "%")


def _record(rig: Rig, text: str, more: str) -> None:
    """Records _RECORDED frames as the firmware's camera delivers them into rig.folder / loop.lwr."""
    rig.configure(text, more=more + f'record {{ path: "{_LOOP_FOLDER}/loop.lwr" }}\n')
    rig.wait_for_recorded(_RECORDED)
    rig.board.run("systemctl stop lightwelld", check=True, timeout_s=60)
    # A recording that is truncated at any byte can be read up to there.
    most = 700000 * _RECORDED
    rig.board.run(f"cd {_LOOP_FOLDER} && head -c {most} loop.lwr > some.lwr && rm loop.lwr", check=True)
    rig.board.copy_out(f"{_LOOP_FOLDER}/some.lwr", rig.folder / "loop.lwr")


def _bytes(rig: Rig, pictures: list[bytes], measured: Measured) -> None:
    """Each recorded frame equals one of the frames that were fed, byte for byte."""
    number = {picture: at for at, picture in enumerate(pictures)}
    frames = recording.read(rig.folder / "loop.lwr")[1]
    shown = [(frame.sequence, number.get(frame.data)) for frame in frames]
    measured.figure("frames whose bytes were looked at", len(shown), "", f">= {_RECORDED // 2}")
    measured.figure("of these, frames that are none of the pictures that were fed",
                    sum(1 for _, at in shown if at is None), "", "== 0")
    measured.figure("different pictures among them", len({at for _, at in shown if at is not None}), "",
                    f">= {len(pictures) // 2}")
    # Output and capture run at independent clocks, so a frame may be repeated or left out.
    steps = [(b - a) % len(pictures) for (m, a), (n, b) in zip(shown, shown[1:])
             if n == m + 1 and a is not None and b is not None]
    measured.figure("neighbours of which the second shows the next picture", 100 * steps.count(1) / max(1, len(steps)),
                    "%")
