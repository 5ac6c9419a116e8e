#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Compiled bodies against what C++ compilers make of the same text.

  bodies.py [options] [NAME..]

Builds each pipeline of benchmarks/bodies by pikoc and, as the reference
executor, by g++ and clang++, and prints a table in Markdown: the milliseconds of
the fastest warm frame of one lane, without any vectors (*scalar*) and with LLVM's
(*one lane*), and of all lanes; how many times as fast lanes are as each, and as the
references; and the medians of that. Time is the processor's on one thread, or the wall's on several.
The first frames of all builds must give the same bits, or this ends with an error.
Builds take turns in each round.
"""

import argparse
import glob
import os
import statistics
import sys
from concurrent.futures import ThreadPoolExecutor

from commands import call, run_main

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
CXX = ["-std=c++20", "-O2", "-ffp-contract=off", "-DPIKO_BODY", "-w"]
# Those that pikoc's code is compared with, by name.
REFERENCES = {
    "g++ -O2": ["g++"],
    "clang++ -O2": ["clang++-22"],
}
# One lane, without any vectors and with LLVM's, and all lanes.
ONE_LANE = {
    "scalar": ["--without=vectorize,loop-vectorize,slp-vectorizer"],
    "one lane": ["--without=vectorize"],
}
COMPILED = ONE_LANE | {"default": []}


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bodies", nargs="*", metavar="NAME")
    parser.add_argument("--bin", default=f"{ROOT}/build/bin",
                        help="where pikoc is")
    parser.add_argument("--lib", default=f"{ROOT}/build/lib",
                        help="where libpikort is")
    parser.add_argument("--work", default=f"{ROOT}/build/bodies",
                        help="where to build")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=0.3,
                        help="of frames, for each build in each round")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--march", help="of the references, as x86-64-v3")
    parser.add_argument("--cpu", default="x86-64-v4",
                        help="what pikoc compiles for (%(default)s)")
    parser.add_argument("--threads", type=int, default=1,
                        help="of pikoc's code; references have one")
    arguments = parser.parse_args()
    arguments.flags = [f"-march={arguments.march}"] if arguments.march else []
    return arguments


def find_bodies(root=ROOT):
    return sorted(os.path.basename(file).removesuffix(".piko.cpp")
                  for file in glob.glob(get_source("*", root)))


def get_source(body, root=ROOT):
    return f"{root}/benchmarks/bodies/{body}.piko.cpp"


def get_includes(root=ROOT):
    return [f"-I{root}/runtime/include", f"-I{root}/benchmarks/bodies"]


def get_program(arguments, body, build):
    march = arguments.march or ""
    name = build.replace(" ", "") + (march if build in REFERENCES else "")
    return f"{arguments.work}/{body}.{name}"


def get_openmp():
    """The runtime that clang links."""
    return call(["clang++-22", "-print-file-name=libomp.so"]).strip()


def is_newer(file, *than):
    return os.path.exists(file) and all(
        os.path.getmtime(file) > os.path.getmtime(other) for other in than)


def read(file):
    if not os.path.exists(file):
        return None
    with open(file) as stream:
        return stream.read()


def build_compiled(arguments, body, builds=COMPILED, root=ROOT):
    """One host, with the object of each build."""
    source = get_source(body, root)
    header, host = (f"{arguments.work}/{body}.{end}" for end in ("h", "host.o"))
    before = read(header)
    for build, options in builds.items():
        program = get_program(arguments, body, build)
        call([f"{arguments.bin}/pikoc", source, "-o", f"{program}.o",
              "--header", header, "--cpu", arguments.cpu, *options])
        if read(header) != before or not is_newer(host, source):
            call(["g++", *CXX, *get_includes(root),
                  f'-DPIKO_BODY_HEADER="{header}"', "-c", source, "-o", host])
            before = read(header)
        call(["g++", host, f"{program}.o", f"-L{arguments.lib}", "-lpikort",
              get_openmp(), f"-Wl,-rpath,{arguments.lib}", "-o", program])


def build_reference(arguments, body, build):
    program = get_program(arguments, body, build)
    source = get_source(body)
    if is_newer(program, source):
        return  # the headers that they share change too seldom to look
    call([*REFERENCES[build], *arguments.flags, *CXX, *get_includes(),
          source, "-o", program])


def measure_rounds(arguments, body, builds, threads=1):
    """The milliseconds of a frame in each round, by build."""
    times, results = {build: [] for build in builds}, {}
    for _ in range(arguments.rounds):
        for build in builds:
            results[build], milliseconds, *_ = call(
                [get_program(arguments, body, build), str(arguments.seconds),
                 str(threads)]).split()
            times[build].append(float(milliseconds))
    if len(set(results.values())) != 1:
        sys.exit(f"{body}: expected the same bits of all builds, but got "
                 f"{results}")
    return times


def count(arguments, body):
    """The operations and the bytes of a frame, if the body's host counts."""
    _, _, *counts = call([get_program(arguments, body, "default"), "0"]).split()
    return [float(number) for number in counts]


def measure(arguments, body):
    """The milliseconds of the fastest frame, by build."""
    rounds = measure_rounds(arguments, body, [*COMPILED, *REFERENCES],
                            arguments.threads)
    return {build: min(times) for build, times in rounds.items()}


def print_table(arguments, bodies):
    others = [*ONE_LANE, *REFERENCES]
    print("| body | scalar, ms | one lane, ms | all lanes, ms | "
          + " | ".join(f"over {name}" for name in others) + " |")
    print("|---" * (4 + len(others)) + "|")
    found = []
    for body in bodies:
        best = measure(arguments, body)
        found.append([best[name] / best["default"] for name in others])
        print(f"| {body} | "
              + " | ".join(f"{best[build]:.3f}" for build in COMPILED) + " | "
              + " | ".join(f"{ratio:.2f}" for ratio in found[-1]) + " |",
              flush=True)
    medians = [statistics.median(column) for column in zip(*found)]
    print("| median | | | | "
          + " | ".join(f"{median:.2f}" for median in medians) + " |")


def main():
    arguments = parse_arguments()
    os.makedirs(arguments.work, exist_ok=True)
    bodies = arguments.bodies or find_bodies()
    with ThreadPoolExecutor(arguments.jobs) as pool:
        jobs = [pool.submit(build_compiled, arguments, body)
                for body in bodies]
        jobs += [pool.submit(build_reference, arguments, body, build)
                 for body in bodies for build in REFERENCES]
        for job in jobs:
            job.result()
    print_table(arguments, bodies)


if __name__ == "__main__":
    run_main(main)
