#!/usr/bin/env python3
"""Fails if an #include line makes a module depend on another one that arrows.txt does not allow.

usage: include_direction.py [--root DIR]    check a tree (default: this one)
       include_direction.py --self-test     check the checker
A module is a folder that has a line under [arrows] in arrows.txt, where the rules are.
"""

import argparse
import os
import re
import sys
import tempfile
from collections import namedtuple
from fnmatch import fnmatchcase
from pathlib import Path

HERE = Path(__file__).resolve().parent
SCANNED = ("proto", "firmware", "host_sdk", "tests", "hil")
SUFFIXES = (".hpp", ".h", ".cpp", ".c")
# The folders that #include lines may be relative to, besides the file's own.
INCLUDE_ROOTS = ("firmware", "host_sdk/include", "proto/include", "proto/firmware/include", "host_sdk/src", "proto/src",
                 "host_sdk/tools", "tests", "hil", "")

SECTIONS = ("arrows", "apart", "owners", "systems", "everywhere", "closed")

STANDARD = frozenset("""
algorithm any array atomic barrier bit bitset charconv chrono codecvt compare complex concepts
condition_variable coroutine deque exception execution filesystem format forward_list fstream
functional future initializer_list iomanip ios iosfwd iostream istream iterator latch limits list
locale map memory memory_resource mutex new numbers numeric optional ostream queue random ranges
ratio regex scoped_allocator semaphore set shared_mutex source_location span sstream stack stdexcept
stop_token streambuf string string_view strstream syncstream system_error thread tuple type_traits
typeindex typeinfo unordered_map unordered_set utility valarray variant vector version
cassert cctype cerrno cfenv cfloat cinttypes climits clocale cmath csetjmp csignal cstdarg cstddef
cstdint cstdio cstdlib cstring ctime cuchar cwchar cwctype
assert.h ctype.h errno.h fenv.h float.h inttypes.h limits.h locale.h math.h setjmp.h signal.h
stdarg.h stdbool.h stddef.h stdint.h stdio.h stdlib.h string.h time.h uchar.h wchar.h wctype.h
""".split())

Rule = namedtuple("Rule", "section left right why line")
Finding = namedtuple("Finding", "file line text arrow rule")


def read_rules(path):
    rules = []
    section = None
    for number, raw in enumerate(path.read_text().splitlines(), 1):
        text, _, why = (part.strip() for part in raw.partition("#"))
        if not text:
            continue
        if text.startswith("["):
            section = text.strip("[]")
            continue
        left, colon, right = text.partition(":")
        if section not in SECTIONS or not colon or not why:
            sys.exit(f"{path}:{number}: not 'left : right  # why' under a known [section]")
        rules.append(Rule(section, left.split(), right.split(), why, number))
    return rules


def matches(path, patterns):
    return any(fnmatchcase(path, pattern) for pattern in patterns)


