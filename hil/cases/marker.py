"""Light from a marker body, estimated on the board from path-traced images (an independent renderer), compared with the
desktop's firmware and with the true lamps."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hil.cases.stream import measure_difference
from hil.harness.rig import Rig
from hil.harness.runner import Measured

# A lamp behind the marker, which is determined by the faces together with the shadow on the table.
PICTURE = "grid_straight_white_back_right"
BODY = "dodecahedron_100mm_white.textproto"
_FRAMES = "/var/lib/lightwell/marker"
_BODY = f"/usr/share/lightwell/bodies/{BODY}"
# Longer than a search for body and lights takes on the board, whose floating point is emulated: 25 s, 50 on a busy
# machine. Lights that are 8 s old are searched again, so each frame has a search.
_PERIOD_S, _SHOWN_S = 55, 240


def equals_the_desktop(rig: Rig, test: Any, measured: Measured) -> None:
    """The board's and the desktop's firmware process the same images at the same rate, at the same time."""
    frames = rig.folder / "marker"
    # The board must process every frame, because directions are means over frames.
    rig.marker_frames(frames, [PICTURE], noisy=4, period_s=_PERIOD_S)
    rig.board.copy_in(frames, _FRAMES)
    on_board, on_desktop = rig.folder / "board.lwr", rig.folder / "desktop.lwr"
    uri = rig.configure(f'uri: "replay:{_FRAMES}?loop=0"', more=f'marker {{ body_file: "{_BODY}" }}\n')
    body = rig.tools.root / "firmware/estimate/marker/bodies" / BODY
    with rig.desktop_daemon(f"replay:{frames}?loop=0", "--estimator", "marker", "--body", body) as desktop:
        rig.record_all(_SHOWN_S, (uri, on_board), (desktop, on_desktop))
        info = rig.info(uri)
        lights = [json.loads(line)
                  for line in rig.client(["query", f"replay:{on_board}", "--lights", "--json"]).splitlines()]
    measured.figure("pictures that the board dropped", info["captures_dropped"], "", "== 0")
    measured.figure("pictures in which it did not find the marker", info["estimates_failed"], "", "== 0")
    directions = [light["direction"] for light in lights if "direction" in light]
    off = _degrees(directions[0], _true_lamp(rig)) if directions else 180
    measured.figure("its strongest light, from the lamp that was shown", off, "deg", "<= 3")
    # The compiler contracts products and sums on arm64 (FMA), and the fits of corners and lights stop at a small step,
    # so results differ slightly.
    measure_difference(rig, on_board, on_desktop, measured, least=3, irradiance_percent=0.1, direction_deg=0.1)


def _true_lamp(rig: Rig) -> list[float]:
    """Direction from the marker's centre to the lamp of the image."""
    scenes = json.loads((rig.tools.root / "tests/reference/mitsuba/marker/scenes.json").read_text(encoding="utf-8"))
    return scenes["frames"][PICTURE]["lamps"][0]["direction"]


def _degrees(a: Sequence[float], b: Sequence[float]) -> float:
    """The angle between two vectors in degrees."""
    return math.degrees(math.acos(max(-1, min(1, sum(x * y for x, y in zip(a, b)) / math.hypot(*a) / math.hypot(*b)))))
