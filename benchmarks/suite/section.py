# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What a part of the suite gives: a table, the numbers after it, a chart."""

import statistics
from dataclasses import dataclass, field
from typing import Callable

from charts import COLORS


@dataclass
class Section:
    name: str
    title: str
    notes: list[str]
    head: list[str]
    rows: list[list[str]]
    records: list[dict]  # of the CSV file
    draw: Callable  # from pyplot to a figure
    # Columns of the CSV file that say what was measured, and those with times.
    keys: list[str] = field(default_factory=list)
    times: list[str] = field(default_factory=list)


class Rounds:
    """What was measured once in each round, in milliseconds."""

    def __init__(self, times):
        self.times = times
        self.median = statistics.median(times)

    def __str__(self):
        return f"{self.median:.3g} ms"

    def spread(self):
        """The part of the median by which rounds differ."""
        return (max(self.times) - min(self.times)) / self.median


def draw_groups(pyplot, names, groups, label, log=False):
    """Bars side by side for each name, or, as those have no foot on a
    logarithmic axis, dots: a list of heights by the group's name, where None is
    nothing."""
    figure, axes = pyplot.subplots(figsize=(max(6, 0.55 * len(names) + 2), 4.5))
    width = 0.8 / len(groups)
    for i, (group, heights) in enumerate(groups.items()):
        known = [(n, height) for n, height in enumerate(heights)
                 if height is not None]
        style = {"label": group, "color": COLORS[i % len(COLORS)]}
        if log:
            axes.plot(*zip(*known), "o", **style)
        else:
            shift = (i - (len(groups) - 1) / 2) * width
            axes.bar([n + shift for n, _ in known], [y for _, y in known],
                     width, **style)
    if log:
        axes.set_yscale("log")
    axes.set_xticks(range(len(names)), names, rotation=45, ha="right")
    axes.set_ylabel(label)
    axes.grid(axis="y", which="both", color="#dddddd")
    axes.set_axisbelow(True)
    figure.legend(loc="upper center", ncols=3, frameon=False)
    figure.tight_layout(rect=(0, 0, 1, 0.88))
    return figure
