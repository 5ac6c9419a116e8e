# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What is measured of a build: pipelines of the examples and benchmarks' bodies."""

from dataclasses import dataclass
from typing import Callable

import bodies
from commands import call
from speed_gate.judge import FRAME
from suite import kernels

# As it is compiled where nothing is said.
DEFAULT = {"default": bodies.COMPILED["default"]}


@dataclass(frozen=True)
class Unit:
    name: str
    prepare: Callable  # compiles what a build needs for it
    measure: Callable  # from a build to milliseconds by name


def list_pipes(build, example):
    return call([f"{build.bin}/pikoc", "--list-pipes",
                 kernels.get_source(build.root, example)]).split()


def measure_pipe(build, example, pipe):
    """A frame's milliseconds and those of its kernels, joins included."""
    report = kernels.render(build, example, pipe)
    return {FRAME: report["ms_median"],
            **{it["name"]: it["ms"] - it["wait_ms"] for it in report["kernels"]}}


def measure_body(build, body):
    """The fewest milliseconds of a warm frame, of the processor's time."""
    program = bodies.get_program(build, body, "default")
    return {FRAME: float(call([program, str(build.seconds)]).split()[1])}


def make_pipe(example, pipe):
    def prepare(build):
        measure_pipe(build.once(), example, pipe)

    return Unit(f"{example}/{pipe}", prepare,
                lambda build: measure_pipe(build, example, pipe))


def make_body(body):
    return Unit(f"bodies/{body}",
                lambda build: bodies.build_compiled(build, body, DEFAULT, build.root),
                lambda build: measure_body(build, body))


def list_units(build, examples, names):
    """By name; the bodies are those of the names, or all."""
    units = [make_pipe(example, pipe) for example in examples
             for pipe in list_pipes(build, example)]
    units += [make_body(body) for body in bodies.find_bodies(build.root)
              if names is None or body in names]
    return {unit.name: unit for unit in units}
