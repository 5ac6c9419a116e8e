# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Runs commands that go wrong, and checks how they say so.

    errors.py FOLDER < TABLE

A line of the table is `COMMAND => MESSAGE`, where `...` in the message stands for any
text, or `COMMAND => STATUS MESSAGE` for another exit status than 1. The message is the
first line on standard error; it is of the form that docs/Diagnostics.md says. Nothing is
on standard output, and no file is new or gone: FOLDER, where commands run, is made anew,
with files that are wrong in one way each."""

import os
import re
import shutil
import struct
import subprocess
import sys
import zlib

PIPELINE = """#include <piko.h>
#include <piko/scene.h>
struct State { piko::scene::Camera eye; piko::Image<piko::scene::Color> picture; };
struct Draw : piko::Stage<0, 0, 64, piko::scene::Vertex>, piko::Uses<State> {
  void process(const piko::scene::Vertex &v) {
    update(state().picture, {0, 0}, [](piko::scene::Color &c) { c.rgba.r = 1; });
  }
};
struct Points : piko::Pipe<State> { Draw draw; Points() { source(draw); } };
"""
SQUARE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
NOISE = bytes(range(1, 256)) * 4
FILES = {
    "ok.piko.cpp": PIPELINE,
    "bad.piko.cpp": "#include <piko.h>\nint x = ;\n",
    "utf.piko.cpp": b"#include <piko.h>\n\xff\xfe\n",
    "empty": "",
    "empty.piko.cpp": "",
    "ok.mlir": "module {\n}\n",
    "bad.mlir": "func.func @x( {\n",
    "noise": NOISE,
    "noise.ply": NOISE,
    "noise.3ds": NOISE,
    "noise.so": NOISE,
    "noise.png": NOISE,
    "noise.mlir": NOISE,
    "ok.obj": SQUARE,
    "nan.obj": SQUARE.replace("1 0 0", "1 nan 0"),
    "outside.obj": SQUARE.replace("2 3", "2 9"),
    "empty.obj": "",
    "cut.ply": "ply\nformat ascii 1.0\nelement vertex 3\n",
    "bad.off": "OFF\n4 1 0\n0 0 zero\n",
    "bad.csv": "x,y\n1,2,3\n",
    "bad.json": "{",
    "cut.ppm": b"P6\n10 10\n255\nabc",
}


def make_png(width, height):
    def chunk(kind, data):
        checksum = struct.pack(">I", zlib.crc32(kind + data))
        return struct.pack(">I", len(data)) + kind + data + checksum

    rows = b"".join(b"\0" + bytes(7 * i % 256 for i in range(3 * width)) for _ in range(height))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = (b"IHDR", header), (b"IDAT", zlib.compress(rows)), (b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*one) for one in chunks)


def fill(folder):
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(f"{folder}/folder")
    picture = make_png(16, 8)
    wrong = picture[:50] + bytes([picture[50] ^ 255]) + picture[51:]
    pictures = {"ok.png": picture, "small.png": make_png(8, 8), "wrong.png": wrong,
                "cut.png": picture[:len(picture) // 2]}
    for name, content in {**FILES, **pictures}.items():
        data = content.encode() if isinstance(content, str) else content
        with open(f"{folder}/{name}", "wb") as file:
            file.write(data)


def look(folder):
    """All files, with what they hold."""
    found = {}
    for name in sorted(os.listdir(folder)):
        path = f"{folder}/{name}"
        found[name] = "" if os.path.isdir(path) else open(path, "rb").read()
    return found


# A place, or the tool; then lower case, but for names of macros and formats.
FORM = re.compile(r"(?!<unknown>)([\w.-]+|[^:]+:\d+:\d+): error: (?![A-Z][a-z ])")
CRASHES = ("Stack dump", "PLEASE submit", "Traceback", "terminate called", "LLVM ERROR",
           "Assertion", "Sanitizer", "libpng")


def find_fault(done, status, message):
    """What is wrong with how a command ended; None if nothing."""
    said = done.stderr.decode(errors="replace")
    # What argparse says how to call a script is before the message.
    lines = [one for one in said.split("\n") if not re.match(r"usage: | ", one)]
    first = lines[0]
    if done.returncode != status:
        return f"expected status {status}, but got {done.returncode}"
    if done.stdout:
        return f"expected nothing on standard output, but got {done.stdout[:80]}"
    if any(word in said for word in CRASHES):
        return "expected a message, but got a crash"
    if not FORM.match(first) or first.endswith((".", "!")) and not first.endswith("..."):
        return "expected the form of messages"
    pattern = ".*".join(re.escape(part) for part in message.split("..."))
    if not re.fullmatch(pattern, first):
        return f"expected '{message}'"
    return None


def main():
    folder = sys.argv[1]
    fill(folder)
    before = look(folder)
    count = faults = 0
    for line in sys.stdin:
        if not line.strip() or line.startswith("#"):
            continue
        command, message = line.rstrip("\n").split(" => ")
        number = re.match(r"(\d+) ", message)
        status = int(number[1]) if number else 1
        message = message[number.end():] if number else message
        done = subprocess.run(["bash", "-c", command], cwd=folder, capture_output=True,
                              stdin=subprocess.DEVNULL)
        fault = find_fault(done, status, message)
        if not fault and look(folder) != before:
            fault = "expected the files as they were"
            fill(folder)
        if fault:
            print(f"{command}\n  {fault}\n  {done.stderr.decode(errors='replace')}")
        count, faults = count + 1, faults + bool(fault)
    print(f"{count} commands, {faults} faults")
    return 1 if faults or not count else 0


sys.exit(main())
