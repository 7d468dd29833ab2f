#!/usr/bin/env python3
"""The table of the Planckian locus that the SDK's colour temperatures use, in C++, TypeScript and C#.

usage: planckian_locus.py ROOT            check: fails if a table of the tree differs
       planckian_locus.py ROOT --write    write the tables
       planckian_locus.py --self-test     check that the checker can fail
CIE 1960 u, v of black bodies of 1000 K * 1.02^(i - 1), by Planck's law (c2 = 1.4388e-2 m K, CIE 15:2004) and the colour
matching functions of cie1931.csv beside this program, summed at every nanometre.
"""

import math
import re
import sys
from pathlib import Path

FILES = ("host_sdk/src/core/planckian_locus.hpp", "host_sdk/bindings/typescript/src/planckian_locus.ts",
         "host_sdk/bindings/unity/Runtime/Managed/PlanckianLocus.cs")
TABLE = re.compile(r"( *)// planckian_locus\.py: begin\n.*?// planckian_locus\.py: end\n", re.DOTALL)
LOWEST_K, STEP, COUNT = 1000.0, 1.02, 236


def matching_functions():
    lines = (Path(__file__).parent / "cie1931.csv").read_text(encoding="utf-8").splitlines()
    return [tuple(float(v) for v in line.split(",")) for line in lines if not line.startswith("#")]


def uv_of(kelvin, functions):
    tristimulus = [0.0, 0.0, 0.0]
    for nanometres, *values in functions:
        metres = nanometres * 1e-9
        exitance = metres ** -5 / math.expm1(1.4388e-2 / (metres * kelvin))
        for k in range(3):
            tristimulus[k] += exitance * values[k]
    x, y, z = tristimulus
    return 4 * x / (x + 15 * y + 3 * z), 6 * y / (x + 15 * y + 3 * z)


def rows():
    functions = matching_functions()
    return [uv_of(LOWEST_K * STEP ** (i - 1), functions) for i in range(COUNT)]


def replaced(text, values):
    """The text with the numbers of `values` between its two marks; None without marks."""
    found = TABLE.search(text)
    if not found:
        return None
    indent = found[1]
    numbers = [f"{v:.12f}" for pair in values for v in pair]
    lines = [indent + ", ".join(numbers[i:i + 6]) + "," for i in range(0, len(numbers), 6)]
    table = f"{indent}// planckian_locus.py: begin\n" + "\n".join(lines) + f"\n{indent}// planckian_locus.py: end\n"
    return text[:found.start()] + table + text[found.end():]


def self_test():
    text = "a\n  // planckian_locus.py: begin\n  1, 2,\n  // planckian_locus.py: end\nb\n"
    once = replaced(text, [(0.5, 0.25)])
    assert once != text and "0.500000000000, 0.250000000000," in once
    assert replaced(once, [(0.5, 0.25)]) == once and replaced(once, [(0.5, 0.26)]) != once
    assert replaced("no marks", [(0.5, 0.25)]) is None
    print("the checker works")
    return 0


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    root, values, failures = Path(sys.argv[1]), rows(), 0
    for name in FILES:
        path = root / name
        text = path.read_text(encoding="utf-8")
        right = replaced(text, values)
        if right == text:
            continue
        if right is not None and "--write" in sys.argv[2:]:
            path.write_text(right, encoding="utf-8")
            continue
        print(f"{name}: the table is not that of planckian_locus.py; planckian_locus.py ROOT --write writes it")
        failures += 1
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
