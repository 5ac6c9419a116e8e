#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Does what docs/Tutorial.md or docs/Levels.md says, in an empty folder, and
checks the image or what is printed.

The last file named in backquotes before a ```cpp, ```cmake or ```mlir fence, but
for headers, is the one that the fence holds. The ```sh fences are run; a ```text
fence is what the last command before it prints. The words of the document are not
changed; the generator, the compiler and where Piko is come from variables of the
environment.
"""

import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys

FENCE = re.compile(r"^```(cpp|cmake|mlir|sh|text)\n(.*?)^```", re.S | re.M)
FILES = {
    "Tutorial": {"spheres.piko.cpp", "main.cpp", "CMakeLists.txt"},
    "Levels": {
        "dots.mlir",
        "main.cpp",
        "CMakeLists.txt",
        "sums.mlir",
        "sums.cpp",
    },
}
NAME = re.compile(r"`([\w.]+\.\w+)`")


def read(document):
    """Files by name, the commands, and lines that these print."""
    files, commands, printed, end = {}, "", [], 0
    for fence in FENCE.finditer(document):
        kind, body = fence.groups()
        if kind == "sh":
            commands += body
        elif kind == "text":
            printed += body.splitlines()
        else:
            names = NAME.findall(document[end : fence.start()])
            names = [n for n in names if not n.endswith(".h")]
            files[names[-1]] = body
        end = fence.end()
    return files, commands, printed


def check(image):
    """Spheres from left to right grow, come nearer and turn from red to blue."""
    data = image.read_bytes()
    head = b"P6\n320 240\n255\n"
    assert data.startswith(head), data[:20]
    pixels = data[len(head) :]
    assert len(pixels) == 320 * 240 * 3, len(pixels)

    def pixel(x, y):
        at = 3 * (y * 320 + x)
        return tuple(pixels[at : at + 3])

    background = (26, 26, 38)
    corners = [pixel(x, y) for x in (0, 319) for y in (0, 239)]
    assert corners == [background] * 4, corners
    red, blue = pixel(30, 112), pixel(270, 100)
    assert red[0] > 150 > red[2], red
    assert blue[2] > 150 > blue[0], blue
    assert pixel(280, 65) != background == pixel(280, 55)
    drawn = sum(
        pixel(x, y) != background for x in range(320) for y in range(240)
    )
    assert 20000 < drawn < 26000, drawn


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--piko", required=True, help="build or install folder")
    parser.add_argument("--work", required=True, type=pathlib.Path)
    parser.add_argument("document", type=pathlib.Path)
    args = parser.parse_args()
    files, commands, printed = read(args.document.read_text())
    expected = FILES[args.document.stem]
    if set(files) != expected or not commands:
        sys.exit(f"expected {expected} and commands, but got {set(files)}")
    shutil.rmtree(args.work, ignore_errors=True)
    args.work.mkdir(parents=True)
    for name, text in files.items():
        (args.work / name).write_text(text)
    environment = dict(os.environ, PIKO=args.piko)
    output = subprocess.run(
        ["sh", "-e"],
        input=commands,
        cwd=args.work,
        env=environment,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    ).stdout
    for line in printed:
        assert line in output.splitlines(), f"expected '{line}' in:\n{output}"
    if args.document.stem == "Tutorial":
        check(args.work / "spheres.ppm")


if __name__ == "__main__":
    main()
