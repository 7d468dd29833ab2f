#!/usr/bin/python3
"""hil/demo --board: runs the demo with the firmware on the emulated board and a simulated USB camera attached to it.
hil/demo calls it."""

import argparse
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from hil.cases.light import BRACKET  # noqa: E402
from hil.cases.stream import ahead, calibrate, camera_text  # noqa: E402
from hil.harness import roster  # noqa: E402
from hil.harness.board import BoardError  # noqa: E402
from hil.harness.image import NotBuilt  # noqa: E402
from hil.harness.rig import open_rig, prepare  # noqa: E402
from hil.harness.runner import CannotRun, TestFailure  # noqa: E402
from hil.harness.waits import TimedOut, say  # noqa: E402

# The roster's stitched 360-degree camera: a single lens does not see the whole sphere that the evaluation needs.
_CAMERA = "sphere"


def demo(scene: str, seconds: float, out: Path) -> int:
    everything: Any = roster.load()
    tools = prepare(ROOT)
    recording = out / "demo.lwr"
    recording.unlink(missing_ok=True)
    uri = f"sim:{scene}?rig=equirect"
    camera = next(entry for entry in everything.camera if entry.name == _CAMERA).usb_simulated
    say("booting the board")
    with open_rig(everything.board[0], everything, tools) as rig:
        say("the board runs; rendering the camera's frames and plugging it in")
        with rig.usb_camera(_CAMERA, scene=uri, arguments=ahead(camera, ",".join(BRACKET))):
            probe = rig.configure(
                camera_text(rig, camera, rig.wait_for_video(), exposure="&exposure=" + ",".join(BRACKET)),
                more=calibrate(rig, camera, uri),
            )
            say(f"lightwelld serves at {probe}; watching for {seconds:g} s")
            print(
                rig.client(["watch", probe, "--seconds", str(seconds), "--record", str(recording)],
                           timeout_s=seconds + 60),
                end="",
            )
    command = tools.report_command(recording, uri, camera, BRACKET, "--picture", out / "demo.png",
                                   "--title", f"{Path(scene).stem}, on the board")
    return subprocess.run(command, check=False).returncode


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", required=True)
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    try:
        status = demo(arguments.scene, arguments.seconds, arguments.out)
    except CannotRun as why:
        say(f"hil/demo: SKIP: {why}")
        return 77
    except (NotBuilt, BoardError, TestFailure, TimedOut) as why:
        say(f"hil/demo: {why}")
        return 3
    print(f"picture: {arguments.out / 'demo.png'}")
    return status


if __name__ == "__main__":
    sys.exit(main())
