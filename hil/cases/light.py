"""What the board answers, against the desktop and against the truth."""

from __future__ import annotations

from typing import Any

from hil.cases.stream import ahead, calibrate, camera_text
from hil.harness.rig import Rig
from hil.harness.runner import Measured

# UVC's shortest exposure is 100 us: it holds the courtyard's brightest lamp, but not a sun, which would be flagged as clipped.
# From there in even ratios to where the walls are well exposed.
BRACKET = ("0.0001", "0.0012", "0.0144")


def equals_the_desktop(rig: Rig, test: Any, measured: Measured) -> None:
    """The same frames, recorded on the board, through the board's firmware and through the desktop's."""
    camera = type(rig.described(test.camera).usb_simulated)()
    camera.CopyFrom(rig.described(test.camera).usb_simulated)
    # So slow that both take every frame, for what is compared is arithmetic.
    camera.width, camera.height, camera.frame_rate = 320, 240, 15
    frames, on_board, on_desktop = rig.folder / "frames.lwr", rig.folder / "board.lwr", rig.folder / "desktop.lwr"
    with rig.usb_camera(test.camera, arguments=ahead(camera)):
        calibration = calibrate(rig, camera)
        rig.configure(camera_text(rig, camera, rig.wait_for_video()),
                      more=calibration + 'record { path: "/var/lib/lightwell/frames.lwr" }\n')
        rig.wait_for_recorded(40)
        rig.board.run("systemctl stop lightwelld", check=True, timeout_s=60)
        rig.board.copy_out("/var/lib/lightwell/frames.lwr", frames)
    # Again and again, so that there is something to compare whenever a client comes.
    uri = rig.configure('uri: "replay:/var/lib/lightwell/frames.lwr?loop=30"')
    rig.record(uri, 12, on_board)
    dropped = rig.info(uri)["captures_dropped"]
    with rig.desktop_daemon(f"replay:{frames}?loop=30") as desktop:
        rig.record_here(desktop, 25, on_desktop)
    measured.figure("captures that the board dropped, after which its smoothing is another", dropped, "", "== 0")
    apart = rig.compare(on_board, on_desktop)
    measured.figure("descriptors that both made", apart["both"], "", ">= 20")
    measured.figure("of these, with every number of their light the same", apart["same"])
    # Sums over pixels are made in lanes, four of NEON, eight or sixteen of AVX: floats are added in another order. What that
    # moves must stay below what the wire rounds anyway, half a step of 13 bits of each coefficient.
    measured.figure("irradiance: RMS of the difference by RMS of the light, largest", 100 * apart["irradiance"], "%", "<= 0.02")
    measured.figure("directions of lights, largest difference", apart["direction_deg"], "deg", "<= 0.01")
    measured.figure("lights that only one of them found", apart["unmatched"], "", "== 0")


def bracket(rig: Rig, test: Any, measured: Measured) -> None:
    """Three exposures, set through the kernel's controls frame by frame, against the scene's own light."""
    camera = rig.described(test.camera).usb_simulated
    recording = rig.folder / "bracket.lwr"
    with rig.usb_camera(test.camera, arguments=ahead(camera, ",".join(BRACKET))) as outside:
        uri = rig.configure(camera_text(rig, camera, rig.wait_for_video(), exposure="&exposure=" + ",".join(BRACKET)),
                            more=calibrate(rig, camera), timeout_s=300)
        rig.record(uri, 15, recording)
        info = rig.info(uri)
        controls = outside.counters()["counters"]["controls_set"]
    report = rig.judge(recording, camera.scene, camera, BRACKET)
    measured.figure("descriptors", report["frames"], "", ">= 20")
    # Of the simulated sensor on the desktop 1 % was promised.
    measured.figure("irradiance error, median", 100 * report["median_error"], "%", "<= 1.5")
    measured.figure("irradiance error, largest", 100 * report["largest_error"], "%", "<= 1.5")
    measured.figure("descriptors whose bound holds", 100 * report["held"] / max(1, report["frames"]), "%", ">= 99")
    measured.figure("descriptors that were flagged", 100 * report["flagged"] / max(1, report["frames"]), "%", "<= 10")
    measured.figure("brackets that lacked an exposure, counted", info["brackets_incomplete"])
    measured.figure("exposures that the camera was given", controls, "", ">= 20")
