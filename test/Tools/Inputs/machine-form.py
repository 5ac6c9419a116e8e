# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Walks all pipelines of all examples: their machine form prints, parses and
verifies, holds nothing that is the CPU's, and is what code is made of."""

import multiprocessing.pool
import pathlib
import re
import subprocess
import sys


def run(*command, text=None):
    result = subprocess.run(
        command, input=text, capture_output=True, text=True
    )
    assert result.returncode == 0, (command, result.stderr)
    return result.stdout


def walk(example, pipe):
    machine = run("pikoc", str(example), "--pipe", pipe, "--emit=machine")
    kernels = re.findall(r"piko\.kernel @(\w+)", machine)
    work = re.findall(r"^ +piko\.(?:bins|items) of .*$", machine, re.M)
    outer = [line for line in work if line.startswith(" " * 6 + "piko.")]
    schedules = len(re.findall(r"piko\.begin_schedule", machine))
    assert kernels and len(outer) + schedules == len(kernels), (pipe, outer)
    target = re.findall(r"piko\.cpu\.\w+|scf\.forall|memref\.view", machine)
    assert not target, (pipe, target)
    assert "piko.program" in machine, pipe
    assert run("piko-opt", text=machine) == machine, pipe
    ir = run("pikoc", "-", "--emit=llvmir", text=machine)
    assert f"@{pipe}.run(" in ir, pipe
    return len(kernels)


examples = sorted(pathlib.Path(sys.argv[1]).glob("*/*.piko.cpp"))
pairs = [
    (example, pipe)
    for example in examples
    for pipe in run("pikoc", str(example), "--list-pipes").split()
]
with multiprocessing.pool.ThreadPool(2) as pool:
    counts = pool.starmap(walk, pairs)
print(f"{len(pairs)} pipelines, {sum(counts)} kernels")
