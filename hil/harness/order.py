"""In which order tests run: random, so that none leans on another, and the same again for the same seed."""

import random
from collections.abc import Sequence
from typing import Any


def shuffled(tests: Sequence[Any], seed: int) -> list[Any]:
    """Tests that share a board stay together, for starting one takes long; those that spoil it come last."""
    chance = random.Random(seed)
    boards = sorted({test.board for test in tests})
    chance.shuffle(boards)
    out: list[Any] = []
    for board in boards:
        mine = sorted((test for test in tests if test.board == board), key=lambda test: test.name)
        chance.shuffle(mine)
        out += [test for test in mine if not test.spoils_board] + [test for test in mine if test.spoils_board]
    return out
