#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Loads the PTX of pipelines of every example into the driver for tests.

  piko-ptx-examples.py --bin build/bin
  piko-ptx-examples.py --bin build/bin --random 20

Takes every third pipeline of an example, from the first on, as piko-gpu-examples.py
runs all of them; two compute capabilities and numbers of threads in turn; and with
--random pipelines of test/random, too. Prints each that the driver does not take,
with the line and the command that makes it; the exit status is 1 if there is any.
"""

import argparse
import concurrent.futures
import itertools
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
TARGETS = [["--cpu=sm_70", "--gpu-threads", "32"], ["--cpu=sm_90"]]


def run(command):
    done = subprocess.run(command, capture_output=True, text=True)
    text = (done.stdout + done.stderr).strip()
    return done.returncode == 0, done.stdout, text[-600:]


def pipes(tools, file):
    valid, out, text = run([tools / "pikoc", file, "--list-pipes"])
    if not valid or not out.split():
        sys.exit(f"{file} has no pipeline\n{text}")
    return out.split()


def check(tools, file, pipe, target, folder):
    ptx = folder / f"{file.name}-{pipe}-{target[0][-2:]}.ptx"
    command = [tools / "pikoc", file, "--pipe", pipe, "--emit=ptx", *target,
               "-o", ptx]
    valid, _, text = run(command)
    if valid:
        valid, _, text = run([tools / "piko-check-ptx", ptx])
    return None if valid else f"{' '.join(map(str, command))}\n  {text}"


def random_pipelines(folder, count):
    files = []
    for seed in range(1, count + 1):
        valid, out, text = run([sys.executable, ROOT / "test/random/piko-random.py",
                                "show", "--gpu", "--seed", str(seed)])
        if not valid:
            sys.exit(text)
        files.append(folder / f"random-{seed}.piko.cpp")
        files[-1].write_text(out)
    return files


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=str(ROOT / "build/bin"))
    parser.add_argument("--random", type=int, default=0, help="how many of them")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    tools = pathlib.Path(arguments.bin).resolve()

    failures = 0
    with tempfile.TemporaryDirectory() as name, \
            concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        folder = pathlib.Path(name)
        files = sorted(ROOT.glob("examples/*/*.piko.cpp"))
        if not files:
            sys.exit("no example")
        files += random_pipelines(folder, arguments.random)
        tasks = [(file, pipe) for file in files
                 for pipe in pipes(tools, file)[::3]]
        done = [pool.submit(check, tools, *task, target, folder)
                for task, target in zip(tasks, itertools.cycle(TARGETS))]
        for future in concurrent.futures.as_completed(done):
            if text := future.result():
                failures += 1
                print(text, flush=True)
    print(f"{len(done)} files of PTX: {failures} not taken")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
