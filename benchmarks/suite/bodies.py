# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Bodies of phases: all lanes against one, and against C++ compilers."""

import shutil
from concurrent.futures import ThreadPoolExecutor

import bodies
from suite.section import Rounds, Section, draw_groups


def find_references(options):
    """The C++ compilers that are installed, of those that are asked for."""
    return [name for name in options.references
            if shutil.which(bodies.REFERENCES[name][0])]


def build(options, names, references):
    with ThreadPoolExecutor(options.jobs) as pool:
        jobs = [pool.submit(bodies.build_compiled, options, body)
                for body in names]
        jobs += [pool.submit(bodies.build_reference, options, body, reference)
                 for body in names for reference in references]
        for job in jobs:
            job.result()


def measure(options):
    references = find_references(options)
    build(options, options.bodies, references)
    builds = [*bodies.COMPILED, *references]
    rows, records, gains = [], [], {}
    for body in options.bodies:
        times = {name: Rounds(rounds) for name, rounds in
                 bodies.measure_rounds(options, body, builds).items()}
        one, all_lanes = times["one lane"], times["default"]
        gains[body] = {name: rounds.median / all_lanes.median
                       for name, rounds in times.items() if name != "default"}
        rows.append([body, str(one), str(all_lanes),
                     f"{max(one.spread(), all_lanes.spread()):.0%}",
                     *(f"{gain:.2f}" for gain in gains[body].values())])
        records += [{"body": body, "build": name, "round": turn, "ms": ms}
                    for name, rounds in times.items()
                    for turn, ms in enumerate(rounds.times)]
    titles = [name for name in builds if name != "default"]
    return Section(
        "bodies", "Bodies of phases",
        ["One thread. A round is the fastest warm frame; medians of "
         f"{options.rounds} rounds. All builds give the same bits.",
         "The last columns say how many times as fast all lanes are as one "
         "without any vectors (scalar), as one where LLVM makes vectors of "
         "inner loops, and as the reference executor by these compilers."],
        ["body", "one lane", "all lanes", "spread",
         *(f"over {title}" for title in titles)],
        rows, records,
        lambda pyplot: draw_groups(
            pyplot, list(gains),
            {f"over {name}": [gain[name] for gain in gains.values()]
             for name in titles}, "times as fast", log=True),
        keys=["body", "build"], times=["ms"])
