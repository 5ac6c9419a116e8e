#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Time against error for what a pipeline leaves to its user.

  speed-error.py [options] [SCENE..]

A SCENE is a file and, in the same word, what options of piko-render it needs.
Measures each setting of each choice (--list) on each scene that has what it
draws, meshes or patches; settings take turns in each round. Writes OUT/points.csv,
OUT/CHOICE.svg and .png where Debian's python3-matplotlib is installed,
OUT/summary.md, which settings are on the Pareto front, and OUT/index.html, a page
that needs no network.
"""

import argparse
import datetime
import os
import shlex
import statistics
import sys

from charts import find_pyplot
from outputs import write_csv
from progress import Progress
from speed_error import draw, failures, page, summary
from speed_error.choices import CHOICES
from speed_error.measure import Measurer, Scene
from suite.page import find_processor
from commands import run_main

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SCENES = ["/usr/share/glmark2/models/bunny.obj",
          "/usr/share/glmark2/models/horse.3ds", "examples/reyes/knot.bpt"]


def parse_options():
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE",
                        help=f"({', '.join(SCENES)})")
    parser.add_argument("--choices", nargs="+", choices=CHOICES,
                        metavar="CHOICE",
                        help="(all; with --quick those that have quick settings)")
    parser.add_argument("--list", action="store_true",
                        help="print the choices and their settings")
    parser.add_argument("--out", default=f"{ROOT}/build/charts",
                        metavar="FOLDER", help="(build/charts)")
    parser.add_argument("--bin", default=f"{ROOT}/build/bin",
                        help="where the tools are")
    parser.add_argument("--modes", nargs="+", metavar="MODE",
                        help="failure modes (all)")
    parser.add_argument("--quick", action="store_true",
                        help="one scene of each kind, a quarter of the pixels, "
                             "fewer rounds and settings")
    parser.add_argument("--rounds", type=int)
    parser.add_argument("--frames", type=int, help="of a round, at most")
    parser.add_argument("--seconds", type=float, help="of a round, about")
    parser.add_argument("--width", type=int, help="(640)")
    parser.add_argument("--height", type=int, help="(480)")
    parser.add_argument("--threads", type=int, default=0, help="(0: all)")
    options = parser.parse_args()
    quick = options.quick
    options.out = os.path.abspath(options.out)
    options.bin = os.path.abspath(options.bin)
    for name, least, usual in (("rounds", 2, 5), ("frames", 5, 15),
                               ("seconds", 0.1, 0.3), ("width", 320, 640),
                               ("height", 240, 480)):
        if getattr(options, name) is None:
            setattr(options, name, least if quick else usual)
    names = options.choices or [name for name, choice in CHOICES.items()
                                if not quick or choice.is_quick()]
    options.choices = [CHOICES[name].quickly() if quick else CHOICES[name]
                       for name in names]
    scenes = SCENES[::2] if quick else SCENES
    try:
        options.scenes = [Scene.parse(s, ROOT)
                          for s in options.scenes or scenes]
    except ValueError as error:
        parser.error(str(error))
    for name in ("rounds", "frames", "width", "height"):
        if getattr(options, name) < 1:
            parser.error(f"--{name}: expected at least 1")
    return options


def list_choices():
    for choice in CHOICES.values():
        print(f"{choice.name}: {', '.join(s.name for s in choice.settings)}")


def describe_price(choice, points):
    """What the default costs, against the fastest setting of the same error."""
    prices = []
    for scene in dict.fromkeys(p.scene for p in points):
        own = [p for p in points if p.scene == scene]
        default = next(p for p in own if p.setting == choice.default)
        same = [p for p in own
                if p.errors["rms"] <= 1.05 * default.errors["rms"] + 1e-9]
        ratio = default.ms / min(p.ms for p in same)
        prices.append(f"{ratio:.2f} on {scene}")
    return (f"The default is {choice.default}; it takes this many times as long "
            f"as the fastest setting that is as near: {', '.join(prices)}.")


def describe_machine():
    return [f"{find_processor()}, {os.cpu_count()} threads. Made on "
            f"{datetime.date.today()} by "
            f"{shlex.join(['benchmarks/speed-error.py', *sys.argv[1:]])}. Load "
            f"before: {os.getloadavg()[0]:.2f}; times count only from a machine "
            "that does nothing else."]


def measure_all(options, measurer, pyplot, bar):
    """(choice, points, price) for each choice that there is a scene for."""
    plan = []
    for choice in filter(measurer.can_measure, options.choices):
        scenes = [scene for scene in options.scenes
                  if scene.is_patches() == choice.patches]
        if not scenes:
            print(f"{choice.name}: no scene of this kind", file=sys.stderr)
        plan += [(choice, scenes)] if scenes else []
    steps = sum(len(scenes) * measurer.count_steps(choice)
                for choice, scenes in plan)
    measurer.advance = lambda: bar.update(measurer.steps / steps)
    measured = []
    for choice, scenes in plan:
        points = [point for scene in scenes
                  for point in measurer.measure(choice, scene)]
        for p in points:
            spread = (max(p.times) - min(p.times)) / statistics.median(p.times)
            bar.say(f"{choice.name:15} {p.scene:12} {p.setting:15} {p.ms:8.3f} ms "
                    f"(spread {spread:.0%})  rms {p.errors['rms']:.3g}  FLIP "
                    f"{p.errors['flip']:.3g}{'  front' if p.front else ''}")
        measured.append((choice, points, describe_price(choice, points)))
        if pyplot:
            draw.write(pyplot, draw.draw_choice(pyplot, choice, points),
                       f"{options.out}/{choice.name}")
    return measured


def main():
    options = parse_options()
    if options.list:
        return list_choices()
    notes = describe_machine()
    measurer = Measurer(options, ROOT)
    pyplot = find_pyplot()
    with Progress("measuring speed and error") as bar:
        measured = measure_all(options, measurer, pyplot, bar)
    if not measured:
        sys.exit("speed-error.py: error: expected scenes and choices that go together, "
                 "but none of these do")
    write_csv(f"{options.out}/points.csv",
              [p.record() for _, points, _ in measured for p in points])
    with Progress("measuring failure modes"):
        modes = failures.collect(options)
    summary.write_summary(measured, modes, f"{options.out}/summary.md")
    page.write_page(f"{options.out}/index.html", measured, modes, notes)
    print(f"wrote {options.out}/index.html")


if __name__ == "__main__":
    run_main(main)
