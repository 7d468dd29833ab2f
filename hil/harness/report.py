"""What a run found: figures instead of bare pass and fail, as Markdown for people and JSON for programs.

A Figure holds where what was measured is as asked; one that asks for nothing is reported. A Result is one test's: good
where it ran to its end and each of its figures holds. Results stay in a file from run to run, so that an entry of the
roster that was not run since the last commit is seen.
"""

import json
import math
import os
import tempfile
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

# How a limit is written, and what it means.
_LIMITS = {"<=": lambda measured, limit: measured <= limit, ">=": lambda measured, limit: measured >= limit,
           "==": lambda measured, limit: measured == limit}


@dataclass
class Figure:
    name: str
    measured: float | str
    unit: str = ""
    asked: str = ""  # "<= 3", ">= 30", "== 0"; empty: reported.
    timed: bool = False  # Of a clock: a busy machine moves it.

    @property
    def holds(self) -> bool:
        if not self.asked:
            return True
        sign, limit = self.asked.split(maxsplit=1)
        if isinstance(self.measured, str):
            return sign == "==" and self.measured == limit
        # NaN is what could not be measured.
        return not math.isnan(self.measured) and _LIMITS[sign](self.measured, float(limit))


@dataclass
class Result:
    test: str
    commit: str
    seconds: float
    figures: list[Figure] = field(default_factory=list)
    trouble: str = ""  # Why it did not run to its end.
    skipped: str = ""  # Why it could not run here. Not good, and no failure of what is tested.
    times_judged: bool = True

    @property
    def good(self) -> bool:
        return not self.trouble and not self.skipped and bool(self.figures) and all(
            f.holds for f in self.figures if self.times_judged or not f.timed)


def save(results: dict[str, Result], path: Path) -> None:
    """Whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False, encoding="utf-8") as file:
        json.dump({name: asdict(result) for name, result in results.items()}, file, indent=1)
    os.replace(file.name, path)


def load(path: Path) -> dict[str, Result]:
    """Of earlier runs; nothing where there were none."""
    if not path.exists():
        return {}
    raw: dict[str, dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))
    return {name: Result(**{**entry, "figures": [Figure(**figure) for figure in entry["figures"]]})
            for name, entry in raw.items()}


def _short(commit: str) -> str:
    return commit[:10] + (" with changes that are not committed" if commit.endswith("+") else "")


def stale(tests: list[Any], results: dict[str, Result], commit: str) -> list[str]:
    """Of the roster's tests those without a good run of this commit, with the reason."""
    out = []
    for test in tests:
        result = results.get(test.name)
        if result is None:
            out.append(f"{test.name}: never run")
        elif result.commit != commit:
            out.append(f"{test.name}: last run at {_short(result.commit)}, not at {_short(commit)}")
        elif not result.good:
            out.append(f"{test.name}: {result.skipped or result.trouble or 'a figure does not hold'}")
    return out


def _value(figure: Figure) -> str:
    if isinstance(figure.measured, str):
        return figure.measured
    return f"{figure.measured:.4g}"


def markdown(roster: Any, results: dict[str, Result], run: dict[str, str]) -> str:
    """`run`: what is to be known of the run itself, in the order in which it is said."""
    lines = ["# What the board did", ""]
    lines += [f"- {name}: {value}" for name, value in run.items()] + [""]
    good = sum(1 for test in roster.test if (r := results.get(test.name)) and r.good)
    lines += [f"{good} of {len(roster.test)} tests are good.", ""]
    for test in roster.test:
        result = results.get(test.name)
        state = "not run" if result is None else "good" if result.good else "SKIPPED" if result.skipped else "FAILED"
        where = ", ".join(part for part in (test.board, test.peer, test.camera, test.link) if part)
        lines += [f"## {test.name}: {state}", f"{test.what} ({where})", ""]
        if result is None:
            continue
        if result.skipped or result.trouble:
            lines += ["```", result.skipped or result.trouble, "```", ""]
        if result.figures:
            lines += ["| figure | asked | measured | holds |", "| --- | --- | --- | --- |"]
            lines += [
                f"| {f.name} | {f.asked or 'reported'} | {_value(f)} {f.unit} | {'yes' if f.holds else '**no**'} |"
                for f in result.figures
            ]
            lines += [""]
        lines += [f"{result.seconds:.0f} s", ""]
    return "\n".join(lines)
