#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Compares random pipelines with the reference executor.

  piko-random.py run --tool build/bin/piko-compare --count 10000 --seed 1
  piko-random.py show --seed 17
  piko-random.py reduce --tool build/bin/piko-compare --seed 17 --out FILE

A pipeline follows from its number alone: `run --seed 1 --count 100` makes those
from 1 to 100. `run` says which failed and how often each feature was used; each
failure can then be shown, or reduced to a short file. Features are left out with
`--without lists,sync`, or named with `--features`; `--leave-out fuse-stages` leaves
passes of the compiler out. With `--mlir` each pipeline is
written in the dialect, too, and that is compiled in place of the C++. With
`--gpu` kernels run as blocks and threads on a GPU emulated on the CPU; their number
and the order of blocks follow from the seed.
"""

import argparse
import concurrent.futures
import os
import sys
import tempfile
import time
from collections import Counter

import cpp
import pipelines
from reducer import reduce
from runner import (BLANK, EQUAL, PASSES, Runner, case_of, choose_passes, gpu_options,
                    options_of)


def features_of(args):
    chosen = set(args.features.split(",") if args.features else pipelines.FEATURES)
    left_out = set(args.without.split(",")) if args.without else set()
    for name in chosen | left_out:
        if name not in pipelines.FEATURES:
            sys.exit(f"expected a feature, but got '{name}'; there are: "
                     + ", ".join(pipelines.FEATURES))
    return chosen - left_out - (
        pipelines.CPP_ONLY | pipelines.NOT_IN_TEXT if args.mlir else set())


def passes_of(args, seed=None):
    """What is left out of synthesis: if not said, it follows from the seed."""
    if args.leave_out is None:
        return choose_passes(seed) if seed else []
    passes = args.leave_out.split(",") if args.leave_out else []
    for name in passes:
        if name not in PASSES:
            sys.exit(f"expected a pass, but got '{name}'; there are: " + ", ".join(PASSES))
    return passes


def runner_of(args, passes, first, **options):
    target = gpu_options(first, args.gpu) if args.gpu else ()
    if args.cpu:
        target = ["--cpu", args.cpu]
    if args.runner:
        target += ["--runner", args.runner]
    if args.ranks:
        target = [*target, "--ranks", str(args.ranks)]
    # A GPU takes no number of threads; its second frame is the first one's graph again.
    threads = (1, 2) if args.gpu else (1, 2, 7)
    return Runner(args.tool, args.mlir, passes, threads, strip=args.strip, target=target,
                  **options)


def run_batch(args, first, count):
    features = features_of(args)
    pipes = [pipelines.generate(first + i, features, f"P{i}") for i in range(count)]
    passes = passes_of(args, first)
    verdicts = runner_of(args, passes, first, timeout=args.timeout,
                         keep=args.keep).run(pipes)
    used = Counter(f"without-{p}" for p in passes for _ in pipes)
    for pipe in pipes:
        used.update(pipe.used)
    return first, verdicts, used


def command_of(args, first, seed):
    """What reduces a failure of the file that begins with `first`."""
    options = [f"--{name} {value}" for name, value in [
        ("features", args.features), ("without", args.without),
        ("leave-out", ",".join(passes_of(args, first))), ("strip", args.strip),
        ("cpu", args.cpu), ("gpu", args.gpu), ("ranks", args.ranks),
        ("runner", args.runner and f"'{args.runner}'")] if value]
    return " ".join([f"{sys.argv[0]} reduce --tool {args.tool} --seed {seed}", *options] +
                    ["--mlir"] * args.mlir)


def command_run(args):
    start = time.time()
    used, blank, stopped, failures, done = Counter(), 0, 0, [], 0
    batches = [(first, min(args.batch, args.seed + args.count - first))
               for first in range(args.seed, args.seed + args.count, args.batch)]
    with concurrent.futures.ProcessPoolExecutor(args.jobs) as pool:
        futures = [pool.submit(run_batch, args, *b) for b in batches]
        for future in concurrent.futures.as_completed(futures):
            first, verdicts, batch_used = future.result()
            used.update(batch_used)
            for i, verdict in enumerate(verdicts):
                done += 1
                if verdict == BLANK:
                    blank += 1
                elif verdict.startswith("the reference stops"):
                    stopped += 1
                elif verdict != EQUAL:
                    failures.append(first + i)
                    print(f"pipeline {first + i}: {verdict[:1500]}\n"
                          f"  shorter: {command_of(args, first, first + i)}", flush=True)
    if args.table:
        for name, count in sorted(used.items()):
            print(f"  {count:6} {name}")
    expected = [f for f in features_of(args)
                if not any(name.startswith(f) for name in used) and f not in
                ("gather", "parallelFor", "collecting", "cycles", "dynamic-elements",
                 "collectives", "float-atomics")]
    print(f"{done} pipelines from {args.seed} on in {time.time() - start:.0f} s: "
          f"{len(failures)} failed, {blank} wrote nothing, {stopped} stopped with an "
          f"error in both")
    if expected and args.count >= 500:
        print("never used: " + ", ".join(sorted(expected)))
    if failures:
        print("failed: " + " ".join(map(str, failures)))
    return 1 if failures else 0


def command_show(args):
    pipe = pipelines.generate(args.seed, features_of(args), "P0")
    print(" ".join(["// piko-compare FILE", case_of(pipe), *options_of(passes_of(args))]))
    print(cpp.write_file([pipe]))
    return 0


def command_reduce(args):
    pipe = pipelines.generate(args.seed, features_of(args), "P0")
    text = None
    # What there is stays if it is stopped.
    for text in reduce(pipe, runner_of(args, passes_of(args), args.seed, timeout=60)):
        with open(args.out, "w") as file:
            file.write(text)
        print(f"{args.out}: {len(text.splitlines())} lines", flush=True)
    if text is None:
        print("it does not fail")
    return 0 if text else 1


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=["run", "show", "reduce"])
    parser.add_argument("--tool", default="build/bin/piko-compare")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--batch", type=int, default=50, help="pipelines in a file")
    parser.add_argument("--jobs", type=int, help="files at a time (all cores)")
    parser.add_argument("--features", default="")
    parser.add_argument("--without", default="")
    parser.add_argument("--leave-out", metavar="PASSES",
                        help="passes that piko-compare leaves out; 'run' chooses some "
                             "for each file if this is not given")
    parser.add_argument("--table", action="store_true", help="count the features")
    parser.add_argument("--mlir", action="store_true",
                        help="compile the text of the dialect, not C++")
    parser.add_argument("--gpu", nargs="?", const="gpu-on-cpu",
                        choices=["gpu-on-cpu", "cuda", "any"],
                        help="run kernels on a GPU emulated on the CPU, or on one "
                             "after $PIKO_CUDA_DRIVER")
    parser.add_argument("--cpu", default="",
                        help="the processor to compile for (this machine's)")
    parser.add_argument("--runner", default="", metavar="COMMAND",
                        help="runs code for --cpu aarch64: see piko-compare")
    parser.add_argument("--ranks", type=int, default=0,
                        help="compile for ranks, and run so many in threads")
    parser.add_argument("--strip", type=int, default=0,
                        help="primitives of a source in a strip (all)")
    parser.add_argument("--timeout", type=int, default=120, metavar="SECONDS",
                        help="what a pipeline may take (120), which is short where "
                             "others use the processors")
    parser.add_argument("--keep", metavar="FOLDER",
                        help="leave files there, where another run finds in the cache "
                             "what it has in common with this one")
    parser.add_argument("--out", default="reduced.cpp")
    args = parser.parse_args()
    command = {"run": command_run, "show": command_show, "reduce": command_reduce}
    # Files share a precompiled piko.h, and leave nothing in the user's cache.
    with tempfile.TemporaryDirectory() as cache:
        os.environ.setdefault("PIKO_CACHE_DIR", cache)
        # Joins of a device have few primitives: one block would always do for them.
        if args.seed % 2:
            os.environ.setdefault("PIKO_CUDA_ALONE", "0")
        return command[args.command](args)


if __name__ == "__main__":
    sys.exit(main())
