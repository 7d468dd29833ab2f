#!/usr/bin/env python3
"""Needs root: creates and removes a tap network."""
import os
import subprocess
import unittest

import harness_path  # noqa: F401
import skipping
from hil.harness import network


def missing():
    wire = network.TapNetwork(f"ask{os.getpid()}")
    try:
        wire.open()
        wire.close()
    except network.NetworkError as error:
        return str(error)
    return None


class Tap(unittest.TestCase):
    def test_a_wire_exists_while_it_has_boards(self):
        wire = f"test{os.getpid()}"
        first, second = network.TapNetwork(wire, 1), network.TapNetwork(wire, 2)
        try:
            first.open()
            second.open()
            first.open()  # Again, as after a run that died.
            shown = subprocess.run(
                first.host_command(["ip", "-brief", "address"]), text=True, stdout=subprocess.PIPE, check=True
            )
            self.assertIn(network.HOST, shown.stdout)
            for tap in ("tap1", "tap2"):
                self.assertIn(tap, shown.stdout)
            first.close()
            self.assertTrue(os.path.exists(f"/run/netns/{first.namespace}"), "the second board is still on it")
        finally:
            first.close()
            second.close()
        self.assertFalse(os.path.exists(f"/run/netns/{first.namespace}"))
        second.close()  # Closing twice is allowed.


if __name__ == "__main__":
    skipping.main(missing())
