#!/usr/bin/env python3
"""What liblightwell.so (lightwell.dll) exports is what its headers declare: nothing is missing, and nothing of gRPC,
protobuf or the C++ inside is shown.

usage: symbols_test.py NM liblightwell.so HEADER...
       symbols_test.py OBJDUMP lightwell.dll HEADER...
"""

import re
import subprocess
import sys


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def exported_symbols(tool, library):
    if library.endswith(".dll"):
        # Lines of a number in brackets and a name.
        table = output(tool, "-p", library).partition("[Ordinal/Name Pointer] Table")[2].partition("\n\n")[0]
        return set(re.findall(r"^\s*\[ *\d+\](?: \+base\[ *\d+\])?(?: +[0-9a-f]+)? +(\S+)$", table, re.MULTILINE))
    symbols = [line.split() for line in output(tool, "-D", "--defined-only", library).splitlines()]
    # A is the name of the version itself.
    return {name.split("@")[0] for *_, kind, name in symbols if kind != "A"}


def main():
    tool, library, *headers = sys.argv[1:]
    exported = exported_symbols(tool, library)
    declared = set()
    for header in headers:
        with open(header, encoding="utf-8") as file:
            declared |= set(re.findall(r"^LW_API [^(]*?\b(lw_\w+)\(", file.read(), re.MULTILINE))
    for name in sorted(declared - exported):
        print(f"declared and not exported: {name}")
    for name in sorted(exported - declared):
        print(f"exported and not declared: {name}")
    print(f"{len(exported)} symbols are exported, {len(declared)} are declared")
    return 0 if exported == declared and len(declared) > 20 else 1


if __name__ == "__main__":
    sys.exit(main())
