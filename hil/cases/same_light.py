"""Whether the board's firmware and the desktop's make the same light of the same frames.

same_light   plays frames through both
tell_apart   what tells two recordings of light apart, as figures
"""

from __future__ import annotations

from pathlib import Path

from hil.harness.rig import Rig
from hil.harness.runner import Measured


def same_light(
    rig: Rig, frames: Path, there: str, measured: Measured, *, board_s: float = 6, desktop_s: float = 14
) -> None:
    """Plays a recording of frames through both, for so long each: it is on the board as `there`, here as `frames`."""
    on_board, on_desktop = rig.folder / "board.lwr", rig.folder / "desktop.lwr"
    # Again and again, so that there is something to compare whenever a client comes.
    uri = rig.configure(f'uri: "replay:{there}?loop=0"')
    rig.record(uri, board_s, on_board)
    dropped = rig.info(uri)["captures_dropped"]
    with rig.desktop_daemon(f"replay:{frames}?loop=0") as desktop:
        rig.record_here(desktop, desktop_s, on_desktop)
    measured.figure("captures that the board dropped, after which its smoothing is another", dropped, "", "== 0")
    # Sums over pixels are made in lanes, four of NEON, eight or sixteen of AVX: floats are added in another order. What
    # that moves must stay below what the wire rounds anyway, half a step of 13 bits of each coefficient.
    tell_apart(rig, on_board, on_desktop, measured, least=20, irradiance_percent=0.02, direction_deg=0.01)


def tell_apart(rig: Rig, on_board: Path, on_desktop: Path, measured: Measured, *, least: int, irradiance_percent: float,
               direction_deg: float) -> None:
    """What tells two recordings of light apart: at `least` so many descriptors, and no more than so much."""
    apart = rig.compare(on_board, on_desktop)
    measured.figure("descriptors that both made", apart["both"], "", f">= {least}")
    measured.figure("of these, with every number of their light the same", apart["same"])
    measured.figure("irradiance: RMS of the difference by RMS of the light, largest", 100 * apart["irradiance"], "%",
                    f"<= {irradiance_percent}")
    measured.figure("directions of lights, largest difference", apart["direction_deg"], "deg", f"<= {direction_deg}")
    measured.figure("lights that only one of them found", apart["unmatched"], "", "== 0")
