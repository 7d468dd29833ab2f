#!/usr/bin/env python3
"""Fails if a header of the product does not compile alone.

usage: header_self_containment.py --root DIR --build DIR    check the headers of a tree that is built in a folder
       header_self_containment.py --self-test --build DIR   check that the checker can fail

A header that is the first that some source includes is compiled alone with that source. Every other one is compiled
here, without code generation, with the flags that compile_commands.json has for a source of the same folder, or of
the nearest folder above. ccache keeps the results, if it is installed.
"""
import argparse
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

FOLDERS = ("proto", "firmware", "host_sdk", "hil")
# Not included by a program as they are: Highway includes them once for each vector unit, the C header is C.
SUFFIX_NOT_ALONE = "_inl.hpp"
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)


def compile_flags(root, build):
    """Compiler and flags of one source for each folder."""
    flags = {}
    for command in json.loads((build / "compile_commands.json").read_text()):
        source = Path(command["file"])
        if source.is_relative_to(root) and not source.is_relative_to(build):
            words = shlex.split(command["command"])
            words = words[:words.index("-o")]
            flags.setdefault(source.parent, words)
            # A header may include what only some sources of its folder may: the longest line has the most folders.
            flags[source.parent] = max(flags[source.parent], words, key=len)
    return flags


def not_compiled_first(root):
    sources = [path for folder in (*FOLDERS, "tests") for path in (root / folder).rglob("*.c*")
               if path.suffix in (".c", ".cpp")]
    first = {found[1] for path in sources if (found := INCLUDE.search(path.read_text()))}
    for folder in FOLDERS:
        for header in sorted((*(root / folder).rglob("*.hpp"), *(root / folder).rglob("*.h"))):
            parts = header.relative_to(root).parts
            names = {"/".join(parts[start:]) for start in range(len(parts))}
            if not names & first and not header.name.endswith(SUFFIX_NOT_ALONE) and "node_modules" not in parts:
                yield header


def nearest_flags(header, root, flags):
    """The flags of the folder of a header; of a public header's top folder any: its own folder has no sources."""
    for folder in header.parents:
        below = [words for of, words in flags.items() if of.is_relative_to(folder) and "tests" not in of.parts]
        if folder in flags or below:
            return flags.get(folder) or max(below, key=len)
        if folder == root:
            break
    raise SystemExit(f"{header}: compile_commands.json has no source below any folder of it")


def check(header, command, folder, launcher):
    """The error that a compiler gives for the header, or "". ccache needs the same path of the source each time."""
    source = folder / ("_".join(header.parts[1:]) + ".cpp")
    source.write_text(f'#include "{header}"\n')
    done = subprocess.run([*launcher, *command, "-O0", "-g0", "-o", f"{source}.o", "-c", str(source)],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=folder)
    return "" if done.returncode == 0 else f"{header} does not compile alone:\n{done.stdout}"


def check_tree(root, build, launcher):
    flags = compile_flags(root, build)
    headers = list(not_compiled_first(root))
    folder = build / "header_self_containment"
    folder.mkdir(exist_ok=True)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        failures = [text for text in pool.map(
            lambda header: check(header, nearest_flags(header, root, flags), folder, launcher), headers) if text]
    print(*failures, f"{len(headers)} headers compiled alone, {len(failures)} of them failed", sep="\n")
    return 1 if failures else 0


def self_test(build):
    with tempfile.TemporaryDirectory() as folder:
        header = Path(folder) / "incomplete.hpp"
        command = next(iter(compile_flags(build.parents[1], build).values()))
        header.write_text("inline std::string name() { return {}; }\n")
        assert check(header, command, Path(folder), []), "a header that lacks an include must be reported"
        header.write_text("#include <string>\ninline std::string name() { return {}; }\n")
        assert not check(header, command, Path(folder), []), "a self-contained header must pass"
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path)
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        return self_test(arguments.build)
    ccache = shutil.which("ccache")
    launcher = ["env", f"CCACHE_BASEDIR={arguments.root}", "CCACHE_NOHASHDIR=1", ccache] if ccache else []
    return check_tree(arguments.root, arguments.build, launcher)


if __name__ == "__main__":
    sys.exit(main())
