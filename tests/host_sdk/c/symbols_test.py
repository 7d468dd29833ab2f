#!/usr/bin/env python3
"""What liblightwell.so exports is what its headers declare: nothing is missing, and nothing of gRPC, protobuf or
the C++ inside is shown.

usage: symbols_test.py NM LIBRARY HEADER...
"""

import re
import subprocess
import sys


def main():
    nm, library, *headers = sys.argv[1:]
    listed = subprocess.run([nm, "-D", "--defined-only", library], check=True, capture_output=True, text=True).stdout
    symbols = [line.split() for line in listed.splitlines()]
    # A is the name of the version itself.
    exported = {name.split("@")[0] for *_, kind, name in symbols if kind != "A"}
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
