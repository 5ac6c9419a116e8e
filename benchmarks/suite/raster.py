# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""The fastest pipeline of examples/raster and examples/visibility, beside peers.

A first, short measurement of each pipeline says which is the fastest for a
scene, a number of lights and a number of threads. That one and the peers then
take turns.
"""

import json
import os
import shlex
import string
import subprocess
import sys
from types import SimpleNamespace

from figure4 import measure_once
from suite.section import Rounds, Section, draw_groups

FIELDS = ["scene", "lights", "threads", "width", "height"]
SIZE = {"width": 1024, "height": 768}  # of piko-render
# Its result has 8 bits a channel, and so another hash.
VISIBILITY = "Visibility"
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(
    os.path.abspath(__file__))))


def measure_pipe(options, scene, pipe, lights, threads):
    example = "visibility" if pipe == VISIBILITY else "raster"
    return measure_once(options, scene, pipe, lights, threads,
                        f"{ROOT}/examples/{example}/{example}.piko.cpp")


def parse_peer(text):
    """NAME=COMMAND, where {lights} and so on stand for what is measured."""
    name, separator, command = text.partition("=")
    if not separator or not name or not command.strip():
        raise ValueError(f"expected NAME=COMMAND, but got '{text}'")
    for _, field, _, _ in string.Formatter().parse(command):
        if field is not None and field not in FIELDS:
            raise ValueError(f"expected {{{'}, {'.join(FIELDS)}}} in the "
                             f"command, but got '{{{field}}}'")
    return name, shlex.split(command)


def measure_peer(peer, scene, lights, threads, size=SIZE):
    """The median milliseconds that a program prints: the last line of its
    output is JSON with `ms_median`."""
    name, words = peer
    command = []
    for word in words:
        if word == "{scene}":  # with the options of its camera
            command += shlex.split(scene)
        else:
            command.append(word.format(scene=scene, lights=lights,
                                       threads=threads, **size))
    try:
        done = subprocess.run(command, capture_output=True, text=True)
    except OSError as error:
        sys.exit(f"{name}: {error}")
    if done.returncode:
        sys.exit(f"{name}: {' '.join(command)}\n{done.stderr}")
    try:
        return float(json.loads(done.stdout.strip().split("\n")[-1])["ms_median"])
    except (ValueError, KeyError, TypeError):
        sys.exit(f"{name}: expected a line of JSON with ms_median, but got "
                 f"'{done.stdout.strip()[-200:]}'")


def find_fastest(options, scene, lights, threads):
    """The pipeline, and how many triangles the scene has."""
    probe = SimpleNamespace(bin=options.bin, warmup=1, frames=3, seconds=0.3)
    runs = {pipe: measure_pipe(probe, scene, pipe, lights, threads)
            for pipe in options.pipes}
    alike = {pipe: run["image_hash"] for pipe, run in runs.items()
             if pipe != VISIBILITY}
    if len(set(alike.values())) > 1:
        sys.exit(f"{scene}: expected one image of {', '.join(alike)}, but got "
                 f"{len(set(alike.values()))}")
    fastest = min(runs, key=lambda pipe: runs[pipe]["ms_median"])
    return fastest, runs[fastest]["tris"]


def measure_case(options, scene, lights, threads):
    """Names the pipeline, the triangles, and what each contender took."""
    pipe, triangles = find_fastest(options, scene, lights, threads)
    times = {"Piko": [], **{name: [] for name, _ in options.peer}}
    for _ in range(options.rounds):
        run = measure_pipe(options, scene, pipe, lights, threads)
        times["Piko"].append(run["ms_median"])
        for peer in options.peer:
            times[peer[0]].append(measure_peer(peer, scene, lights, threads))
    return pipe, triangles, {name: Rounds(t) for name, t in times.items()}


def describe_case(name, lights, threads):
    return f"{name}, {lights} light{'s' * (lights != 1)}, {threads} thr."


def measure(options):
    names = [name for name, _ in options.peer]
    rows, records, cases = [], [], {}
    for scene in options.scene:
        word = os.path.basename(shlex.split(scene)[0])
        for lights in options.lights:
            for threads in options.threads:
                pipe, triangles, times = measure_case(options, scene, lights,
                                                      threads)
                own = times["Piko"]
                row = [word, f"{triangles:,}", str(lights), str(threads), pipe,
                       str(own), f"{own.spread():.0%}"]
                for name in names:
                    row += [f"{times[name]} ({times[name].spread():.0%})",
                            f"{times[name].median / own.median:.2f}"]
                rows.append(row)
                cases[describe_case(word, lights, threads)] = times
                records += [
                    {"scene": word, "triangles": triangles, "lights": lights,
                     "threads": threads, "who": who,
                     "pipe": pipe if who == "Piko" else "", "round": turn,
                     "ms": ms}
                    for who, rounds in times.items()
                    for turn, ms in enumerate(rounds.times)]
    head = ["scene", "triangles", "lights", "threads", "pipeline", "median",
            "spread"]
    for name in names:
        head += [f"{name} (spread)", f"{name} / Piko"]
    return Section(
        "raster", "The rasterizer",
        ["A frame of 1024 x 768, by the fastest pipeline of the examples, of "
         f"{', '.join(options.pipes)}."]
        + ["A ratio says how many times as long a peer takes."] * bool(names),
        head, rows, records,
        lambda pyplot: draw_groups(
            pyplot, list(cases),
            {who: [times[who].median for times in cases.values()]
             for who in ["Piko", *names]}, "milliseconds", log=True),
        keys=["scene", "lights", "threads", "who"], times=["ms"])
