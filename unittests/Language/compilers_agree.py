#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Builds one pipeline file with several compilers and compares what it prints.

The first compiler is called with -std=c++20 and the include path alone, each
other one with -O2 as well, and with --all each in both ways. A build that contracts floating-point operations must refuse to
run, or run with the same result.
"""
import argparse
import pathlib
import subprocess
import sys


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--include", required=True)
    parser.add_argument("--work", required=True, type=pathlib.Path)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("source")
    parser.add_argument("compilers", nargs="+")
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)

    first = None
    for number, compiler in enumerate(args.compilers):
        ways = [[], ["-O2"]]
        for flags in ways if args.all else ways[number > 0:][:1]:
            program = args.work / f"program{number}{''.join(flags)}"
            command = [compiler, "-std=c++20", f"-I{args.include}", *flags,
                       args.source, "-o", str(program)]
            subprocess.run(command, check=True)
            output = subprocess.run([program], check=True, text=True,
                                    capture_output=True).stdout
            if first is None:
                first = output
            elif output != first:
                sys.exit(f"expected\n{first}but {' '.join(command)} got\n{output}")
    print(first, end="")

    refused = subprocess.run(
        [args.compilers[0], "-std=c++20", f"-I{args.include}", "-ffast-math",
         "-fsyntax-only", args.source], text=True, capture_output=True)
    if refused.returncode == 0 or "-ffast-math" not in refused.stderr:
        sys.exit("expected -ffast-math to be refused")


if __name__ == "__main__":
    main()
