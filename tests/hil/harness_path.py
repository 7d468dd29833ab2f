"""Lets the tests import hil/harness as `harness`."""
import pathlib
import sys

HIL = pathlib.Path(__file__).resolve().parents[2] / "hil"
sys.path.insert(0, str(HIL))
