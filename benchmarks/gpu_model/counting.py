# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Counts a frame: piko-render behind the driver for tests, which runs PTX on the
CPU; and reads what pikoc says of what kernels take."""

import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

COLUMNS = ["threads", "block memory", "registers", "stack", "spilled", "occupancy"]


def run_counted(command, driver, chip, file):
    """Runs a program behind the driver; what it printed and what was counted."""
    environment = {**os.environ, "PIKO_CUDA_DRIVER": str(driver),
                   "PIKO_TEST_DRIVER_COUNTS": str(file),
                   "PIKO_TEST_DRIVER_LATENCIES": chip.latencies,
                   "PIKO_TEST_DRIVER_MULTIPROCESSORS": str(chip.multiprocessors)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    if done.returncode:
        sys.exit(f"{shlex.join(command)}\n{done.stderr}")
    with open(file) as stream:
        return done.stdout, json.load(stream)


def count_frame(options, file, pipe, scene, chip, lights=1):
    """One frame: what piko-render says of it, and its counts, whose kernels are
    named as in the program."""
    command = [f"{options.bin}/piko-render", str(file), *shlex.split(scene),
               "--pipe", pipe, "--target", "cuda", "--frames", "1", "--warmup", "0",
               "--width", str(options.width), "--height", str(options.height),
               "--lights", str(lights), "--json"]
    with tempfile.TemporaryDirectory() as folder:
        output, report = run_counted(command, options.driver, chip,
                                     f"{folder}/counts.json")
    report["kernels"] = {strip(name, pipe): counts
                         for name, counts in report["kernels"].items()}
    return json.loads(output.strip().split("\n")[-1]), report


def strip(kernel, pipe):
    return kernel.removeprefix(f"{pipe}_").removeprefix("kernel_")


def read_explained(text):
    """Yields the kernel and the columns of each line of the table that pikoc
    --explain --target cuda writes."""
    head, *lines = text.partition("\nOn ")[2].split("\n\n")[0].splitlines()[1:]
    for line in lines:
        if not re.match(r" *\d", line):  # what it adds in words
            continue
        *numbers, kernel = line.replace(" %", "%").split()
        yield kernel, dict(zip(COLUMNS, numbers))


def find_pipeline(root, name):
    """A file, or the name of an example."""
    path = pathlib.Path(name)
    example = pathlib.Path(root) / f"examples/{name}/{name}.piko.cpp"
    return path if path.exists() or not example.exists() else example
