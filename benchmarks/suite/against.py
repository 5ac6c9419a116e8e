# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What takes longer than in an earlier run, by the CSV files of both."""

import csv
import math
import os
import statistics
import sys


def read_csv(file):
    try:
        with open(file, newline="") as stream:
            return list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        sys.exit(f"bench: --against: {file}: {error}")


def find_medians(section, records):
    """By what was measured; times of nothing are left out."""
    times = {}
    for record in records:
        for column in section.times:
            what = (*(str(record[key]) for key in section.keys), column)
            times.setdefault(what, []).append(float(record[column]))
    medians = {what: statistics.median(all) for what, all in times.items()}
    return {what: median for what, median in medians.items() if median > 0}


def compare(section, folder):
    """How many times as long each measurement takes as the one of that name in
    the folder, whose file may lack some; none if it has none of the section."""
    file = f"{folder}/{section.name}.csv"
    if not section.times or not os.path.exists(file):
        return {}
    try:
        before = find_medians(section, read_csv(file))
    except (KeyError, TypeError, ValueError):
        sys.exit(f"bench: --against: {file}: expected the columns "
                 f"{', '.join(section.keys + section.times)}, with numbers in "
                 f"{', '.join(section.times)}")
    now = find_medians(section, section.records)
    return {what: now[what] / before[what] for what in now if what in before}


def report(sections, folder, tolerance, print_table):
    """Prints what takes longer by more than the tolerance, a part of what it
    took, and returns how much that is."""
    slower = 0
    for section in sections:
        ratios = compare(section, folder)
        if not ratios:
            continue
        mean = math.exp(statistics.fmean(map(math.log, ratios.values())))
        print(f"\n{section.title}, against {folder}: {len(ratios)} times, "
              f"{mean:.2f} of before in the geometric mean")
        worse = sorted(((ratio, what) for what, ratio in ratios.items()
                        if ratio > 1 + tolerance), reverse=True)
        slower += len(worse)
        if worse:
            print_table([*section.keys, "time", "of before"],
                        [[*what, f"{ratio:.2f}"] for ratio, what in worse])
    return slower
