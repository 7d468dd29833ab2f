"""The network between a board and this machine.

The board's address is 10.77.0.2 (10.77.0.N+1 for number N on the wire) and the host's is 10.77.0.1.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from .processes import output_of
from .qemu import Qmp, QmpError

HOST = "10.77.0.1"
SSH_PORT = 22
GRPC_PORT = 7420
PAIRING_PORT = 7421
PORTS = (SSH_PORT, GRPC_PORT, PAIRING_PORT)


class NetworkError(Exception):
    """The network cannot be set up on this machine; the text says why."""


def board_address(number: int) -> str:
    """The address of the board with that number on its wire; numbers start at 1."""
    if not 1 <= number <= 200:
        raise NetworkError(f"boards on a wire have numbers from 1 to 200, not {number}")
    return f"10.77.0.{number + 1}"


def mac_address(number: int) -> str:
    return f"52:54:00:6c:77:{number:02x}"


def kernel_words(number: int, name: str) -> list[str]:
    """Network settings for the kernel's command line; a udev rule below hil/image/root reads the address."""
    return ["net.ifnames=0", f"lightwell.eth0={board_address(number)}/24", f"systemd.hostname={name}"]


@dataclass
class UserNetwork:
    """QEMU's user network with forwarded ports. The kernel chooses the free host ports when QEMU binds them, so that no
    other program can take one in between."""
    number: int = 1
    # Ports of the board that are forwarded; `ports` maps them to host ports once QEMU runs.
    wanted: tuple[int, ...] = PORTS
    ports: dict[int, int] = field(default_factory=dict)

    def open(self) -> None:
        """Does nothing: QEMU sets this network up."""

    def close(self) -> None:
        """Does nothing: this network ends with QEMU."""

    def arguments(self) -> list[str]:
        # restrict: isolates the board from other networks, in both directions (mDNS, too).
        forwards = "".join(f",hostfwd=tcp:127.0.0.1:0-{board_address(self.number)}:{port}" for port in self.wanted)
        return ["-netdev",
                f"user,id=net0,net=10.77.0.0/24,host={HOST},dns=10.77.0.3,dhcpstart=10.77.0.220,restrict=on{forwards}",
                "-device", f"virtio-net-pci,netdev=net0,mac={mac_address(self.number)},romfile="]

    def learn(self, qmp: Qmp) -> None:
        """Reads from QEMU which host ports it bound."""
        shown = qmp.monitor("info usernet")
        self.ports = {int(guest): int(host)
                      for host, guest in re.findall(r"TCP\[HOST_FORWARD\]\s+\S+\s+\S+\s+(\d+)\s+\S+\s+(\d+)", shown)}
        if set(self.ports) != set(self.wanted):
            raise QmpError(f"QEMU does not forward the ports {self.wanted}: {shown}")

    def reach(self, port: int) -> tuple[str, int]:
        """Host and port at which this machine reaches the board's `port`."""
        return "127.0.0.1", self.ports[port]

    def host_command(self, command: Sequence[str]) -> list[str]:
        """`command`, extended so that the process it starts can reach the board."""
        return list(command)

    def describe(self) -> dict[str, object]:
        return {"kind": "user", "number": self.number, "ports": {str(port): host for port, host in self.ports.items()}}


def _ip(*words: str) -> str:
    return output_of(["ip", *words], NetworkError)


@dataclass
class TapNetwork:
    """A bridge with the host's address in the network namespace lightwell-WIRE, and one tap device per board. Boards
    with the same wire and different numbers can reach each other. Programs of the host must run in the namespace: see
    host_command().
    """
    wire: str
    number: int = 1

    @property
    def namespace(self) -> str:
        return f"lightwell-{self.wire}"

    @property
    def tap(self) -> str:
        return f"tap{self.number}"

    def open(self) -> None:
        if os.geteuid() != 0:
            raise NetworkError("a network namespace needs root: use the user network, or run as root")
        if not os.path.exists("/dev/net/tun"):
            raise NetworkError("there is no /dev/net/tun on this machine")
        if self.namespace not in _ip("netns", "list").split():
            _ip("netns", "add", self.namespace)
            self._inside("link", "set", "lo", "up")
            self._inside("link", "add", "br0", "type", "bridge", "forward_delay", "0")
            self._inside("address", "add", f"{HOST}/24", "dev", "br0")
            self._inside("link", "set", "br0", "up")
        self._remove_tap()
        self._inside("tuntap", "add", self.tap, "mode", "tap")
        self._inside("link", "set", self.tap, "master", "br0", "up")

    def close(self) -> None:
        """Removes the board's tap device, and the namespace with the last one."""
        if self.namespace not in _ip("netns", "list").split():
            return
        self._remove_tap()
        if " tap" not in self._inside("link", "show"):
            _ip("netns", "delete", self.namespace)

    def _inside(self, *words: str) -> str:
        return _ip("-n", self.namespace, *words)

    def _remove_tap(self) -> None:
        if f" {self.tap}:" in self._inside("link", "show"):
            self._inside("link", "delete", self.tap)

    def arguments(self) -> list[str]:
        return ["-netdev", f"tap,id=net0,ifname={self.tap},script=no,downscript=no",
                "-device", f"virtio-net-pci,netdev=net0,mac={mac_address(self.number)},romfile="]

    def learn(self, qmp: Qmp) -> None:
        """Does nothing: the addresses are fixed."""

    def reach(self, port: int) -> tuple[str, int]:
        return board_address(self.number), port

    def host_command(self, command: Sequence[str]) -> list[str]:
        return ["ip", "netns", "exec", self.namespace, *command]

    def describe(self) -> dict[str, object]:
        return {"kind": "tap", "number": self.number, "wire": self.wire, "namespace": self.namespace}


Network = UserNetwork | TapNetwork


def network_from(description: dict) -> Network:
    """The network that describe() described."""
    if description["kind"] == "tap":
        return TapNetwork(description["wire"], description["number"])
    ports = {int(port): host for port, host in description["ports"].items()}
    return UserNetwork(description["number"], tuple(ports), ports)
