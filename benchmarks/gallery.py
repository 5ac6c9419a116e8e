#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""The tables of docs/Gallery.md: each example with a picture, its lines of text and how
long a frame takes.

  gallery.py --bin build/bin --lib build/lib         measures, and writes tables and
                                                     small pictures
  gallery.py --check                                 are all examples there, with as
                                                     many lines as they have?

Lines are those of the pipeline and of headers that it includes from `examples`, without
empty ones and comments. Times are of all cores, the least of some rounds' medians. A row of the page
begins with the picture and ends with the time; the words in between are kept.
"""

import argparse
import json
import os
import pathlib
import re
import shlex
import struct
import sys
import tempfile
import zlib

from commands import call, run_main
from outputs import write_text

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/Gallery.md"
BUNNY = "/usr/share/glmark2/models/bunny.obj"
LARGE = "--width 1024 --height 768"
KNOT = "examples/reyes/knot.bpt"
LESSON = "examples/lessons/"
# Pipelines by folder: what piko-render takes, but for the text.
RENDERED = {
    "raster": f"--pipe Fused {BUNNY} {LARGE}",
    "visibility": f"--pipe Visibility {BUNNY} {LARGE}",
    "shadow": f"--pipe Bins16 {BUNNY} {LARGE} --ground",
    "oit": f"--pipe Bins16 {BUNNY} {LARGE}",
    "raytrace": f"{BUNNY} {LARGE} --ground",
    "reyes": f"{KNOT} {LARGE} --lights 3",
    "lessons/01-dots": f"{LESSON}01-dots/stars.csv --width 192 --height 144",
    "lessons/02-bins": f"{LESSON}02-bins/discs.csv --width 256 --height 192",
    "lessons/03-order": f"{LESSON}03-order/petals.csv --width 256 --height 192",
    "lessons/04-lists": f"{LESSON}04-lists/sites.csv --width 192 --height 144",
    "lessons/05-waits": f"{LESSON}05-waits/hills.csv --width 256 --height 192",
    "lessons/06-rasterizer": f"{BUNNY} --width 256 --height 192 --fovy 33",
    "lessons/07-mapping": f"{BUNNY} --width 256 --height 192 --fovy 33",
    "lessons/08-inside": f"{LESSON}08-inside/waves.csv --width 192 --height 144",
    "lessons/09-fusing": f"{LESSON}09-fusing/comets.csv --width 256 --height 192",
    "lessons/10-numbers": f"{LESSON}10-numbers/julia.csv --width 192 --height 144",
    "lessons/12-mlir": f"{LESSON}12-mlir/rose.csv --width 192 --height 144",
}
# Those that have a host in gallery/host.cpp: its input.
HOSTED = {"bilateral": "picture", "histogram": "picture", "voxelize": BUNNY,
          "particles": "none"}
# What a program of its own feeds.
CAPTURED = {"lessons/11-application"}
INCLUDE = re.compile(r'^#include "([^"]+)"', re.M)
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.S)
ROW = re.compile(r"^\| (.*?) \| \[([\w/-]+)\]\(([^)]+)\) \| (.*?) \| (.*?) \| (.*?) ?\|$",
                 re.M)


def find_text(folder):
    """The pipeline of a folder of examples."""
    found = [p for kind in ("*.piko.cpp", "*.mlir")
             for p in sorted((ROOT / "examples" / folder).glob(kind))]
    return found[0] if found else None


def count_lines(path, seen=None):
    """Lines of a text and of what it includes, without empty ones and comments."""
    seen = seen if seen is not None else set()
    if path in seen or not path.is_file():
        return 0
    seen.add(path)
    text = path.read_text()
    lines = [line for line in COMMENT.sub("", text).splitlines() if line.strip()]
    inner = [count_lines((path.parent / name).resolve(), seen)
             for name in INCLUDE.findall(text)]
    return len(lines) + sum(inner)


def folders():
    """All folders of examples that have a pipeline."""
    names = {p.parent.relative_to(ROOT / "examples").as_posix()
             for kind in ("*.piko.cpp", "*.mlir")
             for p in (ROOT / "examples").rglob(kind)}
    return sorted(names)


def write_png(path, ppm):
    """Writes what a PPM file holds as PNG."""
    head = re.match(rb"P6\s+(\d+)\s+(\d+)\s+255\s", ppm)
    width, height = int(head[1]), int(head[2])
    rows, last = b"", bytes(3 * width)
    for y in range(height):
        row = ppm[head.end() + 3 * width * y:][:3 * width]
        rows += b"\2" + bytes((a - b) & 255 for a, b in zip(row, last))  # "up"
        last = row

    def chunk(kind, body):
        return (struct.pack(">I", len(body)) + kind + body
                + struct.pack(">I", zlib.crc32(kind + body)))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header)
                     + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


class Gallery:
    def __init__(self, args, work):
        self.args, self.work = args, pathlib.Path(work)
        self.bin, self.lib = os.path.abspath(args.bin), os.path.abspath(args.lib)
        self.pictures = pathlib.Path(args.pictures)

    def tool(self, name):
        return os.path.join(self.bin, name)

    def build_host(self):
        objects = []
        for name in HOSTED:
            objects.append(str(self.work / f"{name}.o"))
            call([self.tool("pikoc"), str(find_text(name)), "-o", objects[-1],
                  "--header", str(self.work / f"{name}.h"), "--cpu=native"])
        host = str(self.work / "host")
        call([self.args.cxx, "-std=c++20", "-O2", f"-I{self.work}",
              f"-I{ROOT}/runtime/include", str(ROOT / "benchmarks/gallery/host.cpp"),
              *objects, "-o", host, f"-L{self.lib}", f"-Wl,-rpath,{self.lib}",
              "-lpikort", self.args.openmp])
        call([self.tool("piko-render"), str(find_text("lessons/06-rasterizer")),
              *shlex.split(RENDERED["lessons/06-rasterizer"]), "--frames", "1",
              "--out", str(self.work / "picture.ppm")])
        return host

    def measure_host(self, host, name):
        """Milliseconds of an example with a host, whose picture is kept."""
        given = HOSTED[name]
        given = str(self.work / "picture.ppm") if given == "picture" else given
        made = self.work / f"{name}.ppm"
        time = call([host, name, given, str(made), str(self.args.frames)])
        self.pictures.mkdir(parents=True, exist_ok=True)
        write_png(self.pictures / f"{name}.png", made.read_bytes())
        return float(time)

    def measure(self, name):
        words = [self.tool("piko-render"), str(find_text(name)),
                 *shlex.split(RENDERED[name]), "--frames", str(self.args.frames), "--json"]
        return json.loads(call(words, cwd=ROOT))["ms_median"]

    def measure_all(self):
        """The least of the rounds' medians: a shared machine only adds to them."""
        host, times = self.build_host(), {}
        for _ in range(self.args.rounds):
            for name in [*HOSTED, *RENDERED]:
                time = (self.measure_host(host, name) if name in HOSTED
                        else self.measure(name))
                times[name] = min(time, times.get(name, time))
        return times


