#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Estimates what a frame takes on GPUs that are not there.

  gpu-estimate.py [options] PIPELINE SCENE   counts a frame first
  gpu-estimate.py [options] --counts FILE    of what was counted

PIPELINE is a file or the name of an example; SCENE a file and, in the same word,
what options of piko-render it needs. The frame runs behind the driver for tests,
which interprets PTX, once for each number of multiprocessors: seconds to minutes each.

For each kernel and chip: the least milliseconds that the chip's published limits
(gpu_model/chips.json) allow for what was counted, what limits it, and how many they
may be: work, and after it the span. gpu_model/model.py says what is in it. What the
host does is not. Nothing here is measured.
"""

import argparse
import json
import sys

from commands import call, run_main
from figure4 import ROOT, print_table
from gpu_model import counting
from gpu_model.chips import read_chips
from gpu_model.model import estimate_frame
from outputs import write_csv

COLUMNS = ["chip", "kernel", "launches", "blocks", "warp_instructions", "lanes",
           "least_ms", "least_limit", "most_ms", "most_limit"]


def parse_options():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pipeline", nargs="?", metavar="PIPELINE")
    parser.add_argument("scene", nargs="?", metavar="SCENE")
    parser.add_argument("--pipe", help="in the file; the last if nothing is said")
    parser.add_argument("--chip", action="append", metavar="NAME",
                        help="may be repeated (all)")
    parser.add_argument("--list-chips", action="store_true",
                        help="the limits of chips, and their sources")
    parser.add_argument("--width", type=int, default=1024)
    parser.add_argument("--height", type=int, default=768)
    parser.add_argument("--lights", type=int, default=1)
    parser.add_argument("--counts", metavar="FILE",
                        help="what PIKO_TEST_DRIVER_COUNTS=FILE has written, with "
                             "the chip's PIKO_TEST_DRIVER_LATENCIES")
    parser.add_argument("--csv", metavar="FILE", help="all estimates, too")
    parser.add_argument("--bin", default=f"{ROOT}/build/bin",
                        help="where piko-render and pikoc are")
    parser.add_argument("--driver", default=f"{ROOT}/build/lib/libpiko-test-driver.so",
                        help="the driver for tests")
    options = parser.parse_args()
    if not options.list_chips and bool(options.counts) == bool(options.scene):
        parser.error("expected a pipeline and a scene, or --counts")
    if options.counts and len(options.chip or []) != 1:
        parser.error("--counts: expected the --chip whose latencies were counted")
    return parser, options


def choose_chips(parser, names):
    chips, sources = read_chips()
    for name in names or []:
        if name not in chips:
            parser.error(f"--chip: expected one of {', '.join(chips)}, but got "
                         f"'{name}'")
    return [chips[name] for name in names or chips], sources


def list_chips(chips, sources):
    print_table(["chip", "multiprocessors", "GHz", "warp instructions a cycle",
                 "fp32", "fp64", "int", "L2 bytes a cycle", "DRAM GB/s", "sources"],
                [[c.name, str(c.multiprocessors), str(c.gigahertz), str(c.issue),
                  str(c.lanes["float32"]), str(c.lanes["float64"]),
                  str(c.lanes["integer"]), str(c.l2_bytes_per_clock or "not known"),
                  str(c.dram_gb_per_s), ", ".join(c.sources)] for c in chips])
    print()
    for name, text in sources.items():
        print(f"{name}: {text}")


def count(options, chips):
    """By chip: what was counted on one like it."""
    if options.counts:
        with open(options.counts) as file:
            report = json.load(file)
        if not all(counts.get("mostSpan") for counts in report["kernels"].values()
                   if counts["warpInstructions"]):
            sys.exit(f"{options.counts}: expected spans, which are counted with "
                     f"PIKO_TEST_DRIVER_LATENCIES={chips[0].latencies}")
        return {chip.name: report for chip in chips}
    file = counting.find_pipeline(ROOT, options.pipeline)
    pipe = options.pipe or call(
        [f"{options.bin}/pikoc", str(file), "--list-pipes"]).split()[-1]
    alike, counted = {}, {}
    for chip in chips:
        kind = chip.multiprocessors, chip.latencies
        if kind not in alike:
            _, alike[kind] = counting.count_frame(
                options, file, pipe, options.scene, chip, options.lights)
        counted[chip.name] = alike[kind]
    return counted


def describe(kernel, counts):
    lanes = counts["laneInstructions"] / max(32 * counts["warpInstructions"], 1)
    return {"kernel": kernel, "launches": counts["launches"],
            "blocks": counts["blocks"], "warp_instructions": counts["warpInstructions"], "lanes": lanes}


def list_estimates(chip, report):
    """A row for each kernel, and one for the frame."""
    frame = estimate_frame(report, chip)
    rows = [{"chip": chip.name, **describe(name, report["kernels"][name]),
             "least_ms": it.least_ms, "least_limit": it.limit,
             "most_ms": it.most_ms, "most_limit": it.most_limit}
            for name, it in frame.kernels.items()]
    rows.append({"chip": chip.name, "kernel": "frame",
                 "launches": sum(row["launches"] for row in rows), "blocks": "",
                 "warp_instructions": sum(r["warp_instructions"] for r in rows),
                 "lanes": "", "least_ms": frame.least_ms, "least_limit": "",
                 "most_ms": frame.most_ms,
                 "most_limit": f"{frame.waits} waits of the host"})
    return rows


def format_row(row):
    lanes = row["lanes"]
    return [row["kernel"], str(row["launches"]), str(row["blocks"]),
            f"{row['warp_instructions'] / 1e6:.2f}",
            lanes if lanes == "" else f"{lanes:.0%}",
            f"{row['least_ms']:.3f}", row["least_limit"], f"{row['most_ms']:.3f}",
            row["most_limit"]]


def main():
    parser, options = parse_options()
    chips, sources = choose_chips(parser, options.chip)
    if options.list_chips:
        return list_chips(chips, sources)
    rows = []
    for name, report in count(options, chips).items():
        chip = next(c for c in chips if c.name == name)
        own = list_estimates(chip, report)
        print(f"\n{name}, estimated from what was counted, and not measured:")
        print_table(["kernel", "launches", "blocks", "M warp instructions", "lanes",
                     "estimated ms, at least", "limit", "at most", "limit"],
                    [format_row(row) for row in own])
        rows += own
    if options.csv:
        write_csv(options.csv, rows, COLUMNS)
    return 0


if __name__ == "__main__":
    run_main(main)
