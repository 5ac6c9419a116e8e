# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""The pipelines of examples/raster against each other, with more and more lights:
what fusion, bins and an index buffer gain (figure 4 of the Piko paper)."""

import os
import shlex

from suite.raster import VISIBILITY, measure_pipe
from suite.section import Rounds, Section, draw_groups

# Which must not be slower than which, as it is the same with stages fused.
FUSED, APART = "BinnedFused", "Binned"


def find_pipes(options):
    return [pipe for pipe in options.pipes if pipe != VISIBILITY]


def measure_case(options, scene, lights):
    times = {pipe: [] for pipe in find_pipes(options)}
    for _ in range(options.rounds):
        for pipe in times:
            run = measure_pipe(options, scene, pipe, lights, options.threads[-1])
            times[pipe].append(run["ms_median"])
    return {pipe: Rounds(rounds) for pipe, rounds in times.items()}


def measure(options):
    pipes = find_pipes(options)
    rows, records, cases = [], [], {}
    for scene in options.scene:
        word = os.path.basename(shlex.split(scene)[0])
        for lights in options.lights:
            times = measure_case(options, scene, lights)
            cases[f"{word}, {lights} light{'s' * (lights != 1)}"] = times
            both = FUSED in times and APART in times
            rows.append([word, str(lights),
                         *(f"{t} ({t.spread():.0%})" for t in times.values()),
                         f"{times[FUSED].median / times[APART].median:.2f}"
                         if both else ""])
            records += [{"scene": word, "lights": lights, "pipe": pipe,
                         "round": turn, "ms": ms}
                        for pipe, rounds in times.items()
                        for turn, ms in enumerate(rounds.times)]
    return Section(
        "fusion", "Pipelines of one rasterizer",
        [f"A frame of 1024 x 768 on {options.threads[-1]} threads, and in brackets "
         f"by how much rounds differ. The last column is {FUSED}, whose shader is "
         f"in the rasterizer's kernel, over {APART}."],
        ["scene", "lights", *(f"{pipe} (spread)" for pipe in pipes),
         f"{FUSED} / {APART}"],
        rows, records,
        lambda pyplot: draw_groups(
            pyplot, list(cases),
            {pipe: [times[pipe].median for times in cases.values()]
             for pipe in pipes}, "milliseconds", log=True),
        keys=["scene", "lights", "pipe"], times=["ms"])
