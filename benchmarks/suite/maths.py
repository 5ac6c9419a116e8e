# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What a function of the maths costs, beside libm's and SLEEF's."""

import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import bodies
from commands import call
from suite.section import Section, draw_groups

ROOT = bodies.ROOT
FOLDER = f"{ROOT}/benchmarks/maths"
# Names, and the arguments that are timed.
FUNCTIONS = {
    "exp": (-10, 10), "exp2": (-10, 10), "log": (0.01, 100),
    "log2": (0.01, 100), "log10": (0.01, 100), "sin": (-100, 100),
    "cos": (-100, 100), "tan": (-100, 100), "asin": (-1, 1), "acos": (-1, 1),
    "atan": (-10, 10), "sinh": (-10, 10), "cosh": (-10, 10), "tanh": (-10, 10),
    "cbrt": (-100, 100),
}
CXX = ["g++", "-std=c++20", "-O2", "-march=native", "-ffp-contract=off"]
# What the program prints, and the columns.
CONTENDERS = {"scalar": "Piko", "vectors": "Piko, vectors",
              "near1": "within 1 ULP", "near4": "within 4 ULP", "libm": "libm",
              "sleef": "SLEEF", "sleef-vectors": "SLEEF, vectors"}


def has_sleef():
    """Whether Debian's libsleef-dev, or its like, is installed."""
    done = subprocess.run(["g++", "-fsyntax-only", "-x", "c++", "-include",
                           "sleef.h", "/dev/null"], capture_output=True)
    return done.returncode == 0


def build(options, function, sleef):
    low, high = FUNCTIONS[function]
    program = f"{options.work}/maths.{function}"
    objects, headers = [], []
    for space, build_name, flags in [
            ("scalar", "scalar", []), ("vectors", "default", []),
            ("near1", "default", ["-DMATHS_ULPS=1"]),
            ("near4", "default", ["-DMATHS_ULPS=4"])]:
        code, header = f"{program}.{space}.o", f"{program}.{space}.h"
        call([f"{options.bin}/pikoc", f"{FOLDER}/maths.piko.cpp", "-o", code,
              "--header", header, "--cpu=native", "--namespace", space,
              f"-DMATHS_FUNCTION={function}", *flags,
              *bodies.COMPILED[build_name]])
        objects.append(code)
        headers.append(f'-DMATHS_{space.upper()}="{header}"')
    call([*CXX, f"-I{ROOT}/runtime/include", *headers,
          f"-DMATHS_FUNCTION={function}", f"-DMATHS_LOW={low}",
          f"-DMATHS_HIGH={high}", *["-DMATHS_SLEEF"] * sleef,
          f"{FOLDER}/host.cpp", *objects, f"-L{options.lib}", "-lpikort",
          bodies.get_openmp(), *["-lsleef"] * sleef,
          f"-Wl,-rpath,{options.lib}", "-o", program])
    return program


def read_errors():
    """The greatest errors, in ULP, as they were measured."""
    with open(f"{ROOT}/benchmarks/results/maths.md") as file:
        rows = re.findall(r"^\| `(\w+)` \| ([\d.]+) \|", file.read(), re.M)
    return dict(reversed(rows))  # of the first table


def measure(options):
    sleef = has_sleef()
    os.makedirs(options.work, exist_ok=True)
    with ThreadPoolExecutor(options.jobs) as pool:
        programs = list(pool.map(lambda f: build(options, f, sleef),
                                 options.functions))
    errors = read_errors()
    rows, records, times = [], [], {}
    for function, program in zip(options.functions, programs):
        text = call([program, str(options.seconds)])
        found = {name: float(ns) for name, ns in
                 (line.split() for line in text.splitlines())}
        if "vectors" not in found:
            sys.exit(f"{program}: expected times, but got '{text}'")
        times[function] = found
        rows.append([function, *(f"{found[name]:.2f}" if name in found else ""
                                 for name in CONTENDERS),
                     errors.get(function, "")])
        records += [{"function": function, "who": name, "ns": ns}
                    for name, ns in found.items()]
    return Section(
        "maths", "Functions of the maths",
        ["Nanoseconds for a float on one thread, with its load and store: "
         "medians over 16,384 floats. The errors of Piko's, in ULP, are those of "
         "benchmarks/results/maths.md."]
        + ["SLEEF is not installed (Debian: libsleef-dev)."] * (not sleef),
        ["function", *CONTENDERS.values(), "ULP"], rows, records,
        lambda pyplot: draw_groups(
            pyplot, list(times),
            {title: [t.get(name) for t in times.values()]
             for name, title in CONTENDERS.items()
             if any(name in t for t in times.values())},
            "ns a float", log=True),
        keys=["function", "who"], times=["ns"])
