#!/usr/bin/env python3
"""Fails if a header of the product does not compile alone.

usage: header_self_containment.py --root DIR --build DIR [LAUNCHER...]    check the headers of a built tree
       header_self_containment.py --self-test --root DIR --build DIR      check that the checker can fail

LAUNCHER: a command before the compiler's, as in CMAKE_CXX_COMPILER_LAUNCHER.
A header that is the first that some compiled source includes is compiled alone with that source. Every other one is
compiled here, without optimisation, with the flags that compile_commands.json has for a source of the same folder, or
of the nearest folder above.
"""
import argparse
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

FOLDERS = ("proto", "firmware", "host_sdk", "hil")
# Highway includes these once for each vector unit, so none stands alone.
SUFFIX_NOT_ALONE = "_inl.hpp"
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)


def compile_commands(root, build):
    """Each compiled source of the tree, with its compiler and flags."""
    for entry in json.loads((build / "compile_commands.json").read_text()):
        source = Path(entry["file"])
        if source.is_relative_to(root) and not source.is_relative_to(build):
            words = shlex.split(entry["command"])
            yield source, words[:words.index("-o")]


def longest_flags(commands):
    """For each folder the longest command: a header may include what only some sources of its folder may."""
    flags = {}
    for source, words in commands:
        flags[source.parent] = max(flags.get(source.parent, []), words, key=len)
    return flags


def include_folders(words):
    """The folders that -I and -isystem name, in their order."""
    return [Path(word[2:] or after) for word, after in zip(words, [*words[1:], ""])
            if word.startswith("-I")] + [Path(after) for word, after in zip(words, words[1:]) if word == "-isystem"]


def first_included(source, words):
    """The header that the first #include line of a source means, or None."""
    found = INCLUDE.search(source.read_text())
    candidates = [folder / found[1] for folder in (source.parent, *include_folders(words))] if found else []
    return next((path.resolve() for path in candidates if path.is_file()), None)


def not_compiled_first(root, commands):
    first = {first_included(source, words) for source, words in commands}
    for folder in FOLDERS:
        for header in sorted((*(root / folder).rglob("*.hpp"), *(root / folder).rglob("*.h"))):
            alone = not header.name.endswith(SUFFIX_NOT_ALONE) and "node_modules" not in header.parts
            if alone and header not in first:
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
    """The error that a compiler gives for the header, or "". The source has the same path each time, for ccache."""
    source = folder / ("_".join(header.parts[1:]) + ".cpp")
    source.write_text(f'#include "{header}"\n')
    done = subprocess.run([*launcher, *command, "-O0", "-g0", "-o", f"{source}.o", "-c", str(source)],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=folder)
    return "" if done.returncode == 0 else f"{header} does not compile alone:\n{done.stdout}"


def check_tree(root, build, launcher):
    commands = list(compile_commands(root, build))
    flags = longest_flags(commands)
    headers = list(not_compiled_first(root, commands))
    folder = build / "header_self_containment"
    folder.mkdir(exist_ok=True)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        failures = [text for text in pool.map(
            lambda header: check(header, nearest_flags(header, root, flags), folder, launcher), headers) if text]
    print(*failures, f"{len(headers)} headers compiled alone, {len(failures)} of them failed", sep="\n")
    return 1 if failures else 0


def self_test(root, build):
    commands = list(compile_commands(root, build))
    source, words = next(iter(commands))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        header = folder / "incomplete.hpp"
        header.write_text("inline std::string name() { return {}; }\n")
        assert check(header, words, folder, []), "a header that lacks an include must be reported"
        header.write_text("#include <string>\ninline std::string name() { return {}; }\n")
        assert not check(header, words, folder, []), "a self-contained header must pass"
        user = folder / "user.cpp"
        user.write_text('#include "incomplete.hpp"\n#include "other.hpp"\n')
        assert first_included(user, [*words, "-I", name]) == header.resolve(), "the first include counts"
        assert first_included(source, []) != header.resolve(), "a header of the same name elsewhere does not count"
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path, required=True)
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("--self-test", action="store_true")
    parser.add_argument("launcher", nargs="*")
    arguments = parser.parse_args()
    if arguments.self_test:
        return self_test(arguments.root, arguments.build)
    return check_tree(arguments.root, arguments.build, arguments.launcher)


if __name__ == "__main__":
    sys.exit(main())
