#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""The comparisons that need a GPU, on one page.

  gpu-bench.py [options] [SECTION..]

  frames     whole frames of the rasterizers, beside peers such as cudaraster
  figure4    figures 4a to 4c of the Piko paper: mappings against each other
  figure5    figure 5: the part of a frame that each kernel takes
  reruns     a hundred runs give one image
  published  what the paper says of a Tesla K40c

On a machine with a card that NVIDIA's driver knows, times are measured. With
--estimate CHIP, or where there is no card, frames run behind the driver for tests,
which counts, and times are estimates against that chip's published limits, and say
so: benchmarks/gpu_model/model.py. That is slow, and by default small.

Writes OUT/index.html, which needs no network, and for each section a CSV file and,
where Debian's python3-matplotlib is installed, a chart. A SCENE is a file and, in the
same word, what options of piko-render it needs. In the COMMAND of a peer, {scene},
{lights}, {width}, {height} and {threads} (1) stand for what is measured; it prints a
line of JSON with `ms_median`. docs/GPU.md says what such a program for cudaraster has
to do: the project has none.
"""

import argparse
import os
import sys

from figure4 import PIPES, ROOT
from gpu_model.chips import read_chips
from gpu_suite import figure4, figure5, frames, published, reruns, timing
from suite import page, raster
from commands import run_main

SECTIONS = {"frames": frames, "figure4": figure4, "figure5": figure5,
            "reruns": reruns, "published": published}
BUNNY = "/usr/share/glmark2/models/bunny.obj"
RASTERIZERS = ["Visibility", *PIPES]
# What options are where the user does not say: on a card, in estimates, and in
# either with --quick.
DEFAULTS = {
    "width": (1024, 320, 64), "height": (768, 240, 48),
    "lights": ([1, 10, 100, 1000], [1, 10], [1]),
    "pipes": (["Visibility", "Fused", "Tiled"], ["Visibility", "Fused"],
              ["Visibility", "Fused"]),
    "rounds": (5, 1, 1), "reruns": (100, 5, 2),
    "frames": (101, 1, 1), "seconds": (2.0, 0.0, 0.0), "warmup": (10, 0, 0),
}


def add_options(parser):
    chips, _ = read_chips()
    parser.add_argument("sections", nargs="*", metavar="SECTION", help="(all)")
    parser.add_argument("--estimate", metavar="CHIP", choices=list(chips),
                        help=f"one of {', '.join(chips)} (H100, without a card)")
    parser.add_argument("--measure", action="store_true",
                        help="what the driver runs, though no card is found")
    parser.add_argument("--quick", action="store_true", help="as little as can be")
    parser.add_argument("--out", default=f"{ROOT}/build/gpu-bench", metavar="FOLDER",
                        help="(build/gpu-bench)")
    parser.add_argument("--bin", default=f"{ROOT}/build/bin",
                        help="where the tools are")
    parser.add_argument("--driver", default=f"{ROOT}/build/lib/libpiko-test-driver.so",
                        help="the driver for tests")
    parser.add_argument("--scene", action="append", metavar="SCENE",
                        help=f"may be repeated ({BUNNY})")
    parser.add_argument("--lights", nargs="+", type=int)
    parser.add_argument("--pipes", nargs="+", choices=RASTERIZERS, metavar="PIPE",
                        help="of frames and reruns")
    parser.add_argument("--width", type=int)
    parser.add_argument("--height", type=int)
    parser.add_argument("--rounds", type=int)
    parser.add_argument("--warmup", type=int, help="frames before a round")
    parser.add_argument("--frames", type=int, help="of a round, at most")
    parser.add_argument("--seconds", type=float, help="of frames in a round")
    parser.add_argument("--reruns", type=int)
    parser.add_argument("--peer", action="append", default=[], metavar="NAME=COMMAND",
                        help="of frames; may be repeated")


def check(parser, options):
    for section in options.sections:
        if section not in SECTIONS:
            parser.error(f"expected sections of {', '.join(SECTIONS)}, but got "
                         f"'{section}'")
    if options.estimate and options.measure:
        parser.error("expected --estimate or --measure, and not both")
    for name in ("width", "height", "rounds", "frames", "reruns"):
        if getattr(options, name) < 1:
            parser.error(f"--{name}: expected at least 1, but got "
                         f"{getattr(options, name)}")
    try:
        options.peer = [raster.parse_peer(text) for text in options.peer]
    except ValueError as error:
        parser.error(f"--peer: {error}")
    if options.scene == [BUNNY] and not os.path.exists(BUNNY):
        parser.error(f"expected --scene, because there is no {BUNNY} (Debian: "
                     "glmark2-data)")


def parse_options():
    parser = argparse.ArgumentParser(
        description=__doc__, allow_abbrev=False,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser)
    options = parser.parse_args()
    if not (options.estimate or options.measure or timing.find_card()):
        options.estimate = "H100"
        print("gpu-bench: no card was found; times are estimates", file=sys.stderr)
    which = 2 if options.quick else 1 if options.estimate else 0
    for name, values in DEFAULTS.items():
        if getattr(options, name) is None:
            setattr(options, name, values[which])
    options.sections = options.sections or list(SECTIONS)
    options.scene = options.scene or [BUNNY]
    for name in ("out", "bin", "driver"):
        setattr(options, name, os.path.abspath(getattr(options, name)))
    check(parser, options)
    return options


def describe_times(timer):
    return [f"Times of ours are {timer.described}.",
            *(["An estimate is no measurement: it says what a chip's limits allow for "
               "what was counted."] if timer.estimated else [])]


def main():
    options = parse_options()
    os.makedirs(options.out, exist_ok=True)
    timer = timing.Estimate(options, read_chips()[0][options.estimate]) \
        if options.estimate else timing.Card(options)
    notes = describe_times(timer) + page.describe_machine()
    try:
        page.measure_all(options.sections,
                         lambda name: SECTIONS[name].measure(options, timer), notes,
                         options.out)
    except ValueError as error:
        sys.exit(f"gpu-bench: {error}")


if __name__ == "__main__":
    run_main(main)
