"""How a test says that this machine lacks what it needs: never as a test that passed."""
import sys
import unittest


def main(missing: str | None, argv: list[str] | None = None) -> None:
    """Runs the tests of the program; with 77 and the reason as the last line where something is `missing`."""
    if missing:
        print(f"SKIP: {missing}")
        sys.exit(77)
    unittest.main(argv=argv)
