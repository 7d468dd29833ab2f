#!/usr/bin/env python3
"""Addresses and forwarded ports."""
import unittest
import unittest.mock

import harness_path  # noqa: F401
from hil.harness import network
from hil.harness.qemu import QmpError

USERNET = """\
Hub -1 (net0):
  Protocol[State]    FD  Source Address  Port   Dest. Address  Port RecvQ SendQ
  TCP[HOST_FORWARD]  16       127.0.0.1 43911       10.77.0.2  7421     0     0
  TCP[HOST_FORWARD]  15       127.0.0.1 39231       10.77.0.2  7420     0     0
  TCP[HOST_FORWARD]  14       127.0.0.1 46573       10.77.0.2    22     0     0
"""


class Monitor:
    def __init__(self, text):
        self.text = text

    def monitor(self, line):
        assert line == "info usernet"
        return self.text


class User(unittest.TestCase):
    def test_host_ports_are_chosen_when_qemu_binds_them(self):
        words = " ".join(network.UserNetwork().arguments())
        self.assertIn("hostfwd=tcp:127.0.0.1:0-10.77.0.2:22,", words)
        self.assertIn("restrict=on", words)

    def test_learns_the_host_ports(self):
        net = network.UserNetwork()
        net.learn(Monitor(USERNET))
        self.assertEqual(net.reach(network.GRPC_PORT), ("127.0.0.1", 39231))
        self.assertEqual(net.reach(network.SSH_PORT), ("127.0.0.1", 46573))

    def test_a_missing_forward_is_an_error(self):
        with self.assertRaisesRegex(QmpError, "does not forward"):
            network.UserNetwork().learn(Monitor(USERNET.replace("7421", "7429")))

    def test_a_description_restores_the_network(self):
        net = network.UserNetwork(3)
        net.learn(Monitor(USERNET))
        again = network.network_from(net.describe())
        self.assertEqual(again.describe(), net.describe())
        self.assertEqual(again.host_command(["true"]), ["true"])


class Addresses(unittest.TestCase):
    def test_addresses_are_unique(self):
        for make in (network.board_address, network.mac_address):
            self.assertEqual(len({make(number) for number in range(1, 201)}), 200)
        self.assertNotIn(network.HOST, {network.board_address(number) for number in range(1, 201)})

    def test_numbers_out_of_range_are_rejected(self):
        for number in (0, 201):
            with self.assertRaises(network.NetworkError):
                network.board_address(number)

    def test_the_kernel_command_line_has_the_address(self):
        self.assertIn("lightwell.eth0=10.77.0.3/24", network.kernel_words(2, "b"))


class Tap(unittest.TestCase):
    def test_needs_root(self):
        with (
            unittest.mock.patch("os.geteuid", return_value=1000),
            self.assertRaisesRegex(network.NetworkError, "needs root"),
        ):
            network.TapNetwork("x").open()

    def test_programs_of_the_host_run_in_the_namespace(self):
        self.assertEqual(network.TapNetwork("x").host_command(["lightwell", "discover"]),
                         ["ip", "netns", "exec", "lightwell-x", "lightwell", "discover"])


if __name__ == "__main__":
    unittest.main()
