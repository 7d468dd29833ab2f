"""The board's links: TLS and pairing, discovery, impaired network, USB."""

from __future__ import annotations

import json
import os
import re
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hil.cases.faults import check_daemon_survived
from hil.harness.board import Board
from hil.harness.rig import Rig
from hil.harness.runner import CannotRun, Measured, TestFailure
from hil.harness.waits import wait_for
from hil.harness.watcher import WatcherOnBoard

# These tests are about links: a small camera, simulated by the firmware itself, is enough.
_CAMERA = 'uri: "sim:studio?sensor=rgb8&rig=single" width: 160 height: 120 frame_rate: 10'
_USBIP_PORT = 3240
_VUDC_STATUS = "/sys/devices/platform/usbip-vudc.0/usbip_status"
_THERE, _DROPPED = "there", "dropped"


def tls_and_pairing(rig: Rig, test: Any, measured: Measured) -> None:
    """A client is paired with the board by a code and connects over TLS; a client without credentials is rejected."""
    rig.configure(_CAMERA, grpc='security: LINK_SECURITY_TLS key_folder: "/var/lib/lightwell/keys"')
    host, port = rig.board.network().reach(7420)
    _, pairing_port = rig.board.network().reach(7421)
    rig.board.run("lightwelld --pair --config /etc/lightwell/probe.textproto --camera none: --pair-listen 0.0.0.0:7421 "
                  ">/run/pair.log 2>&1 &", check=True)
    # Run as root, as an administrator would: the files that it writes must belong to the daemon's user all the same.
    code = wait_for("the pairing code", lambda: _code(rig.board.run("cat /run/pair.log").out), 60, every_s=0.5,
                    state=lambda: rig.board.run("cat /run/pair.log").out.strip())
    environment = {"XDG_CONFIG_HOME": str(rig.folder / "store")}
    begun = time.monotonic()
    rig.client(["pair", f"grpcs://{host}:{pairing_port}", "--code", code], environment=environment)
    measured.time("pairing took", time.monotonic() - begun, "s")
    summary = rig.watch(f"grpcs://{host}:{port}", 5, environment)
    measured.time("descriptors a second over TLS", summary["frames_per_s"], "/s", ">= 5")
    refused = rig.client(["watch", f"grpcs://{host}:{port}", "--seconds", "2", "--json"], good=range(256),
                         environment={"XDG_CONFIG_HOME": str(rig.folder / "nobody")})
    measured.figure("lines that a stranger without credentials got", len(refused.splitlines()), "", "== 0")
    plain = rig.client(["watch", f"grpc://{host}:{port}", "--seconds", "2", "--json"], good=range(256))
    measured.figure("lines that a client without TLS got", len(plain.splitlines()), "", "== 0")


def _code(said: str) -> str | None:
    """The six-digit pairing code in the output of lightwelld --pair."""
    found = re.search(r"(?<!\S)[.,:;]*(\d{6})[.,:;]*(?!\S)", said)
    return found and found.group(1)


def bad_network(rig: Rig, test: Any, measured: Measured) -> None:
    """Delay, loss, reordering and corruption of packets on the board's network card, by the kernel's netem."""
    uri = rig.configure(_CAMERA)
    if rig.board.run("modprobe sch_netem && tc qdisc add dev eth0 root netem delay 1ms").status != 0:
        raise TestFailure("the board's kernel has no netem")
    try:
        with rig.watcher(uri) as watcher:
            watcher.wait_for("light", 60, since=0)
            for name, rule in (("200 ms of delay, 50 of jitter", "delay 200ms 50ms"),
                               ("5 % of packets lost", "delay 20ms loss 5%"),
                               ("a quarter of packets out of order", "delay 20ms reorder 75% 50%"),
                               ("1 % of packets damaged", "delay 20ms corrupt 1%")):
                rig.board.run(f"tc qdisc replace dev eth0 root netem {rule}", check=True)
                lines = watcher.next_seconds(5, skipped=1)
                measured.time(f"{name}: descriptors a second", sum(line["frames"] for line in lines) / len(lines), "/s",
                              ">= 2")
                measured.time(f"{name}: age at arrival, p99, largest second",
                                max(line["age_p99_ms"] or 0 for line in lines), "ms")
                measured.figure(f"{name}: refused", lines[-1]["rejected"] - lines[0]["rejected"], "", "== 0")
            rig.board.run("tc qdisc del dev eth0 root", check=True)
            begun, since = time.monotonic(), len(watcher.seconds())
            watcher.wait_for("a second at the full rate", 60, since=since, frames=8)
            measured.time("full rate again after the network was good", time.monotonic() - begun, "s", "<= 4")
    finally:
        rig.board.run("tc qdisc del dev eth0 root 2>/dev/null; true")


