#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Draws the pictures of the examples in combinations of all that must not matter.

  piko-mappings.py --render build/bin/piko-render --count 40 --seed 1
  piko-mappings.py --render build/bin/piko-render --only raster=117

A combination is a mapping of an example's stages (bin size, schedules, split),
passes of the compiler that are left out, a number of threads, and strips; LLVM
optimizes those with vectors. What the schedules, bins and passes can be is walked in
one order that mixes them, so that any number of combinations holds all sizes and
passes about equally often.
Each picture must equal, bit for bit, what the reference executor draws of the
example with one whole-screen bin. Prints each difference with the command that
shows it again; the exit status is 1 if there is any.
"""

import argparse
import concurrent.futures
import itertools
import json
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
BINS = [0, 8, 16, 32, 64]
SCHEDULES = ["LoadBalance", "DirectMap", "Serialize", "All"]
SPLITS = [0, 100]
THREADS = [1, 2, 7]
STRIPS = [None, 100]
PASSES = ["pre-schedule", "infer-directives", "fuse-stages", "test-early", "prune",
          "own-pixels", "eliminate-schedules", "fuse-kernels", "form-strips",
          "form-gbuffer", "defer-shading", "form-tiles", "prefetch", "vectorize",
          "prove-bounds", "hoist-loads", "hoist-bounds", "merge-bounds", "combine-bounds",
          "thread-jumps", "narrow-integers", "distribute-loops", "reduce-strength", "peel-vectors",
          "merge-gathers", "pair-gathers",
          "unswitch-versions", "privatize", "reduce-updates", "if-convert"]

SIZE = ["--width", "131", "--height", "99", "--lights", "3"]


def write_torus(path, rings=40, sides=20):
    """A mesh of 2 * rings * sides triangles, from far below a pixel to many."""
    points, faces = [], []
    for i, j in itertools.product(range(rings), range(sides)):
        u, v = math.tau * (i / rings) ** 3, math.tau * j / sides
        r = 0.4 + 0.1 * math.sin(3 * u)
        points.append(((1 + r * math.cos(v)) * math.cos(u), r * math.sin(v),
                       (1 + r * math.cos(v)) * math.sin(u)))
        a, b = i * sides, (i + 1) % rings * sides
        k = (j + 1) % sides
        faces += [(a + j, a + k, b + k), (a + j, b + k, b + j)]
    header = ["ply", "format ascii 1.0", f"element vertex {len(points)}",
              *(f"property float {axis}" for axis in "xyz"),
              f"element face {len(faces)}",
              "property list uchar int vertex_indices", "end_header"]
    rows = [" ".join(f"{x:.6f}" for x in point) for point in points]
    rows += ["3 " + " ".join(map(str, face)) for face in faces]
    path.write_text("\n".join(header + rows) + "\n")


class Example:
    """An example, and its pipeline as a function of its mappings."""

    def __init__(self, name, pipe, mappings=1, scene=None):
        self.name, self.pipe, self.mappings = name, pipe, mappings
        self.scene = scene or "torus.ply"
        self.file = ROOT / "examples" / name.split(".")[0]
        self.file /= name.split(".")[0] + ".piko.cpp"


EXAMPLES = [
    Example("raster", "raster::LinearRaster<{}>"),
    Example("raster.indexed", "raster::IndexedRaster<{}>"),
    Example("shadow", "shadow::Shadow<{}, {}>", mappings=2),
    Example("oit", "oit::Oit<{}>"),
    Example("reyes", "reyes::MappedReyes<{}>",
            scene=str(ROOT / "examples/reyes/knot.bpt")),
    Example("raytrace", "raytrace::MappedRaytracer<{}>"),
]


def mapping_text(bin_size, core, rest, split, apart, waits):
    return (f"raster::Mapping{{.bin = {bin_size}, .core = piko::{core}, "
            f".rest = piko::{rest}, .split = {split}, "
            f".apart = {'true' if apart else 'false'}, "
            f".waits = {'true' if waits else 'false'}}}")


def mappings():
    """All that a pipeline can say about its stages."""
    for bin_size, core, rest, split, apart, waits in itertools.product(
            BINS, SCHEDULES, SCHEDULES, SPLITS, [True, False], [True, False]):
        if split and "All" not in (core, rest):
            continue  # only All is split
        if not apart and rest != core:
            continue  # nobody says it
        yield bin_size, core, rest, split, apart, waits


class Subsets:
    """All subsets of some things, in an order that mixes them: a permutation of
    their numbers, as a list of all of them would take too much memory."""

    def __init__(self, size, shuffled):
        self.size = size
        self.factors = [shuffled.randrange(1, 1 << size, 2) for _ in range(2)]

    def __len__(self):
        return 1 << self.size

    def __getitem__(self, number):
        for factor in self.factors:
            number = number * factor % len(self)
            number ^= number >> (self.size // 2)
        return [bool(number >> i & 1) for i in range(self.size)]


def combinations(example):
    """All combinations, in an order that mixes them."""
    shuffled = random.Random(example.name)
    choices = [list(mappings()) for _ in range(example.mappings)]
    choices += [THREADS[:], STRIPS[:]]
    for options in choices:
        shuffled.shuffle(options)
    choices.insert(example.mappings, Subsets(len(PASSES), shuffled))
    total = math.prod(map(len, choices))
    # The golden section of all, without a divisor in common with it: what varies
    # slowest changes in a few steps, too.
    step = int(total * (math.sqrt(5) - 1) / 2)
    while math.gcd(step, total) != 1:
        step += 1
    for number in range(total):
        rest, picked = number * step % total, []
        for options in choices:
            rest, index = divmod(rest, len(options))
            picked.append(options[index])
        yield picked


def draw(render, folder, file, example, rest):
    command = [render, file, "--pipe", "Mapped", example.scene, *SIZE, *rest,
               "--frames", "1", "--warmup", "0", "--json"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        return None, command, done.stderr.strip()
    return json.loads(done.stdout)["image_hash"], command, ""


def write_source(folder, example, number, texts):
    name = f"{example.name}-{number}.piko.cpp"
    (folder / name).write_text(f'#include "{example.file}"\n'
                    f"struct Mapped : {example.pipe.format(*texts)} {{}};\n")
    return name


def check(render, folder, example, number, picked):
    *mapped, left_out, threads, strip = picked
    texts = [mapping_text(*m) for m in mapped]
    file = write_source(folder, example, number, texts)
    rest = ["--threads", str(threads)]
    names = [name for name, out in zip(PASSES, left_out) if out]
    if names:
        rest += ["--without", ",".join(names)]
    if "vectorize" in names:
        rest += ["-O0"]
    if strip:
        rest += ["--strip", str(strip)]
    return example, number, texts, *draw(render, folder, file, example,
                                         rest)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--render", default=str(ROOT / "build/bin/piko-render"))
    parser.add_argument("--count", type=int, default=40,
                        help="combinations, of all examples together")
    parser.add_argument("--seed", type=int, default=1, help="where to start")
    parser.add_argument("--only", help="EXAMPLE=NUMBER, as a difference names it")
    parser.add_argument("--keep", help="folder for what is made")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()

    tasks = []
    for i, example in enumerate(EXAMPLES):
        share = len(range(i, arguments.count, len(EXAMPLES)))
        first = (arguments.seed - 1) * share
        numbers = range(first, first + share)
        if arguments.only:
            name, number = arguments.only.split("=")
            numbers = [int(number)] if example.name == name else []
        wanted = set(numbers)
        if wanted:
            every = itertools.islice(combinations(example), max(wanted) + 1)
            tasks += [(example, number, picked)
                      for number, picked in enumerate(every) if number in wanted]

    failures, expected = 0, {}
    with tempfile.TemporaryDirectory() as temporary, \
            concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        folder = pathlib.Path(arguments.keep or temporary).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        # Nothing is left in the user's cache.
        os.environ.setdefault("PIKO_CACHE_DIR", str(folder / "cache"))
        write_torus(folder / "torus.ply")
        render = str(pathlib.Path(arguments.render).resolve())
        whole = mapping_text(0, "LoadBalance", "LoadBalance", 0, True, False)
        references = {
            example.name: pool.submit(
                draw, render, folder,
                write_source(folder, example, "reference",
                             [whole] * example.mappings),
                example, ["--target", "reference", "-O0"])
            for example in {task[0].name: task[0] for task in tasks}.values()}
        done = [pool.submit(check, render, folder, *task) for task in tasks]
        for name, future in references.items():
            expected[name], command, error = future.result()
            if error:
                sys.exit(f"{' '.join(command)}\n{error}")
        for future in concurrent.futures.as_completed(done):
            example, number, texts, actual, command, error = future.result()
            if actual == expected[example.name]:
                continue
            failures += 1
            print(f"{example.name}={number}: {error or 'another picture'}\n"
                  f"  {', '.join(texts)}\n  {' '.join(command)}", flush=True)
    print(f"{len(tasks)} combinations of {len(expected)} examples: "
          f"{failures} differ from the reference executor")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
