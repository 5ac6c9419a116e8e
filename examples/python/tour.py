#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""All that `import piko` has, on a picture of dots: compile, bind, draw, look at what
came of it. With a file's name the picture is written there, as PPM."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import List, Optional

import numpy as np

import piko

TEXT = """#include <piko.h>

constexpr int tile = piko::tunable("tile", 8, 16, 32);

struct Dot { glm::vec2 position; glm::vec3 color; float radius; };
struct Pixel { glm::vec3 color{0.1f}; float nearest = 1; };
struct Light { glm::vec3 color; float power; };
struct Canvas {
  piko::Image<Pixel> image;
  piko::Buffer<Light> lights;
  piko::Buffer<int32_t> drawn;
  float gain = 1;
};

struct Draw : piko::Stage<tile, tile, 64, Dot>, piko::Uses<Canvas> {
  static glm::ivec2 lo(const Dot &d) { return glm::ivec2(d.position - d.radius); }
  static glm::ivec2 hi(const Dot &d) { return glm::ivec2(d.position + d.radius) + 1; }
  void assignBin(const Dot &d) { assignToBoundingBox(d, lo(d), hi(d)); }
  void process(const Dot &d) {
    glm::vec3 light(0);
    for (const Light &l : state().lights)
      light += l.color * l.power;
    parallelForPixels(lo(d), hi(d), [&](glm::ivec2 at) {
      float depth = glm::length(glm::vec2(at) + 0.5f - d.position) / d.radius;
      if (depth < 1)
        update(state().image, at, [&](Pixel &p) {
          if (depth < p.nearest)
            p = {light * d.color * state().gain * (1 - depth), depth};
        });
    });
    piko::atomicAdd(state().drawn[0], 1);
  }
};

struct Dots : piko::Pipe<Canvas> {
  Draw draw;
  Dots() { source(draw); }
};
"""


def make_dots(dtype: np.dtype[np.void], count: int) -> piko.Array:
    """A spiral of dots, as an array of the source's records."""
    turn = np.linspace(0, 6 * np.pi, count)
    dots: piko.Array = np.zeros(count, dtype)
    dots["position"] = 64 + (2.5 * turn * (np.cos(turn), np.sin(turn))).T
    dots["color"] = np.stack([turn, turn[::-1], np.full(count, 9)], axis=1) / 19
    dots["radius"] = np.linspace(2, 9, count)
    return dots


def look_at(program: piko.Program) -> None:
    print(program, "of", ", ".join(program.names))
    for tunable in program.tunables:
        print(f"{tunable.name}, line {tunable.line}: {' or '.join(tunable.values)}")
    print(f"{len(program.emit('kernels'))} bytes at the kernels level")
    print(program.explain().splitlines()[0])
    made: piko.Object = program.compile_object()
    print(f"{made.symbol}: an object, and {len(made.header.splitlines())} lines")


def draw(program: piko.Program) -> piko.Pipeline:
    pipe = program.create((128, 128), threads=0, gain=1.5)
    lights = np.zeros(2, pipe.dtype("lights"))
    lights["color"] = [(1, 0.9, 0.8), (0.2, 0.2, 0.6)]
    lights["power"] = 1
    pipe["lights"] = lights
    pipe.allocate("drawn", 1)
    dots = make_dots(pipe.source("draw").dtype, 60)
    pipe.feed("draw", dots)
    pipe.run()
    stats: piko.Stats = pipe.stats()
    for stage in stats.stages:
        print(f"{stage.name}: {stage.taken} taken, bins of {stage.bin_size}")
    print(f"{int(pipe['drawn'][0])} calls; kernels", [one.name for one in stats.kernels])
    return pipe


def check(pipe: piko.Pipeline) -> None:
    print(piko.compare(pipe, against="gpu-on-cpu", tolerance=1e-6))
    try:
        pipe.feed("draw", np.zeros(3, [("position", "f8", 2)]))
    except ValueError as error:
        print("ValueError:", error)
    try:
        piko.compile(TEXT.replace("gain * (1", "gian * (1"), name="dots.piko.cpp")
    except piko.CompileError as error:
        print(f"CompileError: {error.file}:{error.line}: {len(error.diagnostics)}")
    pipe.allocate("drawn", 0)
    try:
        pipe.run()
    except piko.RunError as error:
        print(f"RunError: {error.status.name}: {error}")


def write(path: Optional[str], colors: piko.Array) -> None:
    data = (np.clip(colors, 0, 1) * 255 + 0.5).astype("u1")
    height, width, _ = data.shape
    if path is not None:
        header = f"P6\n{width} {height}\n255\n".encode()
        Path(path).write_bytes(header + data.tobytes())


def main(arguments: List[str]) -> None:
    program = piko.compile(TEXT, "Dots", tunables={"tile": 16}, name="dots.piko.cpp")
    look_at(program)
    pipe = draw(program)
    image = pipe["image"]
    write(arguments[1] if len(arguments) > 1 else None, image["color"])
    print(image.shape, image.dtype.names, f"{(image['nearest'] < 1).mean():.2f} covered")
    for device in piko.devices():
        print(device.name, device.memory)
    del image
    check(pipe)


if __name__ == "__main__":
    try:
        main(sys.argv)
    except (OSError, piko.Error) as error:
        raise SystemExit(f"tour.py: error: {error}") from None
