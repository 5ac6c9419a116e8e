# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""The kernels of the examples: all lanes against one."""

import json
import shlex

from commands import call
from suite.section import Rounds, Section, draw_groups

KNOT = "examples/reyes/knot.bpt"
# The examples that piko-render draws, a pipeline of each, and the options that
# let it do what it is for.
PIPELINES = {
    "oit": ("Bins16", []),
    "raster": ("Fused", []),
    "raytrace": ("Raytracer", ["--ground"]),
    "reyes": ("Reyes", []),
    "shadow": ("Bins16", ["--ground"]),
    "visibility": ("Visibility", []),
}
ONE, ALL = "one lane", "all lanes"


def get_source(root, example):
    return f"{root}/examples/{example}/{example}.piko.cpp"


def render(options, example, pipe, more=()):
    """What piko-render says of frames on one thread."""
    scene = f"{options.root}/{KNOT}" if example == "reyes" else options.scene[0]
    command = [f"{options.bin}/piko-render", get_source(options.root, example),
               *shlex.split(scene), *PIPELINES[example][1], "--pipe", pipe,
               "--threads", "1", "--json", "--cpu", options.cpu, "--lights", "10"]
    for option in ("warmup", "frames", "seconds"):
        command += [f"--{option}", str(getattr(options, option))]
    return json.loads(call([*command, *more]))


def measure_once(options, example, lanes):
    """Milliseconds in each kernel, without what joins and waiting took."""
    report = render(options, example, PIPELINES[example][0],
                    ["--without", "vectorize"] if lanes == ONE else [])
    return {kernel["name"]: kernel["ms"] - kernel["join_ms"] - kernel["wait_ms"]
            for kernel in report["kernels"]}


def measure_kernels(options, example):
    """For each kernel that takes a hundredth of the frame, the times of one lane
    and of all."""
    runs = {ONE: [], ALL: []}
    for _ in range(options.rounds):
        for lanes, times in runs.items():
            times.append(measure_once(options, example, lanes))
    kernels = {name: {lanes: Rounds([run[name] for run in times])
                      for lanes, times in runs.items()}
               for name in runs[ALL][0]}
    least = sum(times[ALL].median for times in kernels.values()) / 100
    return {name: times for name, times in kernels.items()
            if times[ALL].median > least}


def measure(options):
    rows, records, gains = [], [], {}
    for example in options.examples:
        kernels = measure_kernels(options, example)
        for name, times in kernels.items():
            one, every = times[ONE], times[ALL]
            gains[f"{example} {name}"] = one.median / every.median
            rows.append([example, name, str(one), str(every),
                         f"{max(one.spread(), every.spread()):.0%}",
                         f"{one.median / every.median:.2f}"])
            records += [{"example": example, "kernel": name, "lanes": lanes,
                         "round": turn, "ms": ms}
                        for lanes, rounds in times.items()
                        for turn, ms in enumerate(rounds.times)]
    return Section(
        "kernels", "Kernels of the examples",
        ["One thread, 10 lights, a frame of 1024 x 768. One lane is all passes but "
         "piko-vectorize; LLVM still makes vectors. Kernels of less than a "
         "hundredth of a frame are left out.",
         "The last column says how many times as fast all lanes are as one."],
        ["example", "kernel", ONE, ALL, "spread", "over one lane"],
        rows, records,
        lambda pyplot: draw_groups(pyplot, list(gains),
                                   {"over one lane": list(gains.values())},
                                   "times as fast", log=True),
        keys=["example", "kernel", "lanes"], times=["ms"])
