# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Takes a module down pass by pass with piko-opt; what piko-render makes of it
after each is the same picture."""

import json
import pathlib
import subprocess
import sys

module, scene = sys.argv[1:]

IN_PIPELINE = """
    order-stages pre-schedule infer-directives fuse-stages test-early own-pixels
    eliminate-schedules form-kernels fuse-kernels form-program form-strips
    form-work defer-shading form-tiles form-units split-loops prefetch""".split()
STEPS = [f"piko.pipeline(piko-{name})" for name in IN_PIPELINE]
STEPS.insert(5, "piko-prune")
# Where tiles are does not show.
STEPS += ["piko.pipeline(convert-piko-to-scf{private-tiles=true})"]
STEPS += [f"piko.pipeline(piko-{name})"
          for name in ("lockstep", "plan-vectors", "vectorize")]
STEPS += ["piko.pipeline(convert-piko-to-openmp)", "convert-piko-to-llvm"]
STEPS += ["convert-scf-to-cf-in-reverse,convert-vector-to-llvm,convert-math-to-llvm"]
STEPS += ["convert-ub-to-llvm,convert-openmp-to-llvm"]
STEPS += ["reconcile-unrealized-casts"]


def draw(*options):
    size = "--width 203 --height 155 --warmup 0 --frames 1 --json".split()
    command = ["piko-render", module, scene, "--no-cache", *size, *options]
    return json.loads(subprocess.check_output(command))["image_hash"]


expected = draw()
text = pathlib.Path(module).read_bytes()
for step in STEPS:
    passes = f"--pass-pipeline=builtin.module({step})"
    result = subprocess.run(["piko-opt", module, passes], capture_output=True)
    assert result.returncode == 0, result.stderr.decode()
    if result.stdout == text:
        continue  # and the same picture
    text = result.stdout
    pathlib.Path(module).write_bytes(text)
    picture = draw("-O0")  # what LLVM makes of it is not what this is about
    assert picture == expected, f"{step}: {picture} instead of {expected}"
