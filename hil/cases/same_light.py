"""Compares the light that the board's and the desktop's firmware estimate from the same frames."""

from __future__ import annotations

from pathlib import Path

from hil.harness.rig import Rig
from hil.harness.runner import Measured


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