def rewrite(text, times):
    """The page with lines and, where they are known, times."""
    def row(found):
        picture, name, link, words, _, time = found.groups()
        if name in times:
            time = f"{times[name]:.3g}"
        return (f"| {picture} | [{name}]({link}) | {words} |"
                f" {count_lines(find_text(name))} | {time} |")
    return ROW.sub(row, text)


def describe_machine():
    """The processor's name and how many there are."""
    cpu = re.search(r"^model name\s*: (.*)$", pathlib.Path("/proc/cpuinfo").read_text(),
                    re.M)
    return f"{cpu[1].strip() if cpu else 'unknown'}, {os.cpu_count()} cores"


def check(text):
    faults = []
    rows = {found[2]: found for found in ROW.finditer(text)}
    for name in folders():
        if name not in rows:
            faults.append(f"expected a row of '{name}'")
        elif rows[name][5] != str(count_lines(find_text(name))):
            faults.append(f"'{name}' has {count_lines(find_text(name))} lines, but the"
                          f" page says {rows[name][5]}")
    faults += [f"there is no example '{name}'" for name in rows if name not in folders()]
    known = set(RENDERED) | set(HOSTED) | CAPTURED
    faults += [f"nothing measures '{name}'" for name in rows if name not in known]
    return faults


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default="build/bin")
    parser.add_argument("--lib", default="build/lib")
    parser.add_argument("--cxx", default="clang++-22")
    parser.add_argument("--openmp", default="/usr/lib/llvm-22/lib/libomp.so")
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--page", type=pathlib.Path, default=PAGE)
    parser.add_argument("--pictures", default=str(ROOT / "docs/images/gallery"))
    parser.add_argument("--out", help="write the page there instead")
    parser.add_argument("--check", action="store_true")
    args = parser.parse_args()
    text = args.page.read_text()
    if args.check:
        faults = check(text)
        print("\n".join(faults) or f"{len(folders())} examples")
        sys.exit(1 if faults else 0)
    with tempfile.TemporaryDirectory() as work:
        times = Gallery(args, work).measure_all()
    text = rewrite(text, times)
    text = re.sub(r"(?<=<!-- machine -->\n).*?(?=\n<!-- -->)", describe_machine(), text,
                  flags=re.S)
    write_text(str(args.out or args.page), text)


if __name__ == "__main__":
    run_main(main)
