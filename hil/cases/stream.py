"""Frames from a camera through the kernel, the firmware and the network, and an account of every one of them."""

from __future__ import annotations

import time
from typing import Any

from hil.cases import vivid
from hil.harness.rig import Rig
from hil.harness.runner import Broken, Measured

# What a descriptor may lose on its way from frames to a client and has to be counted by, in order.
_SECONDS = 12.0


def camera_text(rig: Rig, camera: Any, device: str, *, exposure: str = "") -> str:
    """The CameraConfig of lightwelld for a simulated camera that the board has as `device`; `exposure`: more of its URI."""
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


def measure_stream(rig: Rig, test: Any, measured: Measured, *, seconds: float = _SECONDS, into_firmware: float = 1) -> dict[str, float]:
    """Streams for a while and accounts for every frame: camera, kernel and firmware, estimator, client."""
    camera = rig.described(test.camera).usb_simulated
    with rig.usb_camera(test.camera, arguments=["--pace", "rate", *ahead(camera)]) as outside:
        uri = rig.configure(camera_text(rig, camera, rig.wait_for_video()), more=calibrate(rig, camera))
        time.sleep(6)  # A stream that has just begun is not what is measured.
        begun = rig.snapshot(outside, uri)
        summary = rig.watch(uri, seconds)
        ended = rig.snapshot(outside, uri)
        rss = rig.daemon()["rss_kb"]
        profile = rig.profile(5)
    took = ended["at"] - begun["at"]
    grown = {name: ended[name] - begun[name] for name in ended}
    rate = summary["frames_per_s"]
    measured.time("frames into the firmware", grown["frames"] / took, "/s", f">= {into_firmware:g}")
    measured.time("descriptors at the client", rate, "/s", ">= 1")
    measured.time("frames that the camera sent", grown["sent"] / took, "/s")
    measured.figure("frames that the camera could not hand over, counted by it", grown["camera_dropped"])
    # In flight between two looks that are not at one moment: a handful at either end.
    lost = grown["sent"] - grown["frames"] - grown["frames_lost"]
    measured.figure("frames sent that neither came nor were counted as lost (looks are up to 0.6 s apart)", abs(lost), "",
                    f"<= {max(8, 1.2 * grown['sent'] / took):.0f}")
    measured.figure("frames that the firmware counted as lost", grown["frames_lost"])
    used = grown["estimates"] + grown["captures_dropped"] + grown["estimates_failed"]
    measured.figure("frames that were neither estimated nor counted as dropped", abs(grown["frames"] - used), "", "<= 4")
    measured.figure("captures dropped for the estimator's sake, a newer one being there", grown["captures_dropped"])
    # A client sees what was dropped as holes in the numbers.
    measured.figure("captures that the client neither got nor knows as missing (looks up to 0.6 s apart)",
                    abs(used - summary["frames"] - summary["gaps"]), "", f"<= {max(8, 1.2 * used / took):.0f}")
    measured.time("from delivery to the client, p50", summary["latency_p50_ms"] or float("nan"), "ms")
    measured.time("from delivery to the client, p99", summary["latency_p99_ms"] or float("nan"), "ms")
    measured.figure("a descriptor, median", summary["bytes_p50"] or float("nan"), "bytes")
    measured.figure("lightwelld's memory", rss / 1024, "MB")
    measured.figure("where the board's two processors' time goes, %", profile)
    if not summary["frames"]:
        raise Broken(f"no descriptor came\n{rig.journal()}")
    return {"rate": rate, **grown}


def usb_camera_yuyv(rig: Rig, test: Any, measured: Measured) -> None:
    """The kernel and the firmware's camera keep up; what the emulated processor estimates of it is reported, with its profile."""
    measure_stream(rig, test, measured, into_firmware=29)


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
    vivid.measure_loop(rig, test, measured)


def vivid_bayer12(rig: Rig, test: Any, measured: Measured) -> None:
    """Likewise."""
    vivid.measure_loop(rig, test, measured)


def limits(rig: Rig, test: Any, measured: Measured) -> None:
    """At which size and rate the emulated board gives out: the camera sends as fast as it is taken."""
    camera = rig.described(test.camera).usb_simulated
    for width, height in ((640, 480), (1280, 720), (1920, 1080)):
        sized = type(camera)()
        sized.CopyFrom(camera)
        sized.width, sized.height, sized.frame_rate = width, height, 60
        with rig.usb_camera(test.camera, arguments=["--pace", "free", *ahead(sized)]) as outside:
            uri = rig.configure(camera_text(rig, sized, rig.wait_for_video()), more=calibrate(rig, sized))
            time.sleep(2)
            begun = rig.snapshot(outside, uri)
            profile = rig.profile(6)
            summary = rig.watch(uri, 8)
            ended = rig.snapshot(outside, uri)
        took = ended["at"] - begun["at"]
        measured.time(f"{width}x{height}: frames into the firmware", (ended["frames"] - begun["frames"]) / took, "/s")
        measured.time(f"{width}x{height}: descriptors at the client", summary["frames_per_s"], "/s")
        measured.figure(f"{width}x{height}: where the board's two processors' time goes", profile)
