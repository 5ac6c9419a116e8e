#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Renders a scene with the reference executor and, over and over, compiled.

  compare-targets.py [--render PATH] [--file PIPELINES] [--pipes A B ..]
                     [--same-picture] [--threads T ..] [--blocks T ..]
                     [--cpus C ..] [--runs N]
                     SCENE [piko-render options]

Each compiled run is a process of its own; its image must equal the reference
executor's bit for bit, whose code is not optimized: it is big and draws one
frame. With --same-picture the pipelines draw the same, and the reference executor
runs only the first of them. With --blocks, kernels for a GPU run on the CPU, in
blocks of so many threads; with --cpus, pipelines are compiled for these
processors. Prints a line for each pipeline and thread count, or what
stands for it; the exit status is 1 if any image differs.
"""

import argparse
import json
import os
import subprocess
import sys

from tool import run_main

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def render(arguments, pipe, rest):
    command = [arguments.render, arguments.file, "--pipe", pipe]
    command += [arguments.scene, *arguments.options]
    command += ["--frames", "1", "--warmup", "0", "--json", *rest]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return json.loads(done.stdout)


def main():
    parser = argparse.ArgumentParser(allow_abbrev=False)
    parser.add_argument("--render", default=f"{ROOT}/build/bin/piko-render")
    parser.add_argument("--file",
                        default=f"{ROOT}/examples/raster/raster.piko.cpp")
    parser.add_argument("--pipes", nargs="+", default=["Baseline", "Binned"])
    parser.add_argument("--same-picture", action="store_true")
    parser.add_argument("--threads", nargs="+", default=["1", "2", "7"])
    parser.add_argument("--blocks", nargs="+", default=[])
    parser.add_argument("--cpus", nargs="+", default=[])
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("scene")
    arguments, arguments.options = parser.parse_known_args()

    mappings = [(f"threads {t}", ["--threads", t]) for t in arguments.threads]
    if arguments.blocks:
        mappings = [(f"blocks of {t}", ["--target", "gpu-on-cpu", "--gpu-threads", t,
                                         "--gpu-seed", t])
                    for t in arguments.blocks]
    if arguments.cpus:
        mappings = [(c, ["--cpu", c, "--threads", "1"]) for c in arguments.cpus]
    equal, expected = True, None
    for pipe in arguments.pipes:
        if not (expected and arguments.same_picture):
            expected = render(arguments, pipe, ["--target", "reference", "-O0"])
        for name, options in mappings:
            wrong = 0
            for _ in range(arguments.runs):
                actual = render(arguments, pipe, options)
                wrong += actual["image_hash"] != expected["image_hash"]
            equal &= wrong == 0
            verdict = f"{wrong} differ" if wrong else "all equal the reference"
            print(f"{expected['scene']} {pipe} {name}: "
                  f"{arguments.runs} runs, {verdict} "
                  f"({expected['pixels']} pixels drawn)", flush=True)
    return 0 if equal else 1


if __name__ == "__main__":
    run_main(main)
