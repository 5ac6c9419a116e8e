#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Compares what a shared library exports with a list in the tree and with what
headers declare: a change of an interface is seen, and nothing else is shown.

The list has a name a line; --write writes it anew. Weak symbols, which are inline
functions of C++, do not count. Exit status 1 where something differs.
"""

import argparse
import pathlib
import re
import subprocess
import sys

from tool import run_main


def exported(nm, library):
    command = [nm, "-D", "--defined-only", "--format=posix", library]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    found = set()
    for line in lines.splitlines():
        name, kind = line.split()[:2]
        if kind not in "wWvVA":  # A: the name of a version
            found.add(name.split("@")[0])
    return found


def declared(mark, headers):
    function = re.compile(rf"\b{mark}\b[^;(]*?\b(\w+)\s*\(")
    found = set()
    for header in headers:
        text = re.sub(r"//[^\n]*|^#.*", "", header.read_text(), flags=re.M)
        found |= set(function.findall(text))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("library")
    parser.add_argument("--list", required=True, type=pathlib.Path)
    parser.add_argument("--mark", required=True, help="the macro before declarations")
    parser.add_argument("--nm", default="llvm-nm")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("headers", nargs="+", type=pathlib.Path)
    args = parser.parse_args()
    symbols = exported(args.nm, args.library)
    if args.write:
        args.list.write_text("".join(f"{name}\n" for name in sorted(symbols)))
        return 0
    listed = set(args.list.read_text().split())
    promised = declared(args.mark, args.headers)
    faults = [
        f"{name}: {what}"
        for names, what in (
            (symbols - listed, f"exported, but not in {args.list.name}"),
            (listed - symbols, f"in {args.list.name}, but not exported"),
            (symbols - promised, "exported, but not declared"),
            (promised - symbols, "declared, but not exported"),
        )
        for name in sorted(names)
    ]
    print("\n".join(faults) or f"{len(symbols)} symbols")
    return 1 if faults else 0


if __name__ == "__main__":
    run_main(main)
