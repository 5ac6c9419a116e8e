#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Says what the kernels of all examples take of GPUs.

For each pipeline of each example, what `pikoc --explain --target cuda` says of its
kernels: threads and memory of a block, and, where ptxas is found, registers, stack
and spills of a thread, and occupancy. Writes Markdown: one chip in columns of their
own, several in one column each, with registers, in brackets bytes that are spilled,
and occupancy ('-' where the chip's limits are not known). The exit status is 1 if a
kernel that --hot names spills registers.
"""

import argparse
import fnmatch
import os
import pathlib
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

from commands import call, run_main
from gpu_model.counting import COLUMNS, read_explained
from gpu_model.slots import find_assembler

ROOT = pathlib.Path(__file__).resolve().parent.parent
# What most of a frame's time goes to, as EXAMPLE/PIPELINE/KERNEL.
HOT = ["raster/Fused/kernel_rasterizer", "raster/Tiled/kernel_rasterizer",
       "visibility/*/kernel_coverage", "visibility/*/kernel_shade"]
OF_BLOCK = ["threads", "block memory", "stack"]


def parse_options():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", metavar="FILE",
                        help="pipelines (all examples)")
    parser.add_argument("--bin", default=ROOT / "build/bin", type=pathlib.Path,
                        help="where pikoc is")
    parser.add_argument("--chip", action="append", metavar="NAME",
                        help="as ptxas names it; may be repeated; 'all' are those "
                             "that the ptxas that is found knows (sm_90)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--hot", default=",".join(HOT), metavar="PATTERN,...",
                        help="kernels that must not spill, as "
                             "EXAMPLE/PIPELINE/KERNEL (" + ", ".join(HOT) + ")")
    return parser.parse_args()


def list_chips():
    """Without those that are for one chip or one family alone."""
    assembler = find_assembler()
    if not assembler:
        sys.exit("--chip all: no ptxas was found")
    text = subprocess.run([assembler, "--help"], capture_output=True,
                          text=True).stdout
    numbers = {int(number) for number in re.findall(r"'sm_(\d+)'", text)}
    return [f"sm_{number}" for number in sorted(numbers)]


def explain(options, file, pipe, chip):
    """By kernel."""
    return dict(read_explained(call(
        [str(options.bin / "pikoc"), str(file), "--pipe", pipe, "--explain",
         "--target", "cuda", "--gpu-chip", chip])))


def list_kernels(options, chips):
    """Yields the name of each kernel of all files, and its columns by chip."""
    files = map(pathlib.Path, options.files or
                sorted(ROOT.glob("examples/*/*.piko.cpp")))
    cases = [(file, pipe) for file in files for pipe in
             call([str(options.bin / "pikoc"), str(file), "--list-pipes"]).split()]
    with ThreadPoolExecutor(max(options.jobs, 1)) as pool:
        reports = [{chip: pool.submit(explain, options, file, pipe, chip)
                    for chip in chips} for file, pipe in cases]
        for (file, pipe), by_chip in zip(cases, reports):
            found = {chip: report.result() for chip, report in by_chip.items()}
            for kernel in found[chips[0]]:
                yield (f"{file.name.split('.')[0]}/{pipe}/{kernel}",
                       {chip: found[chip].get(kernel, {}) for chip in chips})


def write_cell(numbers):
    """What differs from chip to chip."""
    if "registers" not in numbers:
        return ""
    spilled = f" ({numbers['spilled']})" if int(numbers["spilled"]) else ""
    return f"{numbers['registers']}{spilled} {numbers['occupancy']}"


def write_head(chips):
    head = [chips[0], *COLUMNS] if len(chips) == 1 else ["kernel", *OF_BLOCK, *chips]
    print(f"| {' | '.join(head)} |")
    print("|---" * len(head) + "|")


def write_row(name, by_chip):
    first = next(iter(by_chip.values()))
    columns = COLUMNS if len(by_chip) == 1 else OF_BLOCK
    cells = [name, *(first.get(column, "") for column in columns)]
    if len(by_chip) > 1:
        cells += map(write_cell, by_chip.values())
    print(f"| {' | '.join(cells)} |")


def main():
    options = parse_options()
    chips = list_chips() if options.chip == ["all"] else options.chip or ["sm_90"]
    hot = options.hot.split(",") if options.hot else []
    failed = []
    write_head(chips)
    for name, by_chip in list_kernels(options, chips):
        write_row(name, by_chip)
        for chip, numbers in by_chip.items():
            spills = int(numbers.get("spilled", 0))
            if spills and any(fnmatch.fnmatch(name, each) for each in hot):
                of_chip = f" on {chip}" if len(chips) > 1 else ""
                failed.append(f"{name} spills {spills} bytes{of_chip}")
    for text in failed:
        print(text, file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    run_main(main)
