"""Results of a run as measured values with limits, written as Markdown and as JSON.

A Figure holds if its measured value satisfies its limit; one without a limit is only reported. A Result belongs to one
test: it is good if the test ran to its end and all figures hold. Results are kept in a file between runs, so that
roster entries that were not run since the last commit can be found.
"""

import json
import math
import os
import tempfile
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

# Comparison operators of limits.
_LIMITS = {"<=": lambda measured, limit: measured <= limit, ">=": lambda measured, limit: measured >= limit,
           "==": lambda measured, limit: measured == limit}
# Members of Result that have another key in saved reports.
_SAVED_KEYS = {"error": "trouble", "check_times": "times_judged"}


@dataclass
class Figure:
    name: str
    measured: float | str
    unit: str = ""
    asked: str = ""  # The limit: "<= 3", ">= 30", "== 0"; empty: the value is only reported.
    timed: bool = False  # A time or a rate, which depends on the machine's load.

    @property
    def value(self) -> str:
        """The measured value as text."""
        return self.measured if isinstance(self.measured, str) else f"{self.measured:.4g}"

    @property
    def holds(self) -> bool:
        if not self.asked:
            return True
        sign, limit = self.asked.split(maxsplit=1)
        if isinstance(self.measured, str):
            return sign == "==" and self.measured == limit
        # NaN: the value could not be measured.
        return not math.isnan(self.measured) and _LIMITS[sign](self.measured, float(limit))


@dataclass
class Result:
    test: str
    commit: str
    seconds: float
    figures: list[Figure] = field(default_factory=list)
    error: str = ""  # Why the test did not run to its end.
    skipped: str = ""  # Why this machine cannot run the test. Neither good nor a failure.
    check_times: bool = True  # False: figures that are times or rates are reported, and their limits ignored.

    @property
    def good(self) -> bool:
        return not self.error and not self.skipped and bool(self.figures) and all(
            f.holds for f in self.figures if self.check_times or not f.timed)


def save(results: dict[str, Result], path: Path) -> None:
    """Replaces the file atomically."""
    path.parent.mkdir(parents=True, exist_ok=True)
    saved = {name: {_SAVED_KEYS.get(key, key): value for key, value in asdict(result).items()}
             for name, result in results.items()}
    with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False, encoding="utf-8") as file:
        json.dump(saved, file, indent=1)
    os.replace(file.name, path)


def load(path: Path) -> dict[str, Result]:
    """Results of earlier runs; empty if there is no file."""
    if not path.exists():
        return {}
    raw: dict[str, dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))
    members = {saved: member for member, saved in _SAVED_KEYS.items()}
    return {name: Result(**{**{members.get(key, key): value for key, value in entry.items()},
                            "figures": [Figure(**figure) for figure in entry["figures"]]})
            for name, entry in raw.items()}


def _short(commit: str) -> str:
    return commit[:10] + (" with uncommitted changes" if commit.endswith("+") else "")


def stale(tests: list[Any], results: dict[str, Result], commit: str) -> list[str]:
    """A line for each of the roster's tests without a good run of this commit, with the reason."""
    out = []
    for test in tests:
        result = results.get(test.name)
        if result is None:
            out.append(f"{test.name}: never run")
        elif result.commit != commit:
            out.append(f"{test.name}: last run at {_short(result.commit)}, not at {_short(commit)}")
        elif not result.good:
            out.append(f"{test.name}: {result.skipped or result.error or 'a figure does not hold'}")
    return out


def markdown(roster: Any, results: dict[str, Result], run: dict[str, str]) -> str:
    """The report as Markdown. `run`: names and values that describe the run itself, in the order of the report."""
    lines = ["# What the board did", ""]
    lines += [f"- {name}: {value}" for name, value in run.items()] + [""]
    good = sum(1 for test in roster.test if (r := results.get(test.name)) and r.good)
    lines += [f"{good} of {len(roster.test)} tests are good.", ""]
    for test in roster.test:
        result = results.get(test.name)
        state = "not run" if result is None else "good" if result.good else "SKIPPED" if result.skipped else "FAILED"
        where = ", ".join(part for part in (test.board, test.peer, test.camera, test.link) if part)
        lines += [f"## {test.name}: {state}", f"{test.description} ({where})", ""]
        if result is None:
            continue
        if result.skipped or result.error:
            lines += ["```", result.skipped or result.error, "```", ""]
        if result.figures:
            lines += ["| figure | asked | measured | holds |", "| --- | --- | --- | --- |"]
            lines += [f"| {f.name} | {f.asked or 'reported'} | {f.value} {f.unit} | {'yes' if f.holds else '**no**'} |"
                      for f in result.figures] + [""]
        lines += [f"{result.seconds:.0f} s", ""]
    return "\n".join(lines)
