#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Counts the work of a frame of each example beside the least that it needs.

For each example and scene, as `piko-render --counters` has them: the calls of a
stage for each element that it or a stage after it writes, the iterations of a loop
for each emission or update in it, the lanes of vectors for each that does
something, and the largest waste. Writes Markdown; --csv writes all numbers.
"""

import argparse
import json
import os

from commands import call, run_main
from outputs import write_csv

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
MESHES = ["/usr/share/glmark2/models/bunny.obj",
          "/usr/share/glmark2/models/horse.3ds",
          "/usr/share/glmark2/models/cat.3ds"]
PATCHES = ["examples/reyes/knot.bpt"]
# Of each example that draws a scene the pipeline that its text commends.
PIPES = {"raster": "Fused", "visibility": "Visibility", "raytrace": "Raytracer",
         "shadow": "Bins32", "oit": "Bins32", "reyes": "Reyes"}
FIELDS = ["example", "scene", "kind", "name", "done", "needed", "ratio"]


def parse_options():
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE",
                        help="meshes and .bpt patches "
                             f"({', '.join(MESHES + PATCHES)})")
    parser.add_argument("--examples", nargs="+", choices=PIPES, metavar="NAME",
                        default=list(PIPES), help=f"of {', '.join(PIPES)}")
    parser.add_argument("--bin", default=f"{ROOT}/build/bin",
                        help="where the tools are")
    parser.add_argument("--frames", type=int, default=5)
    parser.add_argument("--csv", metavar="FILE")
    options, options.others = parser.parse_known_args()
    options.scenes = options.scenes or MESHES + PATCHES
    return options


def count(options, example, scene):
    """What piko-render reports of an example and a scene."""
    source = f"{ROOT}/examples/{example}/{example}.piko.cpp"
    text = call([f"{options.bin}/piko-render", source,
                 scene if os.path.isabs(scene) else f"{ROOT}/{scene}", "--pipe",
                 PIPES[example], "--frames", str(options.frames), "--counters", "--json",
                 *options.others])
    return json.loads(text)


def ratios(work):
    """(kind, name, done, needed) of all that is counted."""
    for stage in work["stages"]:
        yield "calls", stage["name"], stage["calls"], stage["least"]
    for loop in work["loops"]:
        if loop["effects"]:
            place = os.path.basename(loop["place"])
            yield ("iterations", f"{loop['stage']} ({place})", loop["iterations"],
                   loop["effects"])
    for kernel in work["kernels"]:
        if kernel["lanes"]:
            yield ("lanes", kernel["name"], kernel["lanes"],
                   kernel["active_lanes"])


def worst(rows, kind):
    """The row of a kind with the largest ratio, as text."""
    found = [row for row in rows if row["kind"] == kind]
    if not found:
        return "-"
    row = max(found, key=lambda row: row["ratio"])
    return f"{row['ratio']:.2f} {row['name']}"


def main():
    options = parse_options()
    print("| example | scene | ms | calls for each element written | "
          "iterations for each effect | lanes for each that is used | "
          "largest waste |\n|---|---|---|---|---|---|---|")
    rows = []
    for example in options.examples:
        for scene in options.scenes:
            if scene.endswith(".bpt") != (example == "reyes"):
                continue
            report = count(options, example, scene)
            name = os.path.splitext(os.path.basename(scene))[0]
            found = [dict(zip(FIELDS, (example, name, *ratio,
                                       round(ratio[2] / max(1, ratio[3]), 3))))
                     for ratio in ratios(report["work"])]
            rows += found
            waste = report["wastes"][0] if report["wastes"] else None
            print(
                f"| {example} | {name} | {report['ms_median']:.2f} | "
                + " | ".join(worst(found, kind)
                             for kind in ("calls", "iterations", "lanes"))
                + " | " + (f"{waste['ms']:.2f} ms: {waste['what']}".replace(
                    f"{ROOT}/", "")
                           if waste else "-") + " |", flush=True)
    if options.csv:
        write_csv(options.csv, rows, FIELDS)


if __name__ == "__main__":
    run_main(main)
