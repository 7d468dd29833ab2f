#!/usr/bin/env python3
"""Fails if C++ differs from the layout of .clang-format, or if a line of code is longer than 120 columns.

usage: code_layout.py --root DIR --clang-format PROGRAM    check a tree
       code_layout.py --self-test --clang-format PROGRAM   check that the checker can fail
To correct the layout: clang-format -i FILE (version 14). The width applies to every language, strings and comments
included.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

FOLDERS = ("proto", "firmware", "host_sdk", "tests", "hil")
CPP = (".cpp", ".hpp", ".h", ".c")
WIDE = CPP + (".py", ".ts", ".js", ".mjs", ".cs", ".proto")
COLUMNS = 120


def files(root):
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix in WIDE and path.is_file() and "node_modules" not in path.parts:
                yield path


def too_wide(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    return [f"{path}:{number}: {len(line)} columns, {COLUMNS} are allowed"
            for number, line in enumerate(lines, 1) if len(line) > COLUMNS]


def badly_laid_out(clang_format, paths):
    done = subprocess.run([clang_format, "--dry-run", "--ferror-limit=1", "-Werror", *paths],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode == 0:
        return []
    return [line for line in done.stdout.splitlines() if "error:" in line] or [done.stdout]


def findings(root, clang_format):
    everything = list(files(root))
    found = [line for path in everything for line in too_wide(path)]
    cpp = [path for path in everything if path.suffix in CPP]
    chunks = [cpp[k:k + 40] for k in range(0, len(cpp), 40)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for lines in pool.map(lambda chunk: badly_laid_out(clang_format, chunk), chunks):
            found += lines
    return found, len(everything)


def self_test(clang_format):
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        (root / ".clang-format").write_text((Path(__file__).resolve().parents[2] / ".clang-format").read_text())
        (root / "proto").mkdir()
        source = root / "proto/a.cpp"
        script = root / "proto/a.py"
        for text, python, expected in (
                ("int f(int a) { return a; }\n", "x = 1\n", 0),
                ("int f( int a ) { return a; }\n", "x = 1\n", 1),
                ("int f(int a) { return a; }\n", "# " + "x" * 119 + "\n", 1),
                # Columns are characters, not bytes.
                ("int f(int a) { return a; }\n", "# " + "°" * 118 + "\n", 0)):
            source.write_text(text)
            script.write_text(python)
            found, _ = findings(root, clang_format)
            if len(found) != expected:
                sys.exit(f"self-test: {expected} findings expected in {text!r}, {python!r}; got {found}")
    print("self-test: good")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path)
    parser.add_argument("--clang-format", required=True)
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    version = subprocess.run([arguments.clang_format, "--version"], stdout=subprocess.PIPE, text=True).stdout
    if " version 14." not in version:
        sys.exit(f"code_layout.py: clang-format 14 is required, found: {version.strip()}")
    if arguments.self_test:
        return self_test(arguments.clang_format)
    found, count = findings(arguments.root, arguments.clang_format)
    print("\n".join(found))
    print(f"{count} files, {len(found)} findings")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
