#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Stands in for pikoc and piko-render of the tree before a change or after it,
whose folder's name says which. Times are planted, and noise is pseudo-random: each
run draws other numbers, but those of a run are always the same."""

import json
import os
import random
import sys

TREE = sys.argv[0].split("/")[-4]
IS_NEW = TREE == "new"
PIPES = ["Steady", "Lost", "Gained", "Added" if IS_NEW else "Removed"]
# Milliseconds before the change, and after it; none where there is no kernel.
KERNELS = {
    "Steady": {"same": (1, 1), "old": (1, None), "young": (None, 1),
               "tiny": (0.001, 0.001)},
    "Lost": {"same": (1, 1), "lost": (0.2, 0.23), "short": (0.015, 0.015),
             "shorter": (0.010, 0.016)},
    "Gained": {"same": (2, 2), "gained": (1, 0.8)},
    "Added": {"same": (1, 1)}, "Removed": {"same": (1, 1)},
}


def next_number(pipe):
    """How often this pipeline was run."""
    name = f"{TREE}.{pipe}.count"
    number = 0
    if os.path.exists(name):
        with open(name) as file:
            number = int(file.read())
    with open(name, "w") as file:
        file.write(str(number + 1))
    return number


def render(pipe):
    with open("order.log", "a") as file:
        print(pipe, TREE, file=file)
    noise = random.Random(f"{TREE} {pipe} {next_number(pipe)}")
    kernels = []
    for name, times in KERNELS[pipe].items():
        if (ms := times[IS_NEW]) is not None:
            ms *= noise.gauss(1, 0.01) * (2 if noise.random() < 0.05 else 1)
            kernels.append({"name": name, "ms": ms + 0.5, "wait_ms": 0.5,
                            "join_ms": 0, "something": ["new"]})
    frame = sum(it["ms"] - it["wait_ms"] for it in kernels)
    print(json.dumps({"ms_median": frame, "kernels": kernels}))


if sys.argv[0].endswith("pikoc"):
    print("\n".join(PIPES))
else:
    render(sys.argv[sys.argv.index("--pipe") + 1])
