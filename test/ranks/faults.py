#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Lets each call of MPI fail in turn, of a run of several processes.

  faults.py --ranks 2 --faults libpiko-mpi-faults.so --kinds error -- piko-render --mpi ...

Each run must end by itself, with a message that names a rank, and not with status 0;
where there are fewer calls, with status 0 and the result of the run without faults, which
ends the search."""

import argparse
import os
import re
import subprocess
import sys

MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe"]


def run(args, fault):
    environment = dict(os.environ, PIKO_MPI_FAULT=fault, OMP_WAIT_POLICY="passive")
    command = [*MPIRUN, "-np", str(args.ranks), "-x", "PIKO_MPI_FAULT", "-x",
               "LD_PRELOAD=" + args.faults, *args.command]
    return subprocess.run(command, env=environment, capture_output=True, text=True,
                          timeout=args.timeout)


def problem_of(done, kind):
    if done.returncode == 0:
        return "ends well"
    # Who has gone without a word is named by mpirun.
    if kind != "exit" and not re.search(r"error: .*rank \d+", done.stderr):
        return "names no rank"
    return ""


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--faults", required=True)
    parser.add_argument("--kinds", default="error,exit,hang")
    parser.add_argument("--most", type=int, default=10000, help="calls that fail")
    parser.add_argument("--step", type=int, default=1)
    parser.add_argument("--timeout", type=float, default=60)
    parser.add_argument("command", nargs="+")
    args = parser.parse_args()
    good = run(args, "none")
    if good.returncode != 0:
        sys.exit("without faults: " + good.stderr)
    failed = 0
    for kind in args.kinds.split(","):
        before = failed
        for number in range(1, args.most + 1, args.step):
            fault = f"{args.ranks - 1}:{number}:{kind}"
            try:
                done = run(args, fault)
            except subprocess.TimeoutExpired:
                sys.exit(f"{fault}: does not end within {args.timeout} s")
            if done.returncode == 0 and done.stdout == good.stdout:
                break  # there are fewer calls
            problem = problem_of(done, kind)
            if problem:
                sys.exit(f"{fault}: {problem}:\n{done.stdout}{done.stderr}")
            failed += 1
        if failed == before:
            sys.exit(f"{kind}: expected a run whose calls fail, but all end well")
    print(f"{failed} faults, each of which has ended all ranks")


if __name__ == "__main__":
    main()
