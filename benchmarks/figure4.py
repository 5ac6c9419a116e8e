#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Figure 4 of the Piko paper: mappings of one rasterizer against each other.

  figure4.py [options] SCENE..     measures and draws
  figure4.py [options] --redraw    draws what has been measured

A SCENE is a file and, in the same word, what options of piko-render it needs:
'room.glb --eye 9 11 0 --at 9 0.3 -6.8'.

Renders every scene with the pipelines of examples/raster, with more and more
lights, on all threads, and with the fewest lights on one thread as well. A
measurement is a process of piko-render; pipelines take turns in each round.
All pipelines must draw the same image, or this ends with an error. Writes a row
for each measurement to OUT.csv and the charts to OUT.svg and OUT.png, and
prints tables in Markdown. Charts need Debian's python3-matplotlib.
"""

import argparse
import csv
import json
import os
import re
import shlex
import statistics
import sys

from charts import COLORS, find_pyplot
from commands import call, run_main
from outputs import save_figure, write_csv

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
RASTER = f"{ROOT}/examples/raster/raster.piko.cpp"
PIPES = ["Baseline", "FreePipe", "Binned", "BinnedFused", "Indexed", "Fused",
         "Tiled"]
# Title, pipelines, and the pipeline that they are relative to.
PANELS = [
    ("(a) FreePipe: one kernel", ["FreePipe"], "Baseline"),
    ("(b) Binned: bins of 8 x 8 pixels", ["Binned"], "Baseline"),
    ("(c) BinnedFused: two stages are one", ["BinnedFused"], "Binned"),
    ("(d) Vertices shaded once", ["Indexed", "Fused", "Tiled"], "Baseline"),
]
STYLES = [("-", "o"), ("--", "s"), (":", "^")]  # of the pipelines of a panel
NUMBERS = {
    "triangles": int, "lights": int, "threads": int, "round": int, "ms": float,
    "bin_bytes": int, "moved_bytes": int,
}
COLUMNS = ["scene", "pipe", *NUMBERS, "image_hash"]


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--redraw", action="store_true")
    parser.add_argument("--bin", default=f"{ROOT}/build/bin",
                        help="where piko-render and pikoc are")
    parser.add_argument("--out", default=f"{ROOT}/benchmarks/results/figure4",
                        help="the files' name without its end")
    parser.add_argument("--lights", nargs="+", type=int,
                        default=[1, 10, 100, 1000])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--warmup", type=int, default=2)
    parser.add_argument("--frames", type=int, default=11,
                        help="of each measurement, at most")
    parser.add_argument("--seconds", type=float, default=2,
                        help="that end a measurement that has 3 frames")
    arguments = parser.parse_args()
    if arguments.redraw == bool(arguments.scenes):
        parser.error("expected scenes, or --redraw without them")
    return arguments


def carried_records(arguments, pipe):
    """What lies between kernels: (stage, bytes) for each record that comes into
    the stage. A buffer with an element for each primitive of a source counts,
    because one kernel writes it and others read it."""
    text = call([f"{arguments.bin}/pikoc", RASTER, "--pipe", pipe,
                 "--emit=kernels"])
    record = r'@(?:"[^"]+"|\w+)'
    sizes = dict(re.findall(rf"piko\.record ({record}) .* size (\d+)", text))
    takes = dict(re.findall(rf"piko\.stage @(\w+) .* : ({record}) ->", text))
    edge = r"@\w+\[\d+\] -> @(\w+)"
    local = re.findall(rf"piko\.local_barrier {edge}", text)
    consumers = [stage for stage in re.findall(rf"piko\.edge {edge}", text)
                 if stage not in local]
    sources = re.findall(r"piko\.source @(\w+)", text)
    buffers = re.findall(rf"piko\.buffer @\w+ : ({record}) per_source (\d+)", text)
    carried = [(stage, takes[stage]) for stage in dict.fromkeys(consumers)]
    carried += [(sources[int(source)], element) for element, source in buffers]
    return [(stage, int(sizes[element])) for stage, element in carried]


def measure_once(arguments, scene, pipe, lights, threads, source=RASTER):
    command = [f"{arguments.bin}/piko-render", source, *shlex.split(scene)]
    for option in ["warmup", "frames", "seconds"]:
        command += [f"--{option}", str(getattr(arguments, option))]
    command += ["--pipe", pipe, "--lights", str(lights)]
    command += ["--threads", str(threads), "--json"]
    return json.loads(call(command))


def measure(arguments):
    """Writes all rows anew after each round."""
    carried = {pipe: carried_records(arguments, pipe) for pipe in PIPES}
    cases = [(lights, 0) for lights in arguments.lights]
    cases.insert(0, (min(arguments.lights), 1))
    rows, images = [], {}
    for turn in range(arguments.rounds):
        for scene in arguments.scenes:
            for lights, threads in cases:
                for pipe in PIPES:
                    run = measure_once(arguments, scene, pipe, lights, threads)
                    came = {s["name"]: s["in"] for s in run["stages"]}
                    moved = sum(came[s] * size for s, size in carried[pipe])
                    rows.append({
                        "scene": run["scene"], "pipe": pipe,
                        "triangles": run["tris"], "lights": lights,
                        "threads": run["threads"], "round": turn,
                        "ms": run["ms_median"],
                        "bin_bytes": int(run["peak_bin_bytes"]),
                        "moved_bytes": int(moved),
                        "image_hash": run["image_hash"],
                    })
                    row = rows[-1]
                    print(*row.values(), file=sys.stderr, flush=True)
                    first = images.setdefault((scene, lights), row)
                    if row["image_hash"] != first["image_hash"]:
                        sys.exit(f"figure4: expected the image of {first}, "
                                 f"but got {row}")
        write_csv(f"{arguments.out}.csv", rows, COLUMNS)


class Results:
    """Medians of rounds."""

    def __init__(self, rows):
        self.rows = rows
        self.scenes = self.values("scene")
        self.lights = sorted(self.values("lights"))
        self.threads = sorted(self.values("threads"))

    def values(self, column):
        return list(dict.fromkeys(row[column] for row in self.rows))

    def median(self, column, scene, pipe, lights, threads):
        return statistics.median(
            row[column]
            for row in self.rows
            if (row["scene"], row["pipe"]) == (scene, pipe)
            and (row["lights"], row["threads"]) == (lights, threads)
        )

    def ms(self, scene, pipe, lights, threads=None):
        threads = threads or self.threads[-1]
        return self.median("ms", scene, pipe, lights, threads)

    def ratio(self, scene, pipe, base, lights):
        return self.ms(scene, pipe, lights) / self.ms(scene, base, lights)

    def spread(self):
        """The greatest part of a median by which rounds of it differ."""
        rounds = {}
        for row in self.rows:
            key = row["scene"], row["pipe"], row["lights"], row["threads"]
            rounds.setdefault(key, []).append(row["ms"])
        return max((max(t) - min(t)) / statistics.median(t)
                   for t in rounds.values())

    def label(self, scene):
        triangles = next(r["triangles"] for r in self.rows if r["scene"] == scene)
        return f"{scene.split('.')[0]}, {triangles:,} triangles"


def count(n, noun):
    return f"{n} {noun}" + "s" * (n != 1)


def print_table(head, lines):
    print(f"\n| {' | '.join(head)} |")
    print("|---" * len(head) + "|")
    for line in lines:
        print(f"| {' | '.join(line)} |")


def print_scene(results, scene):
    fewest, most = results.lights[0], results.threads[-1]

    def relative(pipe, base, lights):
        return f"{results.ratio(scene, pipe, base, lights):.2f}"

    print(f"\n{results.label(scene)}, {count(most, 'thread')}: milliseconds "
          "and, in brackets, relative to Baseline")
    print_table(
        ["pipe", *(count(n, "light") for n in results.lights)],
        [[pipe] + [f"{results.ms(scene, pipe, n):.1f} "
                   f"({relative(pipe, 'Baseline', n)})" for n in results.lights]
         for pipe in PIPES])
    print("\nBinnedFused relative to Binned: " + ", ".join(
        relative("BinnedFused", "Binned", n) for n in results.lights) + ".")

    print(f"\n{results.label(scene)}, {count(fewest, 'light')}: milliseconds "
          "and megabytes")
    lines = []
    for pipe in PIPES:
        cells = [results.ms(scene, pipe, fewest, n) for n in results.threads]
        cells += [results.median(column, scene, pipe, fewest, most) / 1e6
                  for column in ("bin_bytes", "moved_bytes")]
        lines.append([pipe, *(f"{cell:.1f}" for cell in cells),
                      relative(pipe, "Baseline", fewest)])
    print_table(
        ["pipe", *(count(n, "thread") for n in results.threads),
         "peak of bins", "between kernels", "relative to Baseline"], lines)


def draw_panel(axes, results, title, pipes, base):
    for color, scene in zip(COLORS, results.scenes):
        for (dashes, marker), pipe in zip(STYLES, pipes):
            ratios = [results.ratio(scene, pipe, base, n) for n in results.lights]
            axes.plot(results.lights, ratios, dashes, marker=marker, color=color,
                      label=results.label(scene))
    if len(pipes) > 1:
        axes.legend([plain_line(*style) for style in STYLES], pipes,
                    loc="upper left", fontsize=9)
    axes.axhline(1, color="black", linewidth=1, linestyle=":")
    axes.set_title(title, fontsize=11)
    axes.set_xscale("log")
    axes.set_xticks(results.lights, [str(n) for n in results.lights])
    axes.minorticks_off()
    axes.set_xlabel("number of lights")
    axes.set_ylabel(f"frame time relative to {base}")
    axes.set_ylim(0, max(1.3, 1.1 * axes.dataLim.ymax))
    axes.grid(axis="y", color="#dddddd")
    axes.set_axisbelow(True)


def plain_line(dashes, marker):
    from matplotlib.lines import Line2D

    return Line2D([], [], linestyle=dashes, marker=marker, color="#666666")


def draw(plot, results, out):
    figure, axes = plot.subplots(2, 2, figsize=(9, 7.5))
    for panel, where in zip(PANELS, axes.flat):
        draw_panel(where, results, *panel)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="upper center",
                  ncols=2, frameon=False)
    figure.tight_layout(rect=(0, 0, 1, 1 - 0.02 - 0.015 * len(results.scenes)))
    save_figure(figure, f"{out}.svg")
    save_figure(figure, f"{out}.png", dpi=120)


def load_matplotlib():
    pyplot = find_pyplot()
    if not pyplot:
        sys.exit("figure4: charts need matplotlib (Debian's python3-matplotlib), "
                 f"which {sys.executable} does not have")
    return pyplot


def read_rows(name):
    with open(name, newline="") as file:
        return [
            {column: NUMBERS.get(column, str)(text) for column, text in row.items()}
            for row in csv.DictReader(file)
        ]


def main():
    arguments = parse_arguments()
    plot = load_matplotlib()  # asked for before the time is spent
    if not arguments.redraw:
        measure(arguments)
    results = Results(read_rows(f"{arguments.out}.csv"))
    for scene in results.scenes:
        print_scene(results, scene)
    print(f"\nRounds differ by at most {results.spread():.0%} of their median.")
    draw(plot, results, arguments.out)


if __name__ == "__main__":
    run_main(main)
