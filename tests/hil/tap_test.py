#!/usr/bin/env python3
"""As root: a wire is made and taken away."""
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
    def test_a_wire_comes_and_goes_with_its_boards(self):
        wire = f"test{os.getpid()}"
        first, second = network.TapNetwork(wire, 1), network.TapNetwork(wire, 2)
        try:
            first.open()
            second.open()
            first.open()  # As after a run that died.
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
        second.close()  # Once more does no harm.


if __name__ == "__main__":
    skipping.main(missing())