@contextmanager
def _avahi(rig: Rig, folder: Path) -> Iterator[dict[str, str]]:
    """Runs a D-Bus daemon and an avahi-daemon on the board's wire, as on another computer of that network. Yields the
    environment for clients."""
    bus = folder / "bus"
    (folder / "bus.conf").write_text(
        f"<busconfig><type>system</type><listen>unix:path={bus}</listen><auth>EXTERNAL</auth>"
        '<policy context="default"><allow send_destination="*"/><allow receive_sender="*"/><allow own="*"/>'
        '<allow user="*"/></policy></busconfig>\n', encoding="utf-8")
    (folder / "avahi.conf").write_text("[server]\nhost-name=headset\nuse-ipv6=no\n[publish]\npublish-workstation=no\n"
                                       "publish-hinfo=no\n", encoding="utf-8")
    environment = {"DBUS_SYSTEM_BUS_ADDRESS": f"unix:path={bus}"}
    children = []
    try:
        bus_daemon = ["dbus-daemon", f"--config-file={folder / 'bus.conf'}", "--nofork", "--nopidfile"]
        children.append(subprocess.Popen(bus_daemon))
        wait_for("the bus", bus.exists, 20, every_s=0.05)
        # avahi-daemon keeps its process id in /run, so it gets a /run of its own.
        inside = ["unshare", "-m", "sh", "-c", "mount -t tmpfs none /run && mkdir /run/avahi-daemon && exec "
                  f"avahi-daemon --no-drop-root --no-chroot --no-rlimits -f {folder / 'avahi.conf'}"]
        children.append(subprocess.Popen(rig.board.host_command(inside), env={**os.environ, **environment},
                                         stderr=subprocess.DEVNULL))
        yield environment
    finally:
        for child in reversed(children):
            child.terminate()
            child.wait(20)


def found_by_mdns(rig: Rig, test: Any, measured: Measured) -> None:
    """`lightwell discover` on another machine of the wire finds the board."""
    if rig.board.options.net != "tap":
        raise CannotRun("multicast needs a board with net: \"tap\"")
    rig.configure(_CAMERA, more="discovery { mdns: MDNS_ON }\n")
    with tempfile.TemporaryDirectory() as folder, _avahi(rig, Path(folder)) as environment:
        begun = time.monotonic()

        def poll() -> Any:
            said = rig.client(["discover", "--json"], environment=environment, good=range(256))
            return next((line for line in map(json.loads, said.splitlines()) if line.get("name") == "board"), None)

        found = wait_for("the board to be found", poll, 60)
        measured.time("found after", time.monotonic() - begun, "s", "<= 20")
        links = [link["uri"] for link in found["links"] if link["uri"].startswith("grpc")]
        # Connects by the announced host name, which only multicast DNS resolves.
        summary = rig.watch(links[0], 4, environment)
    measured.figure("firmware's version", found["version"])
    measured.figure("ways in that it told", ", ".join(links))
    measured.time("descriptors a second by the name that it told", summary["frames_per_s"], "/s", ">= 5")


def usb_cable(rig: Rig, test: Any, measured: Measured) -> None:
    """The board's gadget on dummy_hcd, the SDK with libusb in the same guest; the gadget is unplugged and detached."""
    if rig.board.run("modprobe dummy_hcd is_super_speed=0 is_high_speed=1").status != 0:
        raise TestFailure("the board's kernel has no dummy_hcd")
    rig.board.run("lightwell-usb-gadget up --user lightwell", check=True, timeout_s=120)
    rig.configure(_CAMERA, more="usb_gadget {}\n")
    rig.board.run("lightwell-usb-gadget bind", check=True, timeout_s=60)
    with WatcherOnBoard(rig.board, "usb:") as client:
        client.back_after("light by cable", 60)
        before = rig.daemon()
        port = rig.board.run("for d in /sys/bus/usb/devices/*; do grep -qs Lightwell $d/manufacturer $d/product && "
                             "basename $d; done | head -1", check=True).out.strip()
        if not port:
            shown = rig.board.run("ls /sys/bus/usb/devices; dmesg | tail -5").out
            raise TestFailure(f"the gadget is not on the bus: {shown}")
        times: dict[str, list[float]] = {"unplugged": [], "detached": []}
        for _ in range(2):
            rig.board.run("lightwell-usb-gadget unbind", check=True)
            rig.board.run("lightwell-usb-gadget bind", check=True)
            times["unplugged"].append(client.back_after("light after the plug was pulled and put in", 60))
            rig.board.run(f"cd /sys/bus/usb/devices/{port} && echo 0 > authorized && echo 1 > authorized", check=True)
            times["detached"].append(client.back_after("light after the device was detached", 60))
        for name, values in times.items():
            measured.time(f"light again after it was {name}, larger of two", max(values), "s", "<= 8")
        check_daemon_survived(rig, before, measured)
        measured.figure("messages refused by the SDK", client.seconds()[-1]["rejected"], "", "== 0")


