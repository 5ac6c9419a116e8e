# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What two builds took in turn, and whether the new one lost.

A round has a time of each build, one right after the other, so that a ratio of
the two is free of what changes slowly. Ratios are judged by a sign test, which
takes no noise to have any form: a time is *slower* if so many rounds lost more
than the tolerance as chance would give once in a thousand if half of them did, and
*as fast* if so few did as chance would give once in twenty. Everything else is
*open*, and another round may tell.
"""

import math
import statistics
from dataclasses import dataclass

from suite.section import Rounds

BASE, NEW = BUILDS = "base", "new"
FRAME = "frame"
SLOWER, FASTER, AS_FAST, OPEN = "slower", "faster", "as fast", "open"
# The greatest probabilities that are none.
LOST_BY_CHANCE, HELD_BY_CHANCE = 1e-3, 5e-2
CLOCK = 1e-6  # milliseconds that a clock cannot tell from none


def find_chance(count, rounds):
    """That so many rounds or more are above their median."""
    return sum(math.comb(rounds, k) for k in range(count, rounds + 1)) / 2**rounds


@dataclass
class Comparison:
    """A kernel, several short ones, or a frame; times by round."""
    unit: str
    name: str
    base: list[float]
    new: list[float]

    @property
    def ratios(self):
        return [new / max(base, CLOCK) for base, new in zip(self.base, self.new)]

    @property
    def ratio(self):
        return statistics.median(self.ratios)

    def spread(self):
        """The median of how far ratios are from their median."""
        return statistics.median(abs(it - self.ratio) for it in self.ratios)

    def judge(self, tolerance):
        rounds = len(self.ratios)
        lost = sum(it > 1 + tolerance for it in self.ratios)
        if find_chance(lost, rounds) <= LOST_BY_CHANCE:
            return SLOWER
        if find_chance(rounds - lost, rounds) > HELD_BY_CHANCE:
            return OPEN
        gained = sum(it * (1 + tolerance) < 1 for it in self.ratios)
        return FASTER if find_chance(gained, rounds) <= LOST_BY_CHANCE else AS_FAST


@dataclass
class Judged:
    """What can be said of a unit, and what cannot."""
    comparisons: list[Comparison]
    too_short: list[str]
    only_in: dict[str, list[str]]


def find_median(runs, name):
    return statistics.median(run[name] for run in runs)


def compare(unit, runs, shortest):
    """Of a unit's runs by build, each the milliseconds of its kernels and of the
    frame by name. Kernels that take less than the shortest that can be measured
    are summed; if that is too short as well, they are none."""
    names = {build: list(runs[build][0]) for build in BUILDS}
    both = [name for name in names[BASE] if name in names[NEW]]
    medians = {name: max(find_median(runs[build], name) for build in BUILDS)
               for name in both}
    short = [name for name in both if medians[name] < shortest and name != FRAME]
    parts = {name: [name] for name in both if medians[name] >= shortest}
    if short:
        parts[f"{len(short)} short: {', '.join(short)}"] = short
    comparisons, too_short = [], []
    for name, members in parts.items():
        times = {build: [sum(run[member] for member in members)
                         for run in runs[build]] for build in BUILDS}
        if max(map(statistics.median, times.values())) < shortest:
            too_short += [f"{unit}/{member}" for member in members]
        else:
            comparisons.append(Comparison(unit, name, times[BASE], times[NEW]))
    return Judged(
        comparisons, too_short,
        {BASE: [f"{unit}/{name}" for name in names[BASE] if name not in both],
         NEW: [f"{unit}/{name}" for name in names[NEW] if name not in both]})


def is_decided(judged, tolerance):
    return all(it.judge(tolerance) != OPEN for it in judged.comparisons)


def list_row(comparison, tolerance):
    base, new = Rounds(comparison.base), Rounds(comparison.new)
    return [f"{comparison.unit}/{comparison.name}", str(base), str(new),
            f"{comparison.ratio:.3f}", f"{comparison.spread():.3f}",
            str(len(comparison.ratios)), comparison.judge(tolerance)]


def report(judged, tolerance, print_table):
    """Prints all that was found; returns how much is slower."""
    comparisons = [it for unit in judged for it in unit.comparisons]
    verdicts = {it: [row for row in comparisons if row.judge(tolerance) == it]
                for it in (SLOWER, OPEN, FASTER, AS_FAST)}
    print_table(["time", "before", "now", "ratio", "spread", "rounds", ""],
                [list_row(it, tolerance) for it in comparisons])
    for build, title in ((BASE, "only before"), (NEW, "only now")):
        if names := [name for unit in judged for name in unit.only_in[build]]:
            print(f"\n{title}: {', '.join(names)}")
    if names := [name for unit in judged for name in unit.too_short]:
        print(f"\ntoo short to be measured: {', '.join(names)}")
    for verdict in (FASTER, OPEN, SLOWER):
        if rows := verdicts[verdict]:
            print(f"\n{verdict}:")
            for it in sorted(rows, key=lambda it: it.ratio, reverse=True):
                print(f"  {it.ratio:.3f} {it.unit}/{it.name}")
    if frames := [it.ratio for it in comparisons if it.name == FRAME]:
        print(f"\n{len(comparisons)} times, of which {len(frames)} of frames: "
              f"{statistics.geometric_mean(frames):.3f} of before in the geometric "
              f"mean; {len(verdicts[SLOWER])} slower, {len(verdicts[FASTER])} "
              f"faster, {len(verdicts[OPEN])} open")
    return len(verdicts[SLOWER])
