# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Piko: programmable graphics pipelines, compiled and run from Python.

    import numpy as np
    import piko

    pipe = piko.Pipeline("dots.piko.cpp", domain=(64, 64))
    dots = np.zeros(100, pipe.source("plot").dtype)
    dots["position"] = np.random.rand(100, 2) * 64
    dots["color"] = 1
    pipe.feed("plot", dots)
    pipe.run()
    picture = pipe["image"]["color"]  # (64, 64, 3), float32

docs/Python.md is the manual.
"""

try:
    from . import _core
except ImportError as error:
    raise ImportError(
        f"{error} (piko needs libraries of LLVM 22: on Debian, packages libmlir-22,"
        " libclang-cpp22 and libomp5-22)"
    ) from error
from ._arrays import DeviceArray
from ._compare import Comparison, Difference, compare
from ._compile import LEVELS, Object, Program, Tunable, compile, pipelines
from ._errors import CompileError, CompileWarning, Diagnostic, Error, RunError, Status
from ._pipeline import PROCESSOR, Array, Device, Pipeline, SourceInfo, devices
from ._speed_error import (
    Errors,
    SpeedError,
    SpeedErrorPoint,
    VariantError,
    pareto_front,
    speed_error,
)
from ._stats import KernelStats, Mapping, StageStats, Stats
from ._tune import TuneError, Tuned, tune

__version__ = _core.version()

__all__ = [
    "Array",
    "compare",
    "Comparison",
    "compile",
    "CompileError",
    "CompileWarning",
    "Device",
    "DeviceArray",
    "devices",
    "Diagnostic",
    "Difference",
    "Error",
    "Errors",
    "KernelStats",
    "LEVELS",
    "Mapping",
    "Object",
    "pareto_front",
    "Pipeline",
    "pipelines",
    "PROCESSOR",
    "Program",
    "RunError",
    "SourceInfo",
    "speed_error",
    "SpeedError",
    "SpeedErrorPoint",
    "StageStats",
    "Stats",
    "Status",
    "Tunable",
    "tune",
    "Tuned",
    "TuneError",
    "VariantError",
]
