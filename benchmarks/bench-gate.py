#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Says what a change costs, kernel by kernel.

  bench-gate.py [options] BASE         measures this tree against a commit
  bench-gate.py [options] --judge FILE says what was found, again

Builds the commit in a work tree of its own, unless --base-tree names one that is
built, and measures all pipelines of the examples that draw, with their kernels, and
benchmarks/bodies: the base and this tree in turn, each in a process of its own,
on one thread. A pipeline is measured again while a time of it is neither slower nor
as fast for sure, by the sign test of benchmarks/speed_gate/judge.py, and time is
left. Prints medians of both, the median of their ratio in a round, and by how much
ratios differ from that in the median; adds each time to OUT/times.csv as it is
taken, so that --judge knows of a gate that was interrupted. Ends with an error where
something is slower by more than the tolerance.
"""

import argparse
import csv
import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import bodies
from figure4 import print_table
from speed_gate.builds import Build, build_commit
from speed_gate.judge import BASE, BUILDS, NEW, compare, is_decided, report
from speed_gate.units import list_units
from suite import kernels
from commands import run_main

ROOT = bodies.ROOT
BUNNY = "/usr/share/glmark2/models/bunny.obj"
COLUMNS = ["unit", "name", "build", "round", "ms"]


def parse_options():
    parser = argparse.ArgumentParser(
        description=__doc__, allow_abbrev=False,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", nargs="?", metavar="BASE", help="a commit")
    parser.add_argument("--judge", metavar="FILE",
                        help="the times.csv of an earlier run")
    parser.add_argument("--tolerance", type=float, default=0.05,
                        help="what may be lost, as a part of what it took "
                             "(%(default)s)")
    parser.add_argument("--shortest", type=float, default=0.02, metavar="MS",
                        help="shorter kernels are measured together "
                             "(%(default)s)")
    parser.add_argument("--minutes", type=float, default=9,
                        help="no pipeline is measured again later, compiling "
                             "included (%(default)s)")
    parser.add_argument("--rounds", type=int, default=5,
                        help="of each pipeline, if there is time (%(default)s)")
    parser.add_argument("--most-rounds", type=int, default=30,
                        help="of one that is not decided (%(default)s)")
    parser.add_argument("--frames", type=int, default=11,
                        help="of a round, at most (%(default)s)")
    parser.add_argument("--warmup", type=int, default=12,
                        help="frames before them, in which the runtime "
                             "tries versions of loops, in a quarter of --seconds "
                             "(%(default)s)")
    parser.add_argument("--seconds", type=float, default=0.4,
                        help="of frames in a round (%(default)s)")
    parser.add_argument("--scene", default=BUNNY, help="(%(default)s)")
    parser.add_argument("--cpu", default="native",
                        help="what is compiled for (%(default)s)")
    parser.add_argument("--examples", nargs="*", choices=kernels.PIPELINES,
                        default=list(kernels.PIPELINES), metavar="NAME",
                        help="(all that piko-render draws)")
    parser.add_argument("--bodies", nargs="*", metavar="NAME", help="(all)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--out", default=f"{ROOT}/build/gate", metavar="FOLDER",
                        help="(build/gate)")
    parser.add_argument("--bin", default=f"{ROOT}/build/bin",
                        help="where this tree's tools are")
    parser.add_argument("--base-tree", metavar="FOLDER",
                        help="in place of a commit, whose build is in build/")
    options = parser.parse_args()
    if sum(map(bool, (options.base, options.judge, options.base_tree))) != 1:
        parser.error("expected a commit, --base-tree or --judge")
    if not 0 < options.rounds <= options.most_rounds:
        parser.error("--rounds: expected 1 to --most-rounds, but got "
                     f"{options.rounds}")
    options.out, options.bin = map(os.path.abspath, (options.out, options.bin))
    return options


def get_build(options, name, root, tools):
    return Build(root=root, bin=tools, lib=f"{os.path.dirname(tools)}/lib",
                 work=f"{options.out}/{name}-bodies", cpu=options.cpu,
                 scene=[options.scene], warmup=options.warmup,
                 frames=options.frames, seconds=options.seconds)


def get_builds(options):
    base = os.path.abspath(options.base_tree) if options.base_tree else \
        build_commit(ROOT, options.base, f"{options.out}/base", options.jobs)
    builds = {BASE: get_build(options, BASE, base, f"{base}/build/bin"),
              NEW: get_build(options, NEW, ROOT, options.bin)}
    for build in builds.values():
        os.makedirs(build.work, exist_ok=True)
    return builds


class Times:
    """Of each unit the runs of each build, by round."""

    def __init__(self, options):
        self.options, self.runs = options, {}

    def read(self, file):
        with open(file, newline="") as stream:
            for row in csv.DictReader(stream):
                runs = self.runs.setdefault(row["unit"],
                                            {build: [] for build in BUILDS})
                of_build = runs[row["build"]]
                if int(row["round"]) == len(of_build):
                    of_build.append({})
                of_build[-1][row["name"]] = float(row["ms"])

    def measure(self, unit, builds, stream):
        """One round, which goes to a stream. Who is first takes turns, too."""
        runs = self.runs.setdefault(unit.name, {build: [] for build in BUILDS})
        turn = len(runs[NEW])
        for build in BUILDS if turn % 2 == 0 else reversed(BUILDS):
            runs[build].append(unit.measure(builds[build]))
        csv.writer(stream, lineterminator="\n").writerows(
            [unit.name, name, build, turn, f"{ms:.6f}"]
            for build in BUILDS for name, ms in runs[build][turn].items())
        stream.flush()

    def judge(self, unit):
        return compare(unit, self.runs[unit], self.options.shortest)

    def is_open(self, unit):
        return not is_decided(self.judge(unit.name), self.options.tolerance)


def say(text):
    print(f"bench-gate: {text}", file=sys.stderr, flush=True)


def measure_rounds(options, units, builds, stream, end):
    """Each unit has its first round; others begin in time."""
    times = Times(options)
    for turn in range(options.most_rounds):
        left = [unit for unit in units
                if turn < options.rounds or times.is_open(unit)]
        for done, unit in enumerate(left):
            if turn and time.monotonic() > end:
                say(f"out of time in round {turn + 1}, with {len(left) - done} "
                    "pipelines that another one might have told more of")
                return times
            times.measure(unit, builds, stream)
    return times


def measure(options):
    builds = get_builds(options)
    begin = time.monotonic()
    units = {name: list_units(build, options.examples, options.bodies)
             for name, build in builds.items()}
    both = [unit for name, unit in units[NEW].items() if name in units[BASE]]
    for build, other, title in ((BASE, NEW, "only before"), (NEW, BASE, "only now")):
        if names := [name for name in units[build] if name not in units[other]]:
            print(f"{title}: {', '.join(names)}")
    say(f"compiles {len(both)} pipelines, twice each")
    with ThreadPoolExecutor(options.jobs) as pool:
        for job in [pool.submit(unit.prepare, build) for unit in both
                    for build in builds.values()]:
            job.result()
    say(f"measures from {time.monotonic() - begin:.0f} s on")
    with open(f"{options.out}/times.csv", "w", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerow(COLUMNS)
        times = measure_rounds(options, both, builds, stream,
                               begin + 60 * options.minutes)
    say(f"took {time.monotonic() - begin:.0f} s; {options.out}/times.csv")
    return times


def main():
    options = parse_options()
    os.makedirs(options.out, exist_ok=True)
    if options.judge:
        times = Times(options)
        times.read(options.judge)
    else:
        times = measure(options)
    slower = report([times.judge(unit) for unit in times.runs],
                    options.tolerance, print_table)
    if slower:
        sys.exit(f"bench-gate: {slower} times are more than "
                 f"{options.tolerance:.0%} above those of before")


if __name__ == "__main__":
    run_main(main)
