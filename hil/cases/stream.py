"""Frames from a camera through the kernel, the firmware and the network, and an account of every one of them."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from hil.cases import vivid
from hil.harness.rig import Rig, processed_frames
from hil.harness.runner import Measured

# Of streaming that are measured.
_SECONDS = 8.0
# A frame that was lost is known by the number of the next: one that was the last before a rest is told after it.
UNTOLD = "<= 1"


def camera_text(rig: Rig, camera: Any, device: str, *, exposure: str = "") -> str:
    """The CameraConfig of lightwelld for a simulated camera that the board has as `device`; `exposure`: more of its
    URI."""
    # The camera's white is D65, as its calibration says; the firmware would set 5000 K.
    uri = (f"v4l2:{device}?format={camera.format.lower()}&white_balance=6500" if camera.backend == "v4l2"
           else f"libcamera:1?format={camera.format.lower()}")
    return (f'uri: "{uri}{exposure}" width: {camera.width} height: {camera.height} frame_rate: {camera.frame_rate}')


def ahead(camera: Any, exposures: str = "") -> list[str]:
    """That the camera's pictures are rendered before they are due: the processor belongs to the board."""
    text = f"{camera.width}x{camera.height}:{camera.format.lower()}:{camera.frame_rate:.0f}"
    return ["--ahead", text + (f":{exposures}" if exposures else "")]


def calibrate(rig: Rig, camera: Any, scene: str = "") -> str:
    """Puts the camera's calibration onto the board; the field of lightwelld's configuration that names it."""
    text = rig.camera_calibration(scene or camera.scene, f"{camera.width}x{camera.height}:{camera.format.lower()}")
    rig.board.run("cat > /etc/lightwell/rig.textproto", text=text, check=True)
    return 'calibration: "rig.textproto"\n'


def unknown_to_client(grown: Mapping[str, float], measured: Measured) -> None:
    """Between two looks at rest: a client sees as holes in the numbers of descriptors what was dropped and what was
    lost before."""
    told = grown["arrived"] + grown["missing"]
    measured.figure(
        "frames that the client neither got as light nor knows as missing",
        abs(processed_frames(grown) + grown["frames_lost"] - told),
        "",
        UNTOLD,
    )


def measure_stream(rig: Rig, test: Any, measured: Measured) -> None:
    """Streams for a while and accounts for every frame: camera, kernel and firmware, estimator, client."""
    camera = rig.described(test.camera).usb_simulated
    with rig.usb_camera(test.camera, arguments=["--pace", "rate", *ahead(camera)]) as outside:
        uri = rig.configure(camera_text(rig, camera, rig.wait_for_video()), more=calibrate(rig, camera))
        with rig.watcher(uri) as watcher:
            watcher.wait_for("light", 60, since=0)
            time.sleep(4)  # A stream that has just begun is not what is measured.
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
        UNTOLD,
    )
    measured.figure("captures dropped for the estimator's sake, a newer one being there", grown["captures_dropped"])
    measured.figure(
        "frames that were neither estimated nor counted as dropped", abs(grown["frames"] - processed_frames(grown)), "", "== 0"
    )
    unknown_to_client(grown, measured)
    measured.time("from delivery to the client, p50", summary["latency_p50_ms"] or float("nan"), "ms")
    measured.time("from delivery to the client, p99", summary["latency_p99_ms"] or float("nan"), "ms")
    measured.figure("a descriptor, median", summary["bytes_p50"] or float("nan"), "bytes")
    measured.figure("lightwelld's memory", rss / 1024, "MB")
    measured.figure("where the board's two processors' time goes, %", profile)


def usb_camera_yuyv(rig: Rig, test: Any, measured: Measured) -> None:
    """The kernel and the firmware's camera keep up; what the emulated processor estimates of it is reported, with its
    profile."""
    measure_stream(rig, test, measured)


def usb_camera_nv12(rig: Rig, test: Any, measured: Measured) -> None:
    """As the raw one; the estimator has more to do."""
    measure_stream(rig, test, measured)


def usb_camera_mjpeg(rig: Rig, test: Any, measured: Measured) -> None:
    """An emulated processor decodes each frame."""
    measure_stream(rig, test, measured)


def libcamera(rig: Rig, test: Any, measured: Measured) -> None:
    """The other way to the same camera."""
    measure_stream(rig, test, measured)


def vivid_bayer10(rig: Rig, test: Any, measured: Measured) -> None:
    """Another driver, and a format that no USB camera has."""
    with vivid.room(rig):
        vivid.measure_loop(rig, test, measured)


def vivid_bayer12(rig: Rig, test: Any, measured: Measured) -> None:
    """Likewise, of which the account is the same; and the light of these frames against the desktop's."""
    with vivid.room(rig):
        vivid.measure_loop(rig, test, measured, dropping=False)
        vivid.compare_light(rig, measured)


def limits(rig: Rig, test: Any, measured: Measured) -> None:
    """At which size and rate the emulated board gives out: the camera sends as fast as it is taken."""
    camera = rig.described(test.camera).usb_simulated
    # One that does not move has few pictures to be rendered ahead.
    still = camera.scene.split("&turn=")[0]
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
