#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Does what a document says, word for word, in an empty folder, and checks what is
printed and the pictures.

  check-tutorial.py --piko build --work FOLDER docs/Tutorial.md
  check-tutorial.py --piko build --work FOLDER examples/lessons/01-dots/README.md

The last file named in backquotes before a ```cpp, ```cmake or ```mlir fence, but for
headers that are made, is the one that the fence holds; a lesson's goes on where none is. Of a lesson, a page with files
beside it, these are copied first, and such a fence is a part of that file. The ```sh
fences are run by one shell, those that say ```sh fails must fail; a ```text fence is
what the commands of the last ```sh fence print, with lines left out, and "..." for
what differs from run to run. A lesson's pictures, but for those of other folders, are
what its commands make of them, pixel by pixel; --update keeps these. The generator,
the compiler and where Piko is come from variables of the environment.
"""

import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys

from tool import run_main

FENCE = re.compile(r"^( *)```(\w+)( fails)?\n(.*?)^ *```", re.S | re.M)
NAME = re.compile(r"`([\w.-]+\.\w+)`")
PICTURE = re.compile(r"!\[[^]]*\]\(([\w.-]+\.png)\)|<img src=\"([\w.-]+\.png)\"")
HOLDS = ("cpp", "cmake", "mlir", "csv")
MARK = "=== next fence ==="
# Pages that write all of their files.
FILES = {
    "Tutorial": {"spheres.piko.cpp", "main.cpp", "CMakeLists.txt"},
    "Scale": {"disks.piko.cpp", "main.cpp", "CMakeLists.txt"},
    "Levels": {
        "dots.mlir",
        "main.cpp",
        "CMakeLists.txt",
        "sums.mlir",
        "sums.cpp",
    },
}


class Page:
    """A document and what stands in its fences."""

    def __init__(self, path):
        self.path, self.text = path, path.read_text()
        self.files = {}  # what the page writes
        self.shown = []  # (file, text), parts of files beside it
        self.commands = []  # (whether they fail, text)
        self.printed = []  # (number of the commands, lines)
        self.is_lesson = path.stem not in FILES
        end = 0
        for fence in FENCE.finditer(self.text):
            space, kind, fails, body = fence.groups()
            body = re.sub(f"^{space}", "", body, flags=re.M)
            if kind == "sh":
                self.commands.append((bool(fails), body))
            elif kind == "text":
                self.printed.append((len(self.commands) - 1, body.splitlines()))
            elif kind in HOLDS:
                self.add_file(self.text[end : fence.start()], body)
            else:
                sys.exit(f"{path}: expected a fence of {', '.join(HOLDS)}, sh or "
                         f"text, but got '{kind}'")
            end = fence.end()
        self.pictures = sorted({a or b for a, b in PICTURE.findall(self.text)})

    def add_file(self, before, body):
        def is_beside(name):
            return self.is_lesson and (self.path.parent / name).exists()

        names = [n for n in NAME.findall(before) if n[-2:] != ".h" or is_beside(n)]
        if not names and self.shown:
            self.shown.append((self.shown[-1][0], body))
            return
        if not names:
            sys.exit(f"{self.path}: expected the name of a file before:\n{body}")
        if is_beside(names[-1]):
            self.shown.append((names[-1], body))
        else:
            self.files[names[-1]] = body

    def faults(self):
        """What does not fit to the files beside the page."""
        if not self.commands:
            yield "expected commands"
        if not self.is_lesson:
            if set(self.files) != FILES[self.path.stem]:
                yield f"expected {FILES[self.path.stem]}, but got {set(self.files)}"
            return
        for name, body in self.shown:
            if body not in (self.path.parent / name).read_text():
                yield f"expected a part of {name}, but got:\n{body}"
        # Lines of a pipeline that no fence shows, but for that of the licence and those
        # of other lessons.
        known = {line for path in self.path.parent.parent.glob("*/*.piko.cpp")
                 if path.parent != self.path.parent
                 for line in path.read_text().splitlines()}
        for name in {name for name, _ in self.shown if name.endswith(".piko.cpp")}:
            lines = (self.path.parent / name).read_text().splitlines()[1:]
            shown = {l for n, body in self.shown if n == name for l in body.splitlines()}
            hidden = [line for line in lines if line not in shown | known]
            if hidden:
                yield f"expected all of {name}, but these lines are missing: {hidden}"


def run(page, work, environment):
    """What the commands of each fence print."""
    script = ""
    for fails, body in page.commands:
        if fails:
            body = f"if (\n{body}); then echo 'expected an error'; exit 1; fi\n"
        script += body + f"echo '{MARK}'\n"
    result = subprocess.run(
        ["sh", "-e"], input=script, cwd=work, env=environment,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )
    if result.returncode:
        sys.exit(f"{page.path}: commands failed:\n{result.stdout}")
    return result.stdout.split(MARK + "\n")


def match(line, printed):
    """Whether a line of the page is one that was printed."""
    parts = [re.escape(part) for part in line.rstrip().split("...")]
    return re.fullmatch(".*".join(parts), printed.rstrip())


def find_missing(lines, output):
    """The first line that was not printed after those before it."""
    printed = iter(output.splitlines())
    for line in lines:
        if line.strip() in ("", "..."):
            continue
        if not any(match(line, other) for other in printed):
            return line
    return None


def check_picture(page, name, args):
    made, kept = args.work / name, page.path.parent / name
    if not made.exists():
        return f"expected the commands to make {name}"
    if args.update:
        shutil.copy(made, kept)
    if kept.stat().st_size > 30 << 10:
        return f"expected at most 30 KiB of {name}"
    if kept.read_bytes() == made.read_bytes():
        return None
    command = ["piko-diff", kept, made, "--fail-above", "0"]
    result = subprocess.run(command, env=args.environment, capture_output=True, text=True)
    if result.returncode:
        return (f"{name} is no longer what the commands make (--update keeps that):\n"
                f"{result.stdout}{result.stderr}")
    return None


def check_spheres(image):
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


def prepare(page, work):
    """An empty folder, but for the files that there are."""
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    if page.is_lesson:
        for path in page.path.parent.iterdir():
            if path.is_file() and path.name not in [page.path.name, *page.pictures]:
                shutil.copy(path, work)
    for name, text in page.files.items():
        (work / name).write_text(text)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--piko", required=True, help="build or install folder")
    parser.add_argument("--work", required=True, type=pathlib.Path)
    parser.add_argument("--update", action="store_true", help="keep new pictures")
    parser.add_argument("document", type=pathlib.Path)
    args = parser.parse_args()
    page = Page(args.document)
    faults = list(page.faults())
    if faults:
        sys.exit(f"{page.path}: " + "\n".join(faults))
    prepare(page, args.work)
    paths = [os.environ.get("PATH", ""), os.path.join(args.piko, "bin")]
    args.environment = dict(os.environ, PIKO=args.piko, PATH=os.pathsep.join(paths))
    outputs = run(page, args.work, args.environment)
    for number, lines in page.printed:
        missing = find_missing(lines, outputs[number])
        if missing is not None:
            faults.append(f"expected '{missing}' in order in:\n{outputs[number]}")
    if page.is_lesson:
        faults += [f for f in (check_picture(page, name, args) for name in page.pictures)
                   if f]
    if faults:
        sys.exit(f"{page.path}: " + "\n".join(faults))
    if page.path.stem == "Tutorial":
        check_spheres(args.work / "spheres.ppm")


if __name__ == "__main__":
    run_main(main)
