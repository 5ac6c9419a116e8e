#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""A mesh of triangles through the pipeline of examples/raster, from Python.

    bunny.py raster.piko.cpp bunny.obj bunny.ppm

Reads the `v` and `f` lines of an OBJ file, looks at the mesh from in front of it, and
writes the picture as PPM."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Tuple

import numpy as np

import piko


def read_obj(path: str) -> Tuple[piko.Array, piko.Array]:
    """Positions, (n, 3) floats, and triangles, (m, 3) places among them; polygons are
    taken as fans."""
    positions, triangles = [], []
    for line in Path(path).read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            positions.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            corners = [int(word.split("/")[0]) for word in words[1:]]
            corners = [c - 1 if c > 0 else len(positions) + c for c in corners]
            triangles += [[corners[0], b, c] for b, c in zip(corners[1:], corners[2:])]
    if not triangles:
        raise SystemExit(f"bunny.py: error: '{path}': expected triangles, but there are none")
    return np.array(positions, "f4"), np.array(triangles, "i4")


def compute_normals(positions: piko.Array, triangles: piko.Array) -> piko.Array:
    """Of each vertex, of unit length: those of its triangles by their areas."""
    a, b, c = (positions[triangles[:, i]] for i in range(3))
    faces = np.cross(b - a, c - a)
    normals = np.zeros_like(positions)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], faces)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 0, normals / np.maximum(length, 1e-30), (0, 0, 1))


def set_camera(camera: piko.Array, positions: piko.Array, aspect: float) -> None:
    """In front of the mesh, which fills the picture's height."""
    lo, hi = positions.min(axis=0), positions.max(axis=0)
    center, radius = (lo + hi) / 2, float(np.linalg.norm(hi - lo)) / 2
    half = 0.36  # of the picture's height, at distance 1
    distance = radius / half
    near, far = distance - 1.1 * radius, distance + 1.1 * radius
    eye = center + (0, 0, distance)
    view = np.eye(4)
    view[:3, 3] = -eye
    project = np.zeros((4, 4))
    project[0, 0], project[1, 1] = 1 / (half * aspect), 1 / half
    project[2, 2] = -(far + near) / (far - near)
    project[2, 3] = -2 * far * near / (far - near)
    project[3, 2] = -1
    # Column after column, as GLM has them.
    camera["viewProjection"] = (project @ view).T.reshape(camera["viewProjection"].shape)
    camera["eye"], camera["forward"] = eye, (0, 0, -1)
    camera["right"], camera["up"] = (half * aspect, 0, 0), (0, half, 0)
    camera["nearZ"], camera["farZ"] = near, far


def main() -> None:
    if len(sys.argv) != 4:
        raise SystemExit(__doc__)
    width, height = 1024, 768
    positions, triangles = read_obj(sys.argv[2])
    pipe = piko.Pipeline(sys.argv[1], pipe="Fused", domain=(width, height))

    camera = np.zeros((), pipe.dtype("camera"))
    set_camera(camera, positions, width / height)
    pipe["camera"] = camera
    lights = np.zeros(1, pipe.dtype("lights"))
    lights["position"], lights["color"] = (0.3, 0.7, 0.65, 0), 1
    pipe["lights"] = lights

    vertices = np.zeros(len(positions), pipe.source("vertexShader").dtype)
    vertices["position"] = positions
    vertices["normal"] = compute_normals(positions, triangles)
    vertices["index"] = np.arange(len(positions))
    pipe["mesh"] = vertices
    pipe.feed("vertexShader", vertices)
    corners = np.zeros(len(triangles), pipe.source("setup").dtype)
    corners["vertex"], corners["index"] = triangles, np.arange(len(triangles))
    pipe.feed("setup", corners)

    begin = time.perf_counter()
    pipe.run()
    spent = 1e3 * (time.perf_counter() - begin)
    print(f"{len(triangles)} triangles in {spent:.1f} ms, the first frame")
    rgb = np.clip(pipe["color"]["rgba"][..., :3], 0, 1)
    with open(sys.argv[3], "wb") as file:
        file.write(b"P6\n%d %d\n255\n" % (width, height))
        file.write((rgb * 255 + 0.5).astype("u1").tobytes())


if __name__ == "__main__":
    try:
        main()
    except (OSError, ValueError, IndexError, piko.Error) as error:
        raise SystemExit(f"bunny.py: error: {error}") from None
