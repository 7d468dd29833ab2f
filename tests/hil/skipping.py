"""Skips a test program if this machine lacks something that it needs."""
import sys
import unittest


def main(missing: str | None, argv: list[str] | None = None) -> None:
    """Runs the program's tests. If something is `missing`, prints that reason and exits with 77 instead."""
    if missing:
        print(f"SKIP: {missing}")
        sys.exit(77)
    unittest.main(argv=argv)
