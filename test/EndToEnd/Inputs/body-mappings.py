#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What lanes are given of each body of a folder.

  body-mappings.py PIKOC FOLDER WORK

Compiles all *.piko.cpp for a processor with AVX-512, and prints a line for each
stage's phase and for each loop that is vectorized in one, without estimates.
"""

import glob
import os
import re
import subprocess
import sys

PHASE = re.compile(r"remark: stage '(\w+)': (process|assignBin) is (.*)")
LOOP = re.compile(r":(\d+):\d+: remark: (these iterations|iterations of this loop) "
                  r"(.*)")


def describe(line):
    if match := PHASE.search(line):
        stage, phase, what = match.groups()
        if what.startswith("vectorized"):
            what = "primitives"
        elif "are expected to take" in what:
            what = "refused by its cost"
        what = what.split(";")[0]
        return f"{stage}, {phase}: {what.removeprefix('not vectorized: ')}"
    if (match := LOOP.search(line)) and "are vectorized" in match[3]:
        compact = "of those" in match[3]
        return f"line {match[1]}: {'compacted ' * compact}iterations"
    return None


def main():
    pikoc, folder, work = sys.argv[1:]
    for source in sorted(glob.glob(f"{folder}/*.piko.cpp")):
        body = os.path.basename(source).removesuffix(".piko.cpp")
        remarks = subprocess.run(
            [pikoc, source, "--cpu", "x86-64-v4", "--remarks",
             "--emit", "target", "-o", f"{work}.mlir"],
            check=True, capture_output=True, text=True).stderr
        lines = filter(None, map(describe, remarks.splitlines()))
        for line in dict.fromkeys(lines):
            print(f"{body}: {line}")


if __name__ == "__main__":
    main()
