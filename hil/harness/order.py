"""The order in which tests run: random, so that no test depends on another, and reproducible from a seed."""

import random
from collections.abc import Sequence
from typing import Any


def shuffled(tests: Sequence[Any], seed: int) -> list[Any]:
    """A random order in which tests of one board are adjacent (starting a board takes long), and tests that need a
    fresh board after them (`needs_fresh_board_after`) come last on it."""
    chance = random.Random(seed)
    boards = sorted({test.board for test in tests})
    chance.shuffle(boards)
    out: list[Any] = []
    for board in boards:
        mine = sorted((test for test in tests if test.board == board), key=lambda test: test.name)
        chance.shuffle(mine)
        out += sorted(mine, key=lambda test: test.needs_fresh_board_after)
    return out