class UsbWire:
    """A USB connection between two boards by usbip. `device` has the gadget, which is bound to the controller
    `udc`; `host` attaches it."""

    udc = "usbip-vudc.0"

    def __init__(self, device: Board, host: Board) -> None:
        self.dropped = 0  # Attachments that the kernel dropped at once.
        self._device, self._host = device, host
        if device.run("modprobe usbip-vudc").status != 0 or host.run("modprobe vhci-hcd").status != 0:
            raise TestFailure("the board's kernel has no usbip")
        device.run("usbipd --device -D", check=True)
        self._address = device.network().reach(_USBIP_PORT)[0]

    def attach(self) -> float:
        """Attaches the gadget; returns when it is on the host's bus, with time.monotonic() at the start of the
        successful attempt. The kernel's usbip-vudc (6.1) may send a new host a response to a request of the previous
        one. Then usbip reads it instead of usbipd's response ("version mismatch: 0"), or vhci-hcd drops the gadget
        ("cannot find a urb of seqnum"). In both cases the gadget is attached again.
        """
        def attached() -> float | None:
            wait_for("the gadget to be free",
                     lambda: self._device.run(f"cat {_VUDC_STATUS}", check=True).out.strip() == "1", 30, every_s=0.3)
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


def usb_two_boards(rig: Rig, test: Any, measured: Measured) -> None:
    """The gadget on one board's usbip-vudc, the SDK on another board with vhci-hcd; usbip carries the USB packets over
    the network between them."""
    if rig.peer is None:
        raise TestFailure("the roster's entry has no peer")
    device = rig.board
    wire = UsbWire(device, rig.peer)
    device.run("lightwell-usb-gadget up --user lightwell", check=True, timeout_s=120)
    rig.configure(_CAMERA, more="usb_gadget {}\n")
    device.run(f"lightwell-usb-gadget bind --udc {wire.udc}", check=True)
    wire.attach()
    with WatcherOnBoard(rig.peer, "usb:") as client:
        client.back_after("light on the other board", 60)
        before = rig.daemon()
        lines = client.next_seconds(10)
        measured.time("descriptors a second on the other board", sum(line["frames"] for line in lines) / len(lines),
                      "/s", ">= 5")
        measured.figure("descriptors missing meanwhile, counted", lines[-1]["gaps"] - lines[0]["gaps"])
        measured.time("age of descriptors at their arrival, p99, largest second",
                      max(line["age_p99_ms"] or 0 for line in lines), "ms")
        times: dict[str, list[float]] = {"detached by its host": [], "hidden by its device": []}
        for _ in range(2):
            wire.detach()
            client.wait_until_silent()
            begun = wire.attach()
            client.back_after("light after the host attached it again", 60)
            times["detached by its host"].append(time.monotonic() - begun)
            device.run("lightwell-usb-gadget unbind", check=True)
            client.wait_until_silent()
            device.run(f"lightwell-usb-gadget bind --udc {wire.udc}", check=True)
            begun = wire.attach()
            client.back_after("light after the gadget was bound again", 60)
            times["hidden by its device"].append(time.monotonic() - begun)
        for name, values in times.items():
            measured.time(f"light again after it was {name}, larger of two", max(values), "s", "<= 8")
        check_daemon_survived(rig, before, measured)
        last = client.seconds()[-1]
        measured.figure("messages refused by the SDK", last["rejected"], "", "== 0")
        measured.figure("attachments that the kernel's usbip dropped at once, made again", wire.dropped)
        measured.figure("reconnects of the client", last["reconnects"], "", "== 4")
        measured.figure("firmware on the other board",
                        rig.peer.run(["systemctl", "is-active", "lightwelld"]).out.strip(), "", "== inactive")
