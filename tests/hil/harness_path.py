"""Lets the tests import hil.harness."""
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
HIL = ROOT / "hil"
sys.path.insert(0, str(ROOT))
