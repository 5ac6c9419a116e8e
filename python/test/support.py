# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What the tests of the Python module share: a small picture of dots."""

import os
import pathlib
import subprocess
import sys

import numpy as np

import piko

HERE = pathlib.Path(__file__).resolve().parent
DOTS = HERE / "pipelines" / "dots.piko.cpp"
TABLE = """#include <piko.h>
constexpr int factor = piko::tunable("factor", 3, 5);
struct State { int offset; piko::Buffer<int> values; };
struct Set : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) { state().values[i] = factor * i + state().offset; }
};
struct Table : piko::Pipe<State> {
  Set set;
  Table() { source(set); }
};
#ifdef WARN
#warning mind the step
#endif
"""
COUNT = 100


def make_dots(dtype):
    generator = np.random.default_rng(1)
    dots = np.zeros(COUNT, dtype)
    dots["position"] = generator.random((COUNT, 2)) * (32, 16)
    dots["color"] = generator.random((COUNT, 3))
    dots["id"] = np.arange(COUNT)
    return dots


def make_pipe(**options):
    """Dots on 32 x 16 pixels, ready to run."""
    pipe = piko.Pipeline(DOTS, "Dots", domain=(32, 16), threads=2, **options)
    pipe["light"] = (1, 2, 3)
    pipe["weights"] = np.linspace(0, 1, COUNT, dtype="f4")
    pipe["tints"] = np.full((COUNT, 3), 0.25, "f4")
    pipe.feed("plot", make_dots(pipe.source("plot").dtype))
    return pipe


def draw(dots, weights, offset=0):
    """The picture that NumPy makes of them, with tints of 0.25 and lights 1, 2, 3."""
    colors, counts = np.zeros((16, 32, 3), "f4"), np.zeros((16, 32), "i4")
    for dot, weight in zip(dots, weights):
        x, y = dot["position"].astype(int)
        tint = np.float32(0.25) * np.array((1, 2, 3), "f4")
        colors[y, x] += weight * dot["color"] + tint
        counts[y, x] += 1
    return colors, counts


def run_python(code, *arguments, **environment):
    """Runs a program of Python's; how it ended."""
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        env={**os.environ, **environment},
        cwd=HERE,
        capture_output=True,
        text=True,
        timeout=100,
    )
