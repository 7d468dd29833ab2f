"""A USB connection between two boards by usbip: the gadget on the device's usbip-vudc, attached to its host's vhci."""

from __future__ import annotations

import time

from .board import Board
from .runner import TestFailure
from .waits import wait_for

_PORT = 3240
_STATUS = "/sys/devices/platform/usbip-vudc.0/usbip_status"
_THERE, _DROPPED = "there", "dropped"


class UsbWire:
    """`device` has the gadget, which is bound to the controller `udc`; `host` attaches it."""

    udc = "usbip-vudc.0"

    def __init__(self, device: Board, host: Board) -> None:
        self.dropped = 0  # Attachments that the kernel dropped at once.
        self._device, self._host = device, host
        if device.run("modprobe usbip-vudc").status != 0 or host.run("modprobe vhci-hcd").status != 0:
            raise TestFailure("the board's kernel has no usbip")
        device.run("usbipd --device -D", check=True)
        self._address = device.network().reach(_PORT)[0]

    def attach(self) -> float:
        """Attaches the gadget; returns when it is on the host's bus, with time.monotonic() at the start of the
        successful attempt. The kernel's usbip-vudc (6.1) may send a new host a response to a request of the previous
        one. Then usbip reads it instead of usbipd's response ("version mismatch: 0"), or vhci-hcd drops the gadget
        ("cannot find a urb of seqnum"). In both cases the gadget is attached again.
        """
        def attached() -> float | None:
            wait_for("the gadget to be free", lambda: self._device.run(f"cat {_STATUS}", check=True).out.strip() == "1",
                     30, every_s=0.3)
            begun = time.monotonic()
            said = self._host.run(f"usbip attach -r {self._address} -d {self.udc}")
            last.append(said.err.strip())
            outcome = said.status == 0 and wait_for("the gadget on the host's bus, or its port to be free again",
                                                    self._outcome, 30, every_s=0.2)
            if outcome == _THERE:
                return begun
            self.dropped += 1
            return None

        last: list[str] = []
        return wait_for("an attachment that stands", attached, 90,
                        state=lambda: f"{last[-1]} {self._host.run('dmesg | tail -n 3').out.strip()}")

    def detach(self) -> None:
        """Detaches the gadget on the host's side."""
        self._host.run("usbip detach -p 0", check=True)

    def _outcome(self) -> str | None:
        # Third column of vhci-hcd's status: the port's state; 4 is free.
        said = self._host.run(
            f"grep -qsx 'Lightwell light probe' /sys/bus/usb/devices/*/product && echo {_THERE} && exit; "
            f"awk 'NR > 1 && $3 != \"004\" {{ used = 1 }} END {{ if (!used) print \"{_DROPPED}\" }}' "
            "/sys/devices/platform/vhci_hcd.0/status")
        return said.out.strip() or None
