#!/usr/bin/env python3
"""How large the product is: lines of code and of comments, by language and folder, tests left out.

usage: line_counts.py [--json] [COMMIT ...]    default: HEAD

A line counts as code where it holds any, else as comment; empty lines count as neither. C++ is laid out by
.clang-format (test code_layout), so two commits since then compare without regard to formatting.
"""
import argparse
import json
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("proto", "firmware", "host_sdk", "hil", "cmake")
LANGUAGES = {".cpp": "C++", ".hpp": "C++", ".h": "C++", ".py": "Python", ".ts": "TypeScript", ".cs": "C#"}
STRINGS = re.compile(r'"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'')


def git(*arguments: str) -> bytes:
    return subprocess.run(["git", "-C", ROOT, *arguments], stdout=subprocess.PIPE, check=True).stdout


def count(text: str, language: str) -> Counter:
    """Lines of code and of comments."""
    counts: Counter = Counter()
    if language == "Python":
        bare = re.sub(r'^[ \t]*(?:"""|\'\'\').*?(?:"""|\'\'\')', lambda m: "\n".join("#" for _ in m[0].split("\n")),
                      text, flags=re.DOTALL | re.MULTILINE)
        comment = re.compile(r"^\s*#")
    else:
        bare = re.sub(r"/\*.*?\*/", lambda m: "\n".join("//" for _ in m[0].split("\n")), STRINGS.sub('""', text),
                      flags=re.DOTALL)
        comment = re.compile(r"^\s*//")
    for line in bare.splitlines():
        if line.strip():
            counts["comments" if comment.match(line) else "code"] += 1
    return counts


def measure(commit: str) -> dict[tuple[str, str], Counter]:
    """By language and folder: files, lines of code, lines of comments, all lines."""
    sizes: dict[tuple[str, str], Counter] = {}
    for name in git("ls-tree", "-r", "--name-only", commit, *FOLDERS).decode().splitlines():
        if language := LANGUAGES.get(Path(name).suffix):
            text = git("show", f"{commit}:{name}").decode()
            counts = count(text, language) + Counter(files=1, lines=text.count("\n"))
            key = (language, name.split("/")[0])
            sizes[key] = sizes.get(key, Counter()) + counts
    return sizes


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commits", nargs="*", default=["HEAD"], metavar="COMMIT")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows = []
    for commit in arguments.commits:
        try:
            sizes = measure(commit)
        except subprocess.CalledProcessError:
            print(f"line_counts.py: git knows no commit {commit}", file=sys.stderr)
            return 2
        total: Counter = sum(sizes.values(), Counter())
        rows += [{"commit": commit, "language": language, "folder": folder, **counts}
                 for (language, folder), counts in sorted(sizes.items())]
        rows.append({"commit": commit, "language": "all", "folder": "all", **total})
    if arguments.json:
        print(json.dumps(rows, indent=1))
        return 0
    print(f"{'commit':12} {'language':11} {'folder':9} {'files':>6} {'code':>7} {'comments':>9} {'lines':>7}")
    for row in rows:
        print(f"{row['commit'][:12]:12} {row['language']:11} {row['folder']:9} {row['files']:6} {row['code']:7} "
              f"{row['comments']:9} {row['lines']:7}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
