"""Power failures."""

from __future__ import annotations

import random
import time
from typing import Any

from hil.harness.rig import Rig
from hil.harness.runner import Measured, TestFailure

_FILE = "/var/lib/lightwell/rig.textproto"
_CUTS = 3


def _kalibr(focal: float) -> str:
    return (f"cam0:\n  camera_model: pinhole\n  intrinsics: [{focal}, {focal}, 319.5, 239.5]\n  distortion_model: "
            "equidistant\n  distortion_coeffs: [0.01, -0.002, 0.0003, 0.0]\n  resolution: [640, 480]\n")


def _prepare(rig: Rig) -> None:
    """Writes two calibrations and a script that imports them in turn, endlessly. They are in /run, a tmpfs that is
    empty after a power cut."""
    for name, focal in (("old", 200.0), ("new", 215.5)):
        rig.board.run(f"cat > /run/{name}.yaml", text=_kalibr(focal), check=True)
    rig.board.run("cat > /run/save.sh", check=True, text=(
        "n=0; while true; do for f in old new; do\n"
        f"lightwell-calibrate import /run/$f.yaml --output {_FILE} >/dev/null || exit 1\n"
        "n=$((n+1)); echo $n > /run/saves; done; done\n"))


def _imported(rig: Rig) -> dict[str, str]:
    """The text of each calibration after its import."""
    command = ("lightwell-calibrate import /run/{0}.yaml --output /run/{0}.textproto >/dev/null && "
               "cat /run/{0}.textproto")
    whole = {name: rig.board.run(command.format(name), check=True).out for name in ("old", "new")}
    if whole["old"] == whole["new"]:
        raise TestFailure("the two imported calibrations are equal, so they cannot be distinguished after a cut")
    return whole


def cut_while_saving(rig: Rig, test: Any, measured: Measured) -> None:
    """QEMU is killed while two calibrations overwrite each other: afterwards the file holds one of them completely."""
    chance = random.Random(11)
    saves = cuts = 0
    found: list[str] = []
    whole: dict[str, str] = {}
    for _ in range(_CUTS):
        _prepare(rig)
        whole = whole or _imported(rig)
        rig.board.run(f"lightwell-calibrate import /run/old.yaml --output {_FILE}", check=True)
        rig.board.run("setsid sh /run/save.sh >/run/save.log 2>&1 & while [ ! -s /run/saves ]; do sleep 0.1; done",
                      check=True, timeout_s=120)
        time.sleep(1 + 3 * chance.random())
        saves += int(rig.board.run("cat /run/saves", check=True).out)
        rig.board.power_cut()
        cuts += 1
        rig.board.start()
        there = rig.board.run(f"cat {_FILE}", check=True).out
        found += [name for name, text in whole.items() if text == there] or ["neither"]
    measured.figure("times the plug was pulled", cuts, "", f"== {_CUTS}")
    measured.figure("calibrations saved before", saves, "", f">= {_CUTS}")
    measured.figure("afterwards neither the old nor the new was there whole", found.count("neither"), "", "== 0")
    measured.figure("what was there", ", ".join(found))
    left = rig.board.run("ls -A /var/lib/lightwell | grep -c 'rig.textproto[.]' || true").out.strip()
    measured.figure("unfinished files left beside it", float(left or 0), "", f"<= {_CUTS}")
