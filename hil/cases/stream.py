"""Streams frames from a camera through kernel, firmware and network, and checks that every frame is counted."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from hil.cases import vivid
from hil.harness.rig import Rig, processed_frames
from hil.harness.runner import Measured

# Duration of a measurement.
_SECONDS = 8.0
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


def unknown_to_client(grown: Mapping[str, float], measured: Measured) -> None:
    """Adds a figure: between two snapshots at rest, every frame either arrived at the client as a descriptor or is
    missing in its sequence numbers (dropped by the estimator, or lost before). `grown`: increments of the counters."""
    known = grown["arrived"] + grown["missing"]
    measured.figure(
        "frames that the client neither got as light nor knows as missing",
        abs(processed_frames(grown) + grown["frames_lost"] - known),
        "",
        MAX_UNCOUNTED,
    )


def measure_stream(rig: Rig, test: Any, measured: Measured) -> None:
    """Streams for _SECONDS and compares the frame counters of camera, firmware, estimator and client."""
    camera = rig.camera_entry(test.camera).usb_simulated
    with rig.usb_camera(test.camera, arguments=["--pace", "rate", *ahead(camera)]) as outside:
        uri = rig.configure(camera_text(rig, camera, rig.wait_for_video()), more=calibrate(rig, camera))
        with rig.watcher(uri) as watcher:
            watcher.wait_for("light", 60, since=0)
            time.sleep(4)  # Excludes the start of the stream.
            begun = rig.at_rest(outside, uri, watcher)
            time.sleep(_SECONDS)
            ended = rig.at_rest(outside, uri, watcher)
            rss = rig.daemon()["rss_kb"]
            profile = rig.profile(4)
            summary = watcher.summary()
    took = ended["at"] - begun["until"]
    grown = {name: ended[name] - begun[name] for name in ended}
    measured.time("frames into the firmware", grown["frames"] / took, "/s", ">= 29")
    measured.time("descriptors at the client", grown["arrived"] / took, "/s", ">= 1")
    measured.time("frames that the camera sent", grown["sent"] / took, "/s")
    measured.figure("frames that the camera could not hand over, counted by it", grown["camera_dropped"])
    measured.figure("frames that the camera sent", grown["sent"])
    measured.figure("of these, frames that the firmware counted as lost", grown["frames_lost"])
    measured.figure(
        "frames sent that neither came nor were counted as lost",
        abs(grown["sent"] - grown["frames"] - grown["frames_lost"]),
        "",
        MAX_UNCOUNTED,
    )
    measured.figure("captures dropped for the estimator's sake, a newer one being there", grown["captures_dropped"])
    measured.figure(
        "frames that were neither estimated nor counted as dropped",
        abs(grown["frames"] - processed_frames(grown)),
        "",
        "== 0",
    )
    unknown_to_client(grown, measured)
    measured.time("from delivery to the client, p50", summary["latency_p50_ms"] or float("nan"), "ms")
    measured.time("from delivery to the client, p99", summary["latency_p99_ms"] or float("nan"), "ms")
    measured.figure("a descriptor, median", summary["bytes_p50"] or float("nan"), "bytes")
    measured.figure("lightwelld's memory", rss / 1024, "MB")
    measured.figure("where the board's two processors' time goes, %", profile)


def usb_camera_yuyv(rig: Rig, test: Any, measured: Measured) -> None:
    """YUYV: the kernel and the firmware's camera backend must keep up. The estimator's rate on the emulated processor
    is only reported, with a profile."""
    measure_stream(rig, test, measured)


def usb_camera_nv12(rig: Rig, test: Any, measured: Measured) -> None:
    """The same in NV12, which costs the estimator more."""
    measure_stream(rig, test, measured)


def usb_camera_mjpeg(rig: Rig, test: Any, measured: Measured) -> None:
    """The same in motion JPEG, which the emulated processor decodes."""
    measure_stream(rig, test, measured)


def libcamera(rig: Rig, test: Any, measured: Measured) -> None:
    """The same camera through libcamera."""
    measure_stream(rig, test, measured)


def vivid_bayer10(rig: Rig, test: Any, measured: Measured) -> None:
    """Another kernel driver, with a raw format that UVC lacks."""
    with vivid.recording_disk(rig):
        vivid.measure_loop(rig, test, measured)


def vivid_bayer12(rig: Rig, test: Any, measured: Measured) -> None:
    """The same with 12 bits; the light of the recorded frames is compared with the desktop's."""
    with vivid.recording_disk(rig):
        vivid.measure_loop(rig, test, measured, dropping=False)
        vivid.compare_light(rig, measured)


def limits(rig: Rig, test: Any, measured: Measured) -> None:
    """The highest frame rate of the emulated board at several sizes: the camera sends as fast as the board accepts."""
    camera = rig.camera_entry(test.camera).usb_simulated
    # A static scene has few frames to render in advance.
    still = camera.scene.split("&yaw_rate=")[0]
    for width, height in ((640, 480), (1280, 720), (1920, 1080)):
        sized = type(camera)()
        sized.CopyFrom(camera)
        sized.width, sized.height, sized.frame_rate = width, height, 60
        with rig.usb_camera(test.camera, scene=still, arguments=["--pace", "free", *ahead(sized)]) as outside:
            uri = rig.configure(camera_text(rig, sized, rig.wait_for_video()), more=calibrate(rig, sized, still))
            with rig.watcher(uri) as watcher:
                watcher.wait_for("light", 60, since=0)
                begun, since = rig.snapshot(outside, uri), len(watcher.seconds())
                profile = rig.profile(6)
                ended, lines = rig.snapshot(outside, uri), watcher.seconds()[since:]
        took = ended["at"] - begun["at"]
        measured.time(f"{width}x{height}: frames into the firmware", (ended["frames"] - begun["frames"]) / took, "/s")
        measured.time(
            f"{width}x{height}: descriptors at the client",
            sum(line["frames"] for line in lines) / max(1, len(lines)),
            "/s",
        )
        measured.figure(f"{width}x{height}: where the board's two processors' time goes", profile)
