#!/usr/bin/env python3
"""Fails if a code block of a README differs from the tested file that it is a copy of.

usage: readme_snippets.py --root DIR            check a tree
       readme_snippets.py --root DIR --write    copy the files into the READMEs
       readme_snippets.py --self-test           check that the checker can fail
A line `<!-- copy of FILE -->`, with FILE relative to the README, belongs to the fenced code block on the next line.
"""

import argparse
import re
import sys
import tempfile
from pathlib import Path

SNIPPET = re.compile(r"^<!-- copy of (?P<file>\S+) -->\n(?P<fence>```\w*)\n(?P<text>.*?)^```$",
                     re.MULTILINE | re.DOTALL)
MARK = re.compile(r"^<!-- copy of ", re.MULTILINE)
FOLDERS = ("proto", "firmware", "host_sdk", "tests", "hil")


def readmes(root):
    yield from root.glob("*.md")
    for folder in FOLDERS:
        yield from (path for path in sorted((root / folder).rglob("*.md")) if "node_modules" not in path.parts)


def check(readme, write):
    """Errors, and the number of snippets."""
    text = readme.read_text(encoding="utf-8")
    errors = []

    def copy(match):
        source = readme.parent / match["file"]
        if not source.is_file():
            errors.append(f"{readme}: there is no {match['file']}")
            return match[0]
        content = source.read_text(encoding="utf-8")
        if content != match["text"] and not write:
            errors.append(f"{readme}: the block is not {match['file']}; readme_snippets.py --write copies it")
        return f"<!-- copy of {match['file']} -->\n{match['fence']}\n{content}```"

    copied, number = SNIPPET.subn(copy, text)
    if len(MARK.findall(text)) != number:
        errors.append(f"{readme}: a `copy of` without a fenced code block on the next line")
    if write and copied != text:
        readme.write_text(copied, encoding="utf-8")
    return errors, number


def check_tree(root, write):
    errors = []
    number = 0
    for readme in readmes(root):
        found, count = check(readme, write)
        errors += found
        number += count
    return errors, number


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        (root / "host_sdk").mkdir()
        (root / "host_sdk/a.js").write_text("one();\ntwo();\n")
        readme = root / "host_sdk/README.md"
        block = "# A\n<!-- copy of a.js -->\n```js\none();\ntwo();\n```\nand more\n"
        for text, errors in ((block, 0), (block.replace("two", "three"), 1), (block.replace("a.js", "b.js"), 1),
                             (block.replace("```js\n", ""), 1)):
            readme.write_text(text)
            found, _ = check_tree(root, False)
            assert len(found) == errors, (text, found)
        readme.write_text(block.replace("two", "three"))
        assert check_tree(root, True) == ([], 1)
        assert readme.read_text() == block


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args()
    if options.self_test:
        return self_test()
    errors, number = check_tree(options.root, options.write)
    print("\n".join(errors) or f"{number} snippets")
    return 1 if errors or number == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
