"""What the board answers, against the desktop and against the truth."""

from __future__ import annotations

from typing import Any

from hil.cases.same_light import same_light
from hil.cases.stream import ahead, calibrate, camera_text
from hil.harness.rig import Rig
from hil.harness.runner import Measured

# UVC's shortest exposure is 100 us: it holds the courtyard's brightest lamp, but not a sun, which would be flagged as
# clipped. From there in even ratios to where the walls are well exposed.
BRACKET = ("0.0001", "0.0012", "0.0144")


def equals_the_desktop(rig: Rig, test: Any, measured: Measured) -> None:
    """The same frames, recorded on the board, through the board's firmware and through the desktop's."""
    camera = type(rig.described(test.camera).usb_simulated)()
    camera.CopyFrom(rig.described(test.camera).usb_simulated)
    # So slow that both take every frame, for what is compared is arithmetic.
    camera.width, camera.height, camera.frame_rate = 320, 240, 15
    frames = rig.folder / "frames.lwr"
    with rig.usb_camera(test.camera, arguments=ahead(camera)):
        calibration = calibrate(rig, camera)
        rig.configure(camera_text(rig, camera, rig.wait_for_video()),
                      more=calibration + 'record { path: "/var/lib/lightwell/frames.lwr" }\n')
        rig.wait_for_recorded(40)
        rig.board.run("systemctl stop lightwelld", check=True, timeout_s=60)
        rig.board.copy_out("/var/lib/lightwell/frames.lwr", frames)
    same_light(rig, frames, "/var/lib/lightwell/frames.lwr", measured)


def bracket(rig: Rig, test: Any, measured: Measured) -> None:
    """Three exposures, set through the kernel's controls frame by frame, against the scene's own light."""
    camera = rig.described(test.camera).usb_simulated
    recording = rig.folder / "bracket.lwr"
    with rig.usb_camera(test.camera, arguments=ahead(camera, ",".join(BRACKET))) as outside:
        uri = rig.configure(camera_text(rig, camera, rig.wait_for_video(), exposure="&exposure=" + ",".join(BRACKET)),
                            more=calibrate(rig, camera), timeout_s=300)
        rig.record(uri, 10, recording)
        info = rig.info(uri)
        controls = outside.counters()["counters"]["controls_set"]
    report = rig.evaluate(recording, camera.scene, camera, BRACKET)
    measured.figure("descriptors", report["frames"], "", ">= 20")
    # Of the simulated sensor on the desktop 1 % was promised.
    measured.figure("irradiance error, median", 100 * report["median_error"], "%", "<= 1.5")
    measured.figure("irradiance error, largest", 100 * report["largest_error"], "%", "<= 1.5")
    measured.figure("descriptors whose bound holds", 100 * report["held"] / max(1, report["frames"]), "%", ">= 99")
    measured.figure("descriptors that were flagged", 100 * report["flagged"] / max(1, report["frames"]), "%", "<= 10")
    measured.figure("brackets that lacked an exposure, counted", info["brackets_incomplete"])
    measured.figure("exposures that the camera was given", controls, "", ">= 20")
