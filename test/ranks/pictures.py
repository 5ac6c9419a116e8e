#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Renders by processes that mpirun starts, and compares with one process."""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe"]
PIPES = [("raster", "Fused"), ("raster", "Baseline")]


def render(args, before, options):
    command = [*before, args.render, "--json", "--warmup", "0", "--frames", "2",
               "--width", "160", "--height", "120", "--threads", "2", *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=200)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}: {done.stdout}{done.stderr}")
    lines = done.stdout.splitlines()
    if len(lines) != 1:
        sys.exit(f"expected the first rank alone to print, but got: {done.stdout}")
    return json.loads(lines[0])["image_hash"]


def check_error(args, ranks):
    """An error of a run is said once, and that of one process."""
    options = ["--warmup", "0", "--frames", "1", "--memory-budget", "1",
               str(Path(args.examples) / "raster/raster.piko.cpp"), "--pipe", "Fused",
               args.scene]
    done = subprocess.run([*MPIRUN, "-np", str(ranks), args.render, "--mpi", *options],
                          capture_output=True, text=True, timeout=200)
    errors = [l for l in done.stderr.splitlines() if "piko-render: error" in l]
    if done.returncode == 0 or len(errors) != 1 or "out of memory" not in errors[0] \
            or "rank " not in errors[0]:
        sys.exit(f"expected one error that names a rank, but got: {done.stderr}")


def write_waves(path, side=40):
    """A mesh of some thousand triangles, of which many cover each other."""
    corners = [(x / side, y / side, math.sin(x * 0.9) * math.cos(y * 0.7))
               for y in range(side + 1) for x in range(side + 1)]
    with open(path, "w") as file:
        for corner in corners:
            print("v", *corner, file=file)
        for y in range(side):
            for x in range(side):
                a = y * (side + 1) + x + 1
                print("f", a, a + 1, a + side + 2, file=file)
                print("f", a, a + side + 2, a + side + 1, file=file)


def check_strips(args, scene):
    """Ranks run a source in strips, of a size or of what memory there is."""
    write_waves(scene)
    for example, pipe in [("raster", "Fused"), ("visibility", "Visibility")]:
        file = Path(args.examples) / example / f"{example}.piko.cpp"
        options = [str(file), "--pipe", pipe, scene]
        expected = render(args, [], options)
        for limit in (["--strip", "100"], ["--memory-budget", "400000"]):
            got = render(args, [*MPIRUN, "-np", "3"], ["--mpi", *options, *limit])
            if got != expected:
                sys.exit(f"{pipe}, {limit[0]} on 3 ranks: expected {expected}, but got "
                         f"{got}")


def check_settings(args):
    """Owners by load, and memory of their own, give the same; others are errors."""
    file = Path(args.examples) / "raster/raster.piko.cpp"
    options = [str(file), "--pipe", "Fused", args.scene]
    expected = render(args, [], options)
    command = [*MPIRUN, "-np", "2"]
    settings = [["-x", "PIKO_RANK_OWNERS=load"], ["-x", "PIKO_RANK_MEMORY=apart"]]
    for setting in settings:
        got = render(args, [*command, *setting], ["--mpi", *options])
        if got != expected:
            sys.exit(f"{setting[1]}: expected {expected}, but got {got}")
    done = subprocess.run([*command, "-x", "PIKO_RANK_MEMORY=none", args.render, "--mpi",
                           *options], capture_output=True, text=True, timeout=200)
    wrong = "PIKO_RANK_MEMORY: expected common or apart, but got 'none'"
    if done.returncode == 0 or wrong not in done.stderr:
        sys.exit(f"expected an error about PIKO_RANK_MEMORY, but got: {done.stderr}")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--render", required=True)
    parser.add_argument("--examples", required=True)
    parser.add_argument("--scene", required=True)
    parser.add_argument("--ranks", default="1,2,3,4")
    args = parser.parse_args()
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    for example, pipe in PIPES:
        file = Path(args.examples) / example / f"{example}.piko.cpp"
        options = [str(file), "--pipe", pipe, args.scene]
        expected = render(args, [], options)
        for ranks in map(int, args.ranks.split(",")):
            got = render(args, [*MPIRUN, "-np", str(ranks)], ["--mpi", *options])
            if got != expected:
                sys.exit(f"{pipe} on {ranks} ranks: expected {expected}, but got {got}")
            print(f"{pipe} on {ranks} ranks: {got}")
    with tempfile.TemporaryDirectory() as folder:
        check_strips(args, f"{folder}/waves.obj")
    check_settings(args)
    check_error(args, 3)


if __name__ == "__main__":
    main()
