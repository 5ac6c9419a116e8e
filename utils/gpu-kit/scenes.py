#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Meshes that are made rather than carried: binary PLY files.

  scenes.py FOLDER     writes sphere1m.ply and mixed.ply there
"""

import array
import math
import pathlib
import random
import sys

#: As scenes that people measure with are usually seen, by their files' names.
CAMERAS = {"apartment": "--eye 8.5 12 1 --at 8 0 -5.5",
           "dream-apartment": "--eye 8.5 12 1 --at 8 0 -5.5",
           "sponza": "--fovy 60 --eye -14 3 0 --at 0 4 0"}


def camera_of(path):
    return CAMERAS.get(pathlib.Path(path).stem, "").split()


def write_ply(path, vertices, triangles):
    """`vertices`: array 'f', three a vertex; `triangles`: array 'i', three each."""
    count = len(triangles) // 3
    faces = bytearray(13 * count)
    bytes_of = memoryview(triangles.tobytes())
    for byte in range(12):
        faces[1 + byte::13] = bytes_of[byte::12]
    faces[0::13] = b"\3" * count
    with open(path, "wb") as file:
        file.write((
            "ply\nformat binary_little_endian 1.0\n"
            f"element vertex {len(vertices) // 3}\n"
            "property float x\nproperty float y\nproperty float z\n"
            f"element face {count}\nproperty list uchar int vertex_indices\n"
            "end_header\n").encode())
        vertices.tofile(file)
        file.write(faces)


def wind(rows, columns):
    """Two triangles for each cell of a grid that is closed in both directions."""
    triangles = array.array("i")
    for row in range(rows):
        below = (row + 1) % rows * columns
        for column in range(columns):
            right = (column + 1) % columns
            a, b = row * columns + column, row * columns + right
            c, d = below + column, below + right
            triangles.extend((a, c, b, b, c, d))
    return triangles


def write_torus(path, rows=96, columns=48):
    vertices = array.array("f")
    for row in range(rows):
        u = math.tau * row / rows
        for column in range(columns):
            v = math.tau * column / columns
            r = 1 + 0.4 * math.cos(v)
            vertices.extend((r * math.cos(u), r * math.sin(u), 0.4 * math.sin(v)))
    write_ply(path, vertices, wind(rows, columns))


def write_sphere(path, rows=708, columns=708):
    """About a million small triangles of much the same size: waves on a sphere."""
    vertices, triangles = array.array("f"), array.array("i")
    waves = [math.sin(9 * math.tau * i / columns) for i in range(columns)]
    around = [(math.cos(math.tau * i / columns), math.sin(math.tau * i / columns))
              for i in range(columns)]
    for row in range(rows + 1):
        angle = math.pi * row / rows
        y, ring, wave = math.cos(angle), math.sin(angle), 0.03 * math.sin(13 * angle)
        for (x, z), other in zip(around, waves):
            r = 1 + wave * other
            vertices.extend((r * ring * x, r * y, r * ring * z))
    for row in range(rows):
        for column in range(columns):
            right = (column + 1) % columns
            a, b = row * columns + column, row * columns + right
            triangles.extend((a, b, a + columns, b, b + columns, a + columns))
    write_ply(path, vertices, triangles)


def write_mixed(path, count=173_000):
    """Triangles of all sizes, from a few that fill the picture to most that are less
    than a pixel: the size is 2 to the power of a uniform number."""
    made = random.Random(1)
    vertices = array.array("f")
    for _ in range(count):
        size = 2.0 ** made.uniform(-11, 0)
        at = [made.uniform(-1, 1) for _ in range(3)]
        for _ in range(3):
            vertices.extend(it + size * made.uniform(-0.5, 0.5) for it in at)
    write_ply(path, vertices, array.array("i", range(3 * count)))


def main():
    folder = pathlib.Path(sys.argv[1])
    for name, write in [("sphere1m.ply", write_sphere), ("mixed.ply", write_mixed)]:
        write(folder / "unfinished")
        (folder / "unfinished").rename(folder / name)


if __name__ == "__main__":
    main()
