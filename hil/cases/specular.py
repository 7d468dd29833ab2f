"""Light from a glossy book, estimated on the board from rendered frames, compared with the desktop's firmware."""

from __future__ import annotations

import json
from typing import Any

from hil.cases.stream import measure_difference
from hil.harness.rig import Rig
from hil.harness.runner import Measured

# The first half of a sequence of 80: its views from above, about 8 degrees apart; played forth and back.
_FRAMES, _SEQUENCE = 40, 80
_PLAYED = "/var/lib/lightwell/book"
# Slow enough for the board, whose floating point is emulated, to process every frame. An estimate of the environment
# begins with the 39th frame and ends about 30 frames later.
_PERIOD_S, _SHOWN_S = 2, 220


def equals_the_desktop(rig: Rig, test: Any, measured: Measured) -> None:
    """The board's and the desktop's firmware process the same frames at the same rate, at the same time: poses and
    captured texels depend on the frames before and their times."""
    frames = rig.folder / "book"
    rig.book_frames(frames, frames=_FRAMES, sequence=_SEQUENCE, width=320, height=240, period_s=_PERIOD_S)
    rig.board.copy_in(frames, _PLAYED)
    on_board, on_desktop = rig.folder / "board.lwr", rig.folder / "desktop.lwr"
    uri = rig.configure(f'uri: "replay:{_PLAYED}?loop=0"',
                        more=f'plane {{ plane_file: "{_PLAYED}/book.textproto" }}\n')
    with rig.desktop_daemon(f"replay:{frames}?loop=0", "--estimator", "specular", "--plane",
                            frames / "book.textproto") as desktop:
        rig.record_all(_SHOWN_S, (uri, on_board), (desktop, on_desktop))
        info = rig.info(uri)
        lights = [json.loads(line) for line in rig.client(["query", uri, "--lights", "--json"]).splitlines()]
    measured.figure("frames that the board estimated", info["estimates"])
    measured.figure("frames that the board dropped", info["captures_dropped"], "", "== 0")
    measured.figure("frames in which it did not find the book", info["estimates_failed"], "", "== 0")
    measured.figure("lights that it found", sum("direction" in light for light in lights), "", ">= 1")
    measure_difference(rig, on_board, on_desktop, measured, least=90, irradiance_percent=0.1, direction_deg=0.1)