# Matches raw strings and strings, too, so that comment marks inside them are not taken for comments.
NOT_CODE = re.compile(
    r'R"(?P<end>[^()\s\\]{0,16})\(.*?\)(?P=end)"|"(?:\\.|[^"\\\n])*"|//[^\n]*|/\*.*?\*/', re.DOTALL)
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*([<"])([^>"\n]+)[>"]', re.MULTILINE)


def includes(source):
    """Yields (line number, whether quoted, name) of each #include that is not in a comment."""
    def blank(match):
        text = match.group()
        is_string = text.startswith('"')
        return text if is_string else "\n" * text.count("\n")

    code = NOT_CODE.sub(blank, source)
    for match in INCLUDE.finditer(code):
        yield code.count("\n", 0, match.start()) + 1, match.group(1) == '"', match.group(2)


class Checker:
    def __init__(self, root, rules):
        self.root = Path(root)
        self.rules = {name: [r for r in rules if r.section == name] for name in SECTIONS}
        # The longest pattern first, and a plain name before one with a wildcard.
        self.rules["arrows"].sort(key=lambda rule: (-rule.left[0].count("/"), "*" in rule.left[0]))
        self.files = 0

    def module_of(self, path):
        """Returns the folder of a file's module and its rule in [arrows]; the rule is None for an unknown module."""
        parts = path.split("/")
        for rule in self.rules["arrows"]:
            folder = "/".join(parts[:rule.left[0].count("/") + 1])
            if folder != path and fnmatchcase(folder, rule.left[0]):
                return folder, rule
        return os.path.dirname(path), None

    def resolve(self, includer, quoted, name):
        """The path in the tree of an included file, or None if it is not of this project."""
        starts = [os.path.dirname(includer)] if quoted else []
        for start in (*starts, *INCLUDE_ROOTS):
            path = os.path.normpath(os.path.join(start, name))
            if path.split("/")[0] in SCANNED and (self.root / path).is_file():
                return path
        # A header that does not exist yet: its first folder determines the module.
        first = name.split("/")[0]
        if "/" in name and (self.root / "firmware" / first).is_dir():
            return f"firmware/{name}"
        return None

    def arrow_broken(self, module, line_of_module, target):
        """True if a file of `module` may not include one of the module `target`."""
        # With a slash, so that "tests/*" includes the module tests, too.
        return target != module and not (
            target in line_of_module.right or matches(target + "/", line_of_module.right))

    def foreign_broken(self, path, name):
        """Yields the [closed] rule that forbids the file to include this third-party header."""
        for rule in self.rules["closed"]:
            if matches(path, rule.left):
                if name not in STANDARD and not matches(name, rule.right):
                    yield rule
                break

    def owners_broken(self, path, name):
        """Yields the [owners], [systems] and [everywhere] rules that reserve this header for other files."""
        sections = ["everywhere"]
        if path.split("/")[0] not in ("tests", "hil"):
            sections += ["owners", "systems"]
        for section in sections:
            for rule in self.rules[section]:
                if matches(name, rule.left):
                    if not matches(path, rule.right):
                        yield rule
                    break

    def check_file(self, path):
        module, arrows = self.module_of(path)
        if arrows is None:
            yield Finding(path, 1, "anything", f"{module} -> ?",
                          Rule("arrows", [], [], "a module needs a line under [arrows]", 0))
            return
        seen = {rule.line: set() for rule in self.rules["apart"]}
        for line, quoted, name in includes((self.root / path).read_text(errors="replace")):
            target = self.resolve(path, quoted, name)
            target_module = self.module_of(target)[0] if target else name
            broken = list(self.owners_broken(path, name))
            if target is None:
                broken += self.foreign_broken(path, name)
            else:
                if self.arrow_broken(module, arrows, target_module):
                    broken.append(arrows)
                for rule in self.rules["apart"]:
                    sides = {side for side in rule.left if fnmatchcase(target, side)}
                    new = sides - seen[rule.line]
                    seen[rule.line] |= sides
                    if new and seen[rule.line] == set(rule.left) and not matches(path, rule.right):
                        broken.append(rule)
            for rule in broken:
                yield Finding(path, line, name, f"{module} -> {target_module}", rule)

    def check(self):
        findings = []
        for top in SCANNED:
            for path in sorted((self.root / top).rglob("*")):
                relative = path.relative_to(self.root).as_posix()
                # tests/install is a separate project: an application that uses the installed SDK.
                if (path.suffix in SUFFIXES and path.is_file()
                        and not relative.startswith("tests/install/")):
                    self.files += 1
                    findings.extend(self.check_file(relative))
        return findings


def report(findings):
    for finding in findings:
        where = f"arrows.txt:{finding.rule.line}" if finding.rule.line else "arrows.txt"
        print(f"{finding.file}:{finding.line}: #include of {finding.text}: {finding.arrow} "
              f"is not allowed: {finding.rule.why} ({where})")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", type=Path, default=HERE.parent.parent)
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    rules = read_rules(HERE / "arrows.txt")
    if arguments.self_test:
        from include_direction_cases import self_test
        with tempfile.TemporaryDirectory() as folder:
            return self_test(Path(folder), rules)

    checker = Checker(arguments.root, rules)
    findings = checker.check()
    report(findings)
    if checker.files == 0:
        print(f"no source file under {arguments.root}: is it the project's root?")
        return 1
    print(f"{checker.files} files, {len(findings)} forbidden includes")
    return 1 if findings else 0


if __name__ == "__main__":
    # Write no bytecode into the source tree.
    sys.dont_write_bytecode = True
    # include_direction_cases imports this Python module by its name: make that the running one.
    sys.modules["include_direction"] = sys.modules["__main__"]
    sys.exit(main())
