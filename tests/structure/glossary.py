#!/usr/bin/env python3
"""Holds the tree to the field's words: fails on a name or phrase of the left column of glossary.txt.

usage: glossary.py --root DIR    check the files that git tracks there
       glossary.py --self-test   check the checker
"""
import argparse
import fnmatch
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).resolve().parent
SUFFIXES = (".hpp", ".h", ".cpp", ".c", ".py", ".ts", ".cs", ".md", ".proto")
SECTIONS = ("names", "phrases", "allowed")


class Entry(NamedTuple):
    not_this: str
    but: str
    where: str  # Of the names and phrases that may stay: a pattern of paths.
    line: int


def read_glossary(path: Path) -> dict[str, list[Entry]]:
    """Lines of [names] and [phrases] are `not | but`, of [allowed] `pattern of paths | word | reason`."""
    entries: dict[str, list[Entry]] = {section: [] for section in SECTIONS}
    section = ""
    for number, raw in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        text = raw.split("#")[0].strip()
        if not text:
            continue
        if text.startswith("["):
            section = text.strip("[]")
            continue
        parts = [part.strip() for part in text.split("|")]
        if section not in SECTIONS or len(parts) != (3 if section == "allowed" else 2) or not all(parts):
            sys.exit(f"{path}:{number}: not 'not | but', or 'paths | word | reason' under [allowed]")
        if section == "allowed":
            entries[section].append(Entry(parts[1], parts[2], parts[0], number))
        else:
            entries[section].append(Entry(parts[0], parts[1], "", number))
    return entries


def tracked(root: Path) -> list[str]:
    done = subprocess.run(["git", "-C", root, "ls-files"], stdout=subprocess.PIPE, text=True, check=True)
    own = f"{HERE.name}/glossary."
    return [name for name in done.stdout.splitlines() if name.endswith(SUFFIXES) and own not in name]


def findings(root: Path, glossary: dict[str, list[Entry]], files: list[str]) -> list[str]:
    """A line for each use, `file:line: 'word': 'other word'`, and one for each permission that nothing needs."""
    words = {entry.not_this: entry for entry in glossary["names"]}
    name = re.compile(r"\b[A-Za-z_]\w*\b")
    phrases = [(re.compile(r"\b" + re.escape(e.not_this) + r"\b", re.IGNORECASE), e) for e in glossary["phrases"]]
    used, found = set(), []
    for file in files:
        allowed = {e.not_this: e for e in glossary["allowed"] if fnmatch.fnmatch(file, e.where)}
        for number, line in enumerate((root / file).read_text(encoding="utf-8").splitlines(), 1):
            hits = [words[word] for word in name.findall(line) if word in words]
            hits += [entry for pattern, entry in phrases if pattern.search(line)]
            for entry in hits:
                if entry.not_this in allowed:
                    used.add(allowed[entry.not_this])
                else:
                    found.append(f"{file}:{number}: '{entry.not_this}': '{entry.but}'")
    idle = [e for e in glossary["allowed"] if e not in used]
    return found + [f"glossary.txt:{e.line}: nothing in {e.where} says '{e.not_this}': take the line out" for e in idle]


def self_test() -> int:
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        (root / "glossary.txt").write_text(
            "[names]\nTold | Hypothesis  # of a fit\n[phrases]\nwho asks | the caller\n[allowed]\n"
            "old/*.cpp | Told | frozen\nold/*.hpp | Told | frozen\n")
        glossary = read_glossary(root / "glossary.txt")
        cases = {"a.cpp": "struct Told {};\nint Tolded, xTold;\n", "b.md": "It depends on Who asks.\n",
                 "old/c.cpp": "Told t;\n"}
        (root / "old").mkdir()
        for name, text in cases.items():
            (root / name).write_text(text)
        found = findings(root, glossary, list(cases))
    expected = ["a.cpp:1: 'Told': 'Hypothesis'", "b.md:1: 'who asks': 'the caller'",
                "glossary.txt:7: nothing in old/*.hpp says 'Told': take the line out"]
    if found != expected:
        print("\n".join(["glossary.py finds:", *found, "and should find:", *expected]))
    return int(found != expected)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path)
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        return self_test()
    if not arguments.root:
        parser.error("--root DIR or --self-test")
    found = findings(arguments.root, read_glossary(HERE / "glossary.txt"), tracked(arguments.root))
    print("\n".join(found) if found else "no name or phrase of the glossary's left column")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
