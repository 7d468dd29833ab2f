"""How a board and this machine reach each other.

UserNetwork   needs no rights: QEMU forwards ports of the loopback address to the board
TapNetwork    as root: a wire in a network namespace of its own, on which board and host have addresses
On either the board is 10.77.0.2 (its number on the wire plus one) and the host 10.77.0.1.
"""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field

from .qmp import Qmp, QmpError

HOST = "10.77.0.1"
SSH_PORT = 22
GRPC_PORT = 7420
PAIRING_PORT = 7421
PORTS = (SSH_PORT, GRPC_PORT, PAIRING_PORT)


class NetworkError(Exception):
    """A network cannot be made here; the text says why."""


def board_address(number: int) -> str:
    """The address of the board with that number on its wire, from 1."""
    if not 1 <= number <= 200:
        raise NetworkError(f"boards on a wire have numbers from 1 to 200, not {number}")
    return f"10.77.0.{number + 1}"


def mac_address(number: int) -> str:
    return f"52:54:00:6c:77:{number:02x}"


def kernel_words(number: int, name: str) -> list[str]:
    """What the kernel's command line says of the network; a rule of udev reads it (hil/image/root)."""
    return ["net.ifnames=0", f"lightwell.eth0={board_address(number)}/24", f"systemd.hostname={name}"]


@dataclass
class UserNetwork:
    """Ports are free ones, chosen by the kernel when QEMU binds them: no other program can be given the same in
    between."""
    number: int = 1
    # The board's ports that can be reached, and by which of ours once QEMU runs.
    wanted: tuple[int, ...] = PORTS
    ports: dict[int, int] = field(default_factory=dict)

    def open(self) -> None:
        """Nothing to be made."""

    def close(self) -> None:
        """Ends with QEMU."""

    def arguments(self) -> list[str]:
        # restrict: what a board sends out reaches nobody, and no other machine's mDNS reaches it.
        forwards = "".join(f",hostfwd=tcp:127.0.0.1:0-{board_address(self.number)}:{port}" for port in self.wanted)
        return [
            "-netdev",
            f"user,id=net0,net=10.77.0.0/24,host={HOST},dns=10.77.0.3,dhcpstart=10.77.0.220,restrict=on{forwards}",
            "-device",
            f"virtio-net-pci,netdev=net0,mac={mac_address(self.number)},romfile=",
        ]

    def learn(self, qmp: Qmp) -> None:
        """Asks QEMU which ports it was given."""
        shown = qmp.monitor("info usernet")
        self.ports = {int(guest): int(host)
                      for host, guest in re.findall(r"TCP\[HOST_FORWARD\]\s+\S+\s+\S+\s+(\d+)\s+\S+\s+(\d+)", shown)}
        if set(self.ports) != set(self.wanted):
            raise QmpError(f"QEMU does not forward the ports {self.wanted}: {shown}")

    def reach(self, port: int) -> tuple[str, int]:
        """Host and port by which the board's `port` is reached from this machine."""
        return "127.0.0.1", self.ports[port]

    def host_command(self, command: Sequence[str]) -> list[str]:
        """`command` as it must be started to reach the board."""
        return list(command)

    def describe(self) -> dict[str, object]:
        return {"kind": "user", "number": self.number, "ports": {str(port): host for port, host in self.ports.items()}}


def _ip(*words: str) -> str:
    try:
        done = subprocess.run(
            ["ip", *words],
            text=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            check=False,
        )
    except FileNotFoundError as error:
        raise NetworkError("ip is not installed: run cmake/setup") from error
    if done.returncode != 0:
        raise NetworkError(f"ip {' '.join(words)}: {done.stderr.strip()}")
    return done.stdout


@dataclass
class TapNetwork:
    """A bridge with the host's address in the network namespace lightwell-WIRE, and one tap a board. Boards that name
    the same wire and have different numbers see each other. Programs of the host are started in the namespace:
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
            raise NetworkError("a network namespace needs root: take the user network, or run it as root")
        if not os.path.exists("/dev/net/tun"):
            raise NetworkError("there is no /dev/net/tun on this machine")
        if self.namespace not in _ip("netns", "list").split():
            _ip("netns", "add", self.namespace)
            inside = ("-n", self.namespace)
            _ip(*inside, "link", "set", "lo", "up")
            _ip(*inside, "link", "add", "br0", "type", "bridge", "forward_delay", "0")
            _ip(*inside, "address", "add", f"{HOST}/24", "dev", "br0")
            _ip(*inside, "link", "set", "br0", "up")
        inside = ("-n", self.namespace)
        if f" {self.tap}:" in _ip(*inside, "link", "show"):
            _ip(*inside, "link", "delete", self.tap)
        _ip(*inside, "tuntap", "add", self.tap, "mode", "tap")
        _ip(*inside, "link", "set", self.tap, "master", "br0", "up")

    def close(self) -> None:
        """Takes the board off the wire, and the wire away with its last board."""
        if self.namespace not in _ip("netns", "list").split():
            return
        inside = ("-n", self.namespace)
        if f" {self.tap}:" in _ip(*inside, "link", "show"):
            _ip(*inside, "link", "delete", self.tap)
        if " tap" not in _ip(*inside, "link", "show"):
            _ip("netns", "delete", self.namespace)

    def arguments(self) -> list[str]:
        return ["-netdev", f"tap,id=net0,ifname={self.tap},script=no,downscript=no",
                "-device", f"virtio-net-pci,netdev=net0,mac={mac_address(self.number)},romfile="]

    def learn(self, qmp: Qmp) -> None:
        """Nothing to be asked: the addresses are fixed."""

    def reach(self, port: int) -> tuple[str, int]:
        return board_address(self.number), port

    def host_command(self, command: Sequence[str]) -> list[str]:
        return ["ip", "netns", "exec", self.namespace, *command]

    def describe(self) -> dict[str, object]:
        return {"kind": "tap", "number": self.number, "wire": self.wire, "namespace": self.namespace}


Network = UserNetwork | TapNetwork


def network_from(description: dict) -> Network:
    """The network that describe() told of."""
    if description["kind"] == "tap":
        return TapNetwork(description["wire"], description["number"])
    ports = {int(port): host for port, host in description["ports"].items()}
    return UserNetwork(description["number"], tuple(ports), ports)
