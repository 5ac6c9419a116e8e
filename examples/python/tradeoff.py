#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Speed against error of the Julia sets of lesson 10, from Python.

    tradeoff.py numbers.piko.cpp julia.csv points.csv [chart.svg]

Measures what precision and steps cost, prints a line for each variant, and writes the
points and, where matplotlib is installed, a chart."""

from __future__ import annotations

import sys
from typing import Any, Dict

import numpy as np

import piko

VARIANTS: Dict[str, Dict[str, Any]] = {
    "Strict": {},
    "Contracted": {"tunables": {"numbers": "Contracted"}},
    "Relaxed": {"tunables": {"numbers": "Relaxed"}},
    "24 steps": {"tunables": {"steps": 24}},
    "24 steps, Relaxed": {"tunables": {"steps": 24, "numbers": "Relaxed"}},
}


def main() -> None:
    if len(sys.argv) not in (4, 5):
        raise SystemExit(__doc__)
    table = np.loadtxt(sys.argv[2], delimiter=",", skiprows=1, ndmin=2)

    def feed(pipe: piko.Pipeline) -> None:
        sets = np.zeros(len(table), pipe.source("iterate").dtype)
        sets["lo"], sets["hi"], sets["c"] = table[:, :2], table[:, 2:4], table[:, 4:]
        pipe.feed("iterate", sets)

    chart = piko.speed_error(sys.argv[1], VARIANTS, setup=feed, domain=(192, 144))
    for point in chart.points:
        mark = "  on the front" if point.front else ""
        print(
            f"{point.variant:18} {point.ms:7.3f} ms, rms {point.errors.rms:.3g},"
            f" FLIP {point.errors.flip:.3g}{mark}"
        )
    chart.write_csv(sys.argv[3])
    if len(sys.argv) == 5:
        chart.draw(sys.argv[4])


if __name__ == "__main__":
    try:
        main()
    except (ImportError, OSError, ValueError, piko.Error) as error:
        raise SystemExit(f"tradeoff.py: error: {error}") from None
