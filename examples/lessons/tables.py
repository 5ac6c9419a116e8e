#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Writes the tables that lessons feed to their pipelines (--check: are they these?)."""

import argparse
import colorsys
import math
import pathlib
import random
import sys

FOLDER = pathlib.Path(__file__).resolve().parent


def hue(part, value=1.0, saturation=1.0):
    return colorsys.hsv_to_rgb(part % 1, saturation, value)


def stars():
    """A galaxy of two arms in 192 x 144 pixels, denser and whiter to its middle."""
    draw = random.Random(3)
    while True:
        distance = 62 * draw.random() ** 1.3 + abs(draw.gauss(0, 3))
        arm = math.pi * draw.randrange(2)
        turn = arm + 2.2 * math.log(1 + distance / 6) + draw.gauss(0, 0.42)
        along, across = distance * math.cos(turn), 0.62 * distance * math.sin(turn)
        x, y = 96 + 1.3 * along, 72 + across - 0.42 * along
        warm = math.exp(-distance / 16)
        light = 0.35 + 0.65 * draw.random() ** 2
        young = draw.random() < 0.12
        color = ((1, 0.35, 0.55) if young else
                 (0.4 + 0.6 * warm, 0.6 + 0.25 * warm, 1 - 0.35 * warm))
        if 0 <= x < 192 and 0 <= y < 144:
            yield (f"{x:.1f}", f"{y:.1f}", *(f"{light * c:.2f}" for c in color))


def discs():
    """A few of all sizes, from one bin to many."""
    for x, y, radius, color in [
            (70, 64, 44, hue(0.58)), (164, 52, 26, hue(0.08)), (126, 132, 33, hue(0.9)),
            (218, 108, 30, hue(0.33)), (40, 150, 18, hue(0.13)), (200, 166, 12, hue(0.5)),
            (236, 24, 6, hue(0.0)), (88, 176, 5, hue(0.75))]:
        yield (x, y, radius, *(f"{c:.2f}" for c in color))


def petals(count=24):
    """A ring of discs; each lies on the one before it."""
    for i in range(count):
        turn = math.tau * i / count
        color = hue(i / count, 1, 0.85)
        yield (f"{128 + 62 * math.cos(turn):.2f}", f"{96 + 62 * math.sin(turn):.2f}", 28,
               *(f"{c:.2f}" for c in color))


def sites(columns=11, rows=8):
    """Places on a grid, each moved a little."""
    draw = random.Random(5)
    for row in range(rows):
        for column in range(columns):
            x = (column + 0.5 + draw.uniform(-0.42, 0.42)) * 192 / columns
            y = (row + 0.5 + draw.uniform(-0.42, 0.42)) * 144 / rows
            away = math.hypot(x - 96, y - 72) / 120
            color = hue(0.02 + 0.62 * away + draw.uniform(-0.05, 0.05),
                        draw.uniform(0.75, 1), draw.uniform(0.6, 0.85))
            yield (f"{x:.1f}", f"{y:.1f}", *(f"{c:.2f}" for c in color))


def hills(count=70):
    """An island: where its hills are, how wide and how high."""
    draw = random.Random(4)
    yield 104, 92, 96, "0.35"
    yield 168, 104, 80, "0.30"
    for _ in range(count):
        turn, away = math.tau * draw.random(), draw.random()
        radius = 14 + 34 * draw.random() ** 2
        yield (f"{130 + 84 * away * math.cos(turn):.1f}",
               f"{96 + 56 * away * math.sin(turn):.1f}", f"{radius:.1f}",
               f"{draw.uniform(-0.10, 0.16) * radius / 30:.3f}")


def rose(count=2400, layers=5):
    """Roses of seven petals, one in the other, in 192 x 144 pixels; a hue for each dot."""
    for i in range(count):
        turn, layer = math.tau * i / count, (i % layers + 1) / layers
        away = layer * (14 + 54 * abs(math.cos(3.5 * turn)))
        yield (f"{96 + away * math.cos(turn):.1f}", f"{72 + away * math.sin(turn):.1f}",
               f"{layer * abs(math.cos(3.5 * turn)):.3f}")


TABLES = {
    "01-dots/stars.csv": ("position.x,position.y,color.x,color.y,color.z", stars, 1500),
    "02-bins/discs.csv": ("center.x,center.y,radius,color.x,color.y,color.z", discs, None),
    "03-order/petals.csv": ("center.x,center.y,radius,color.x,color.y,color.z", petals,
                            None),
    "04-lists/sites.csv": ("position.x,position.y,color.x,color.y,color.z", sites, None),
    "05-waits/hills.csv": ("center.x,center.y,radius,height", hills, None),
    "12-mlir/rose.csv": ("position.x,position.y,hue", rose, None),
}


def write(names, lines, count):
    rows = [names]
    for _, line in zip(range(count), lines()) if count else enumerate(lines()):
        rows.append(",".join(map(str, line)))
    return "\n".join(rows) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true")
    args = parser.parse_args()
    faults = 0
    for name, table in TABLES.items():
        path, text = FOLDER / name, write(*table)
        if not args.check:
            path.write_text(text)
        elif not path.exists() or path.read_text() != text:
            print(f"{name}: expected what tables.py writes")
            faults += 1
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
