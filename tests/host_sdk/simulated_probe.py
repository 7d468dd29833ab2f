"""A lightwelld of this machine with the camera sim:city, for tests of clients in Python."""
import pathlib
import re
import subprocess
import time

TIMEOUT_S = 60


class SimulatedProbe:
    """Runs from the construction until the end of a `with` statement, or until stop(). `programs`: the folder with
    lightwelld; `folder`: for its log."""

    def __init__(self, programs, folder, *options):
        # A file never blocks the daemon as a pipe would.
        self.log = pathlib.Path(folder) / "lightwelld.log"
        with self.log.open("w") as log:
            self.process = subprocess.Popen(
                [pathlib.Path(programs) / "lightwelld", "--camera", "sim:city", "--size", "160x120", "--listen",
                 "127.0.0.1:0", *options], stdout=log, stderr=subprocess.STDOUT)

    def text_after(self, pattern):
        """Waits for a line of the daemon that matches; returns the pattern's groups."""
        end = time.monotonic() + TIMEOUT_S
        while time.monotonic() < end and self.process.poll() is None:
            found = re.search(pattern, self.log.read_text())
            if found:
                return found.groups()
            time.sleep(0.05)
        raise AssertionError(f"lightwelld printed no {pattern}: {self.log.read_text()}")

    def stop(self):
        self.process.terminate()
        self.process.wait()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
