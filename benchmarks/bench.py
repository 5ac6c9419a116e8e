#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""The benchmarks that run on any machine, on one page.

  bench.py [options] [SECTION..]

  raster    the fastest pipeline of examples/raster, beside peers
  fusion    the pipelines of examples/raster against each other
  kernels   kernels of the examples: all lanes against one
  bodies    bodies of phases: all lanes against one, and C++ compilers
  runtime   what an edge between two stages costs
  maths     what a function costs, beside libm and, where it is installed, SLEEF
  roofline  bodies under the roofline of one core

Writes OUT/index.html, which needs no network, and for each section a CSV file
with all measurements and, where Debian's python3-matplotlib is installed, a
chart. A SCENE is a file and, in the same word, what options of piko-render it
needs. In the COMMAND of a peer, {scene}, {lights}, {threads}, {width} and
{height} stand for what is measured; it prints a line of JSON with `ms_median`.
With --against, ends with an error where something takes longer than in an
earlier run on the same machine.
"""

import argparse
import os
import sys

import bodies
from charts import find_pyplot
from figure4 import PIPES, print_table
from suite import bodies as bodies_section
from suite import (against, fusion, kernels, maths, page, raster, roofline,
                   runtime)
from commands import run_main

ROOT = bodies.ROOT
SECTIONS = {"raster": raster, "fusion": fusion, "kernels": kernels,
            "bodies": bodies_section,
            "runtime": runtime, "maths": maths, "roofline": roofline}
RASTERIZERS = [*PIPES, raster.VISIBILITY]
BUNNY = "/usr/share/glmark2/models/bunny.obj"
# What options are where the user does not say, and with --quick.
DEFAULTS = {
    "lights": ([1, 100, 1000], [1, 100]),
    "pipes": (RASTERIZERS, ["Fused", "Tiled", raster.VISIBILITY]),
    "examples": (list(kernels.PIPELINES), ["visibility"]),
    "rounds": (5, 2),
    "frames": (21, 5),
    "seconds": (0.5, 0.1),
    "bodies": (None, ["convolution", "mandelbrot", "matmul", "nbody"]),
    "references": (list(bodies.REFERENCES), ["g++ -O2"]),
    "records": (1500000, 200000),
    "functions": (list(maths.FUNCTIONS), ["exp", "log", "sin"]),
    "megabytes": (256, 64),
}


def add_options(parser):
    parser.add_argument("sections", nargs="*", metavar="SECTION",
                        help="(all)")
    parser.add_argument("--quick", action="store_true",
                        help="less of everything: under two minutes")
    parser.add_argument("--out", default=f"{ROOT}/build/bench", metavar="FOLDER",
                        help="(build/bench)")
    parser.add_argument("--against", metavar="FOLDER",
                        help="the OUT of an earlier run")
    parser.add_argument("--tolerance", type=float, default=0.15,
                        help="what may take longer, as a part of what it took "
                             "in that run (%(default)s)")
    parser.add_argument("--bin", default=f"{ROOT}/build/bin",
                        help="where the tools are")
    parser.add_argument("--lib", default=f"{ROOT}/build/lib",
                        help="where libpikort is")
    parser.add_argument("--work", metavar="FOLDER",
                        help="where to build (OUT/work)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(),
                        help="builds at a time")
    parser.add_argument("--cpu", default="native",
                        help="what kernels and bodies are compiled for "
                             "(%(default)s)")
    parser.add_argument("--rounds", type=int)
    parser.add_argument("--frames", type=int,
                        help="of the rasterizer in a round, at most")
    parser.add_argument("--seconds", type=float,
                        help="of frames in a round, for each contender")
    parser.add_argument("--scene", action="append", metavar="SCENE",
                        help="of raster; may be repeated; kernels takes the "
                             f"first ({BUNNY})")
    parser.add_argument("--lights", nargs="+", type=int)
    parser.add_argument("--threads", nargs="+", type=int, default=[1, 2],
                        help="of raster and runtime (1 2)")
    parser.add_argument("--pipes", nargs="+", choices=RASTERIZERS,
                        metavar="PIPE",
                        help="of raster, of which the fastest counts")
    parser.add_argument("--peer", action="append", default=[],
                        metavar="NAME=COMMAND",
                        help="of raster; may be repeated")
    parser.add_argument("--examples", nargs="+", metavar="NAME",
                        choices=kernels.PIPELINES, help="of kernels")
    parser.add_argument("--bodies", nargs="+", metavar="NAME",
                        choices=bodies.find_bodies(),
                        help="of bodies and roofline")
    parser.add_argument("--references", nargs="+", metavar="NAME",
                        choices=bodies.REFERENCES, help="of bodies")
    parser.add_argument("--records", type=int, help="of runtime")
    parser.add_argument("--functions", nargs="+", metavar="NAME",
                        choices=maths.FUNCTIONS, help="of maths")
    parser.add_argument("--megabytes", type=int,
                        help="of each array of the triad of roofline")


def check(parser, options):
    """What fits no other option, and what is not there."""
    for section in options.sections:
        if section not in SECTIONS:
            parser.error(f"expected sections of {', '.join(SECTIONS)}, but got "
                         f"'{section}'")
    for name in ("rounds", "frames", "records", "megabytes"):
        if getattr(options, name) < 1:
            parser.error(f"--{name}: expected at least 1, but got "
                         f"{getattr(options, name)}")
    if options.against is not None and not os.path.isdir(options.against):
        parser.error(f"--against: no folder '{options.against}'")
    if options.against is not None \
            and os.path.abspath(options.against) == options.out:
        parser.error("--against: expected another folder than --out")
    if not options.tolerance >= 0:
        parser.error("--tolerance: expected at least 0, but got "
                     f"{options.tolerance}")
    try:
        options.peer = [raster.parse_peer(text) for text in options.peer]
    except ValueError as error:
        parser.error(f"--peer: {error}")
    names = ["Piko", *(name for name, _ in options.peer)]
    if len(set(names)) < len(names):
        parser.error("--peer: expected a name for each, which is not Piko, but "
                     f"got {', '.join(names[1:])}")
    if "fusion" in options.sections and not fusion.find_pipes(options):
        parser.error("--pipes: fusion expected pipelines of examples/raster")
    if {"raster", "fusion", "kernels"} & set(options.sections) \
            and options.scene == [BUNNY] and not os.path.exists(BUNNY):
        parser.error(f"expected --scene, because there is no {BUNNY} (Debian: "
                     "glmark2-data)")


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False)
    add_options(parser)
    options = parser.parse_args()
    for name, values in DEFAULTS.items():
        if getattr(options, name) is None:
            setattr(options, name, values[options.quick])
    options.sections = options.sections or list(SECTIONS)
    options.scene = options.scene or [BUNNY]
    options.bodies = options.bodies or bodies.find_bodies()
    options.work = options.work or f"{options.out}/work"
    for name in ("out", "bin", "lib", "work"):
        setattr(options, name, os.path.abspath(getattr(options, name)))
    options.warmup, options.root = 2, ROOT
    options.runtime_frames = options.frames
    options.march, options.flags = None, []  # of the references
    check(parser, options)
    return options


def main():
    options = parse_arguments()
    os.makedirs(options.work, exist_ok=True)
    machine = page.describe_machine()  # and its load, before there is more
    if not find_pyplot():
        print("bench: no charts without matplotlib (Debian's "
              "python3-matplotlib)", file=sys.stderr)
    sections = page.measure_all(options.sections,
                                lambda name: SECTIONS[name].measure(options),
                                machine, options.out)
    if options.against is not None:
        slower = against.report(sections, options.against, options.tolerance,
                                print_table)
        if slower:
            sys.exit(f"bench: {slower} times are above {1 + options.tolerance:.2f} "
                     "of before")


if __name__ == "__main__":
    run_main(main)
