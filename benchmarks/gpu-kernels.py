#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Says what the kernels of all examples take of a GPU.

For each pipeline of each example, what `pikoc --explain --target cuda` says of its
kernels: threads and memory of a block, and, where ptxas is found, registers, stack
and spills of a thread, and occupancy. Writes Markdown. The exit status is 1 if a
kernel that --hot names spills registers.
"""

import argparse
import fnmatch
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# What most of a frame's time goes to, as EXAMPLE/PIPELINE/KERNEL.
HOT = ["raster/Fused/kernel_rasterizer", "raster/Tiled/kernel_rasterizer",
       "visibility/*/kernel_coverage"]
COLUMNS = ["threads", "block memory", "registers", "stack", "spilled", "occupancy"]


def parse_options():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", metavar="FILE",
                        help="pipelines (all examples)")
    parser.add_argument("--bin", default=ROOT / "build/bin", type=pathlib.Path,
                        help="where pikoc is")
    parser.add_argument("--chip", default="sm_90", help="as ptxas names it (sm_90)")
    parser.add_argument("--hot", default=",".join(HOT), metavar="PATTERN,...",
                        help="kernels that must not spill, as "
                             "EXAMPLE/PIPELINE/KERNEL (" + ", ".join(HOT) + ")")
    return parser.parse_args()


def call(*command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr.strip()}")
    return done.stdout


def read_report(text):
    """Yields the kernel and the columns of each line of the table."""
    table = text.partition("\nOn ")[2].splitlines()
    for line in table[2:]:
        *numbers, kernel = line.replace(" %", "%").split()
        yield kernel, dict(zip(COLUMNS, numbers))


def main():
    options = parse_options()
    files = options.files or sorted(ROOT.glob("examples/*/*.piko.cpp"))
    hot = options.hot.split(",") if options.hot else []
    failed = []
    print(f"| {options.chip} | " + " | ".join(COLUMNS) + " |")
    print("|---" * (len(COLUMNS) + 1) + "|")
    for file in map(pathlib.Path, files):
        for pipe in call(options.bin / "pikoc", file, "--list-pipes").split():
            report = call(options.bin / "pikoc", file, "--pipe", pipe, "--explain",
                          "--target", "cuda", "--gpu-chip", options.chip)
            for kernel, numbers in read_report(report):
                name = f"{file.name.split('.')[0]}/{pipe}/{kernel}"
                print(f"| {name} | " +
                      " | ".join(numbers.get(c, "") for c in COLUMNS) + " |")
                spills = int(numbers.get("spilled", 0))
                if spills and any(fnmatch.fnmatch(name, each) for each in hot):
                    failed.append(f"{name} spills {spills} bytes")
    for text in failed:
        print(text, file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
