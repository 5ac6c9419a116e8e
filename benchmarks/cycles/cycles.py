#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What a hop of a cycle costs, compiled and in the reference executor.

  cycles.py [options]

Builds the pipelines of cycles.piko.cpp with pikoc and, as the reference, with
g++ -O2, and runs both with 1, 64 and 4,096 primitives, compiled on 1, 2 and 7
threads. They take turns in each round; what counts is the best run of all. Both
must have the same result, or this ends with an error. Prints a table in
Markdown: nanoseconds for each hop of each primitive.
"""

import argparse
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
PIPELINE = f"{HERE}/cycles.piko.cpp"
# What a cycle is, and the pipeline.
PIPES = {
    "Self": "a stage in one bin",
    "Binned": "a stage in 12,288 bins",
    "Drawn": "the same, ordered",
    "TwoStages": "two stages in bins",
    "Rounds": "a list, in rounds",
}
COUNTS = {1: 10000, 64: 200, 4096: 5}  # primitives: hops; runs of about 1 ms
THREADS = [1, 2, 7]


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False)
    parser.add_argument("--build", default=f"{ROOT}/build",
                        help="where Piko is built (default: %(default)s)")
    parser.add_argument("--cxx", default="g++", help="builds the reference")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=0.1,
                        help="of each program in a round (default: %(default)s)")
    parser.add_argument("--pipes", nargs="+", default=list(PIPES),
                        choices=PIPES, metavar="PIPE")
    return parser.parse_args()


def build(options, pipe, folder):
    """The two programs of a pipeline."""
    header, code = f"{folder}/{pipe}.h", f"{folder}/{pipe}.o"
    subprocess.run([f"{options.build}/bin/pikoc", PIPELINE, "--pipe", pipe,
                    "--cpu=native", "-o", code, "--header", header], check=True)
    command = [options.cxx, "-std=c++20", "-O2", "-I", f"{ROOT}/runtime/include",
               f"{HERE}/host.cpp"]
    reference, compiled = f"{folder}/{pipe}-reference", f"{folder}/{pipe}"
    subprocess.run([*command, f'-DHEADER="{PIPELINE}"', f"-DPIPE={pipe}",
                    "-DWALKER=Walker", "-DREFERENCE", "-o", reference],
                   check=True)
    libraries = f"{options.build}/lib"
    subprocess.run([*command, f'-DHEADER="{header}"', f"-DPIPE=pipelines::{pipe}",
                    f"-DWALKER=pipelines::{pipe}::Walker", code, "-o", compiled,
                    f"-L{libraries}", f"-Wl,-rpath,{libraries}", "-lpikort",
                    "-L/usr/lib/llvm-22/lib", "-Wl,-rpath,/usr/lib/llvm-22/lib",
                    "-lomp"], check=True)
    return reference, compiled


def run(program, count, threads, seconds):
    output = subprocess.run(
        [program, str(count), str(COUNTS[count]), str(threads), str(seconds)],
        check=True, capture_output=True, text=True).stdout.split()
    return float(output[0]), output[1]


def measure(options, pipe, count, programs):
    """The best of the reference, and on each number of threads."""
    reference, compiled = programs
    columns = [(reference, 1)] + [(compiled, threads) for threads in THREADS]
    best = [float("inf")] * len(columns)
    for _ in range(options.rounds):
        hashes = set()
        for column, (program, threads) in enumerate(columns):
            time, result = run(program, count, threads, options.seconds)
            best[column] = min(best[column], time)
            hashes.add(result)
        if len(hashes) != 1:
            sys.exit(f"{pipe}, {count} primitives: expected the reference's "
                     f"result on any number of threads")
    return best


def main():
    options = parse_arguments()
    print("| cycle | primitives | reference |",
          " | ".join(f"{n} thread{'s' * (n > 1)}" for n in THREADS), "|")
    print("|---" * (3 + len(THREADS)) + "|")
    with tempfile.TemporaryDirectory() as folder:
        for pipe in options.pipes:
            programs = build(options, pipe, folder)
            for count in COUNTS:
                best = measure(options, pipe, count, programs)
                cells = " | ".join(f"{time:.0f}" for time in best)
                print(f"| {PIPES[pipe]} | {count:,} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
