# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Times of frames: measured on a card, or estimated from what the driver for tests
counts."""

import json
import math
import os
import shlex
import statistics
from dataclasses import dataclass, field

from commands import call
from figure4 import ROOT
from gpu_model import counting
from gpu_model.model import estimate_frame
from suite.section import Rounds

RASTER, VISIBILITY = "raster", "visibility"


@dataclass
class Timing:
    ms: float  # the median of rounds, or of an estimate's bounds the geometric mean
    kernels: dict  # milliseconds by name
    image_hash: str
    triangles: int
    rounds: list = field(default_factory=list)
    least: float | None = None  # of an estimate
    most: float | None = None

    def __str__(self):
        if self.least is None:
            return str(Rounds(self.rounds))
        return f"{self.least:.3g} to {self.most:.3g} ms"

    def as_record(self):
        return {"ms": self.ms, "least_ms": self.least or "", "most_ms": self.most or "",
                "image_hash": self.image_hash}


def source_of(example):
    return f"{ROOT}/examples/{example}/{example}.piko.cpp"


def name_scene(scene):
    return os.path.basename(shlex.split(scene)[0])


class Card:
    """What NVIDIA's driver runs."""
    estimated = False

    def __init__(self, options):
        self.options = options
        self.described = "measured on " + (find_card() or "the device")

    def run(self, example, pipe, scene, lights):
        options = self.options
        command = [f"{options.bin}/piko-render", source_of(example),
                   *shlex.split(scene), "--pipe", pipe, "--target", "cuda",
                   "--lights", str(lights), "--width", str(options.width),
                   "--height", str(options.height), "--json", "--kernel-times"]
        for name in ("warmup", "frames", "seconds"):
            command += [f"--{name}", str(getattr(options, name))]
        return json.loads(call(command).strip().split("\n")[-1])

    def time_all(self, cases, scene, lights, others=None):
        """Timings of cases, (example, pipeline), and rounds of other things that are
        timed, by name; all take turns."""
        runs = {case: [] for case in cases}
        times = {name: [] for name in others or {}}
        for _ in range(self.options.rounds):
            for case, own in runs.items():
                own.append(self.run(*case, scene, lights))
            for name, measure in (others or {}).items():
                times[name].append(measure())
        return ({case: make_timing(case, own) for case, own in runs.items()},
                {name: Rounds(rounds) for name, rounds in times.items()})

    def rerun(self, example, pipe, scene, turn):
        return self.run(example, pipe, scene, 1)["image_hash"]


def make_timing(case, runs):
    """Of rounds of a case. What a kernel takes is without the joins before it."""
    hashes = {run["image_hash"] for run in runs}
    if len(hashes) > 1:
        raise ValueError(f"{case[1]}: expected one image of all rounds, but got "
                         f"{len(hashes)}")
    kernels = {}
    for run in runs:
        for kernel in run["kernels"]:
            kernels.setdefault(kernel["name"], []).append(
                kernel["ms"] - kernel["join_ms"])
    rounds = [run["ms_median"] for run in runs]
    return Timing(statistics.median(rounds),
                  {name: statistics.median(ms) for name, ms in kernels.items()},
                  hashes.pop(), runs[0]["tris"], rounds)


class Estimate:
    """What a chip would take, without it."""
    estimated = True

    def __init__(self, options, chip):
        self.options, self.chip = options, chip
        self.described = f"estimated for {chip.name}, and not measured"

    def time_all(self, cases, scene, lights, others=None):
        """As of a card; others are measured all the same."""
        return ({case: self.time(*case, scene, lights) for case in cases},
                {name: Rounds([measure() for _ in range(self.options.rounds)])
                 for name, measure in (others or {}).items()})

    def time(self, example, pipe, scene, lights):
        run, report = counting.count_frame(
            self.options, source_of(example), pipe, scene, self.chip, lights)
        frame = estimate_frame(report, self.chip)
        return Timing(math.sqrt(frame.least_ms * frame.most_ms),
                      {name: math.sqrt(it.least_ms * it.most_ms)
                       for name, it in frame.kernels.items()},
                      run["image_hash"], run["tris"], [], frame.least_ms,
                      frame.most_ms)

    def rerun(self, example, pipe, scene, turn):
        """In another order of blocks, warps and lanes each time."""
        os.environ["PIKO_TEST_DRIVER_SEED"] = str(turn)
        try:
            run, _ = counting.count_frame(self.options, source_of(example), pipe,
                                          scene, self.chip)
        finally:
            del os.environ["PIKO_TEST_DRIVER_SEED"]
        return run["image_hash"]


def find_card():
    """The name of the card that a frame would run on; empty if there is none."""
    if not os.path.exists("/dev/nvidiactl"):
        return ""
    try:
        lines = call(["nvidia-smi", "--query-gpu=name,driver_version,clocks.max.sm",
                      "--format=csv,noheader"]).splitlines()
    except OSError:
        return "a card that nvidia-smi is not there to name"
    return lines[int(os.environ.get("PIKO_CUDA_DEVICE", "0"))]
