#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Makes a wheel of the Python module from a build: extension, libpiko, libpikort,
piko-tune, the runtime's headers and GLM's, with no path of the build in it. LLVM's
libraries, Clang's and C++'s headers are those of Debian's packages; docs/Python.md lists
them.

The same build gives the same bytes. --check installs it into a new venv, without an
index, runs the example there, and tunes a pipeline.
"""

import argparse
import base64
import hashlib
import os
import pathlib
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

from tool import run_main

ROOT = pathlib.Path(__file__).resolve().parent.parent

METADATA = """Metadata-Version: 2.1
Name: piko
Version: {version}
Summary: Programmable graphics pipelines, compiled and run from Python
License: Apache-2.0 WITH LLVM-exception
Requires-Python: >=3.9
Requires-Dist: numpy
Description-Content-Type: text/markdown

Pipelines in C++ with piko.h become parallel programs for CPUs and NVIDIA GPUs, and run
on NumPy arrays. Needs LLVM 22's libraries and what C++ needs to be compiled: on Debian
libmlir-22, libclang-cpp22, libclang-common-22-dev, libomp5-22 and libstdc++-12-dev.
piko.tune also needs libmimalloc2.0 and libpng16-16.
"""


def run(*command, **options):
    return subprocess.run(
        [str(word) for word in command], check=True, text=True, **options
    )


def read_soname(library):
    out = run("readelf", "-d", library, capture_output=True).stdout
    for line in out.splitlines():
        if "(SONAME)" in line:
            return line.split("[")[1].rstrip("]")
    sys.exit(f"make-wheel: {library}: expected a library with a name of its own")


def keep_sonames(folder):
    """A wheel has no links: each library by the name that others look for."""
    for file in sorted(folder.iterdir()):
        if file.is_symlink():
            file.unlink()
    for file in sorted(folder.iterdir()):
        file.rename(folder / read_soname(file))


def read_version(build):
    for line in (build / "CMakeCache.txt").read_text().splitlines():
        if line.startswith("CMAKE_PROJECT_VERSION:STATIC="):
            return line.split("=")[1]
    sys.exit(f"make-wheel: expected the project's version in {build}/CMakeCache.txt")


def stage(build, folder, tag):
    """What the wheel holds, as files."""
    command = ["cmake", "--install", build, "--component", "wheel", "--strip"]
    run(*command, "--prefix", folder, stdout=subprocess.DEVNULL)
    keep_sonames(folder / "piko" / "lib")
    version = read_version(build)
    info = folder / f"piko-{version}.dist-info"
    info.mkdir()
    shutil.copy(ROOT / "LICENSE", info)
    (info / "METADATA").write_text(METADATA.format(version=version))
    (info / "WHEEL").write_text(
        f"Wheel-Version: 1.0\nGenerator: piko\nRoot-Is-Purelib: false\nTag: {tag}\n"
    )
    return info


def write(folder, info, wheel):
    """A zip archive whose last file lists all of them, with their hashes."""
    record = ""
    names = sorted(
        str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()
    )
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:

        def add(name, data, mode):
            entry = zipfile.ZipInfo(name)  # of 1980, always
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o100000 | mode) << 16
            archive.writestr(entry, data)

        for name in names:
            data = (folder / name).read_bytes()
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest())
            record += f"{name},sha256={digest.decode().rstrip('=')},{len(data)}\n"
            runs = name.endswith(".so") or name.startswith("piko/bin/")
            add(name, data, 0o755 if runs else 0o644)
        name = f"{info.name}/RECORD"
        add(name, f"{record}{name},,\n", 0o644)


def make(build, out):
    tag = f"cp{sysconfig.get_config_var('py_version_nodot')}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    tag = f"{tag}-{tag}-{platform}"
    read_version(build)  # whether there is a build
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        info = stage(build, folder, tag)
        for file in (*folder.rglob("*.so*"), *(folder / "piko" / "bin").iterdir()):
            if str(build.resolve()).encode() in read_paths(file):
                sys.exit(f"make-wheel: {file.name} looks for libraries in the build")
        wheel = out / f"{info.name.removesuffix('.dist-info')}-{tag}.whl"
        out.mkdir(parents=True, exist_ok=True)
        write(folder, info, wheel)
    return wheel


def read_paths(library):
    """Where a library looks for others."""
    out = run("readelf", "-d", library, capture_output=True).stdout
    lines = [line for line in out.splitlines() if "RUNPATH" in line or "RPATH" in line]
    return "\n".join(lines).encode()


CHECK = """
import os, sys
import piko
prefix = os.path.realpath(sys.prefix)
assert os.path.realpath(piko.__file__).startswith(prefix), piko.__file__
made = piko.compile("one.piko.cpp").compile_object()
for name in ("include/piko.h", "include/glm/glm.hpp"):
    (found,) = [file for file in made.files if file.endswith("/" + name)]
    assert os.path.realpath(found).startswith(prefix), found
with open("/proc/self/maps") as maps:
    ours = {line.split()[-1] for line in maps if "libpiko" in line}
assert len(ours) == 2 and all(one.startswith(prefix) for one in ours), ours
"""

# Of two settings the one that does a thousandth of the work, by the wheel's own tool.
TUNE = """
import os, sys
import numpy as np
import piko
from piko._tune import _find_tool
prefix = os.path.realpath(sys.prefix)
assert os.path.realpath(_find_tool()).startswith(prefix), _find_tool()
pipe = piko.Pipeline("two.piko.cpp", domain=(1, 1), sums=np.zeros(2000, "f4"), threads=1)
pipe.feed("add", np.arange(2000, dtype="i4"))
found = piko.tune(pipe, space=["tunables"], budget=40, clock="cpu")
assert found.tunables == {"steps": 1}, found
"""

TWO = """#include <piko.h>
constexpr int steps = piko::tunable("steps", 4000, 1);
struct State { piko::Buffer<float> sums; };
struct Add : piko::Stage<0, 0, 64, int>, piko::Uses<State> {
  void process(const int &i) {
    float sum = float(i);
    for (int k = 0; k < steps; ++k)
      sum = piko::sqrt(sum * sum);
    state().sums[i] = piko::floor(sum + 0.5f);
  }
};
struct Two : piko::Pipe<State> { Add add; Two() { source(add); } };
"""

ONE = """#include <piko.h>
struct Drain : piko::Stage<0, 0, 64, glm::vec2> { void process(const glm::vec2 &) {} };
struct One : piko::Pipe<> { Drain drain; One() { source(drain); } };
"""


def check(wheel):
    """In a folder that knows nothing of the build; NumPy is the system's."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        # Not of ours: PYTHONPATH, and what a sanitizer or a user sets.
        environment = {"PATH": os.defpath, "HOME": name, "LANG": "C.UTF-8"}
        options = {"cwd": folder, "env": environment}
        venv = folder / "venv"
        run(sys.executable, "-m", "venv", "--system-site-packages", venv)
        python = venv / "bin" / "python"
        install = ["-m", "pip", "install", "--quiet", "--no-index", "--no-cache-dir"]
        run(python, *install, wheel.resolve(), **options)
        (folder / "one.piko.cpp").write_text(ONE)
        run(python, "-c", CHECK, **options)
        (folder / "two.piko.cpp").write_text(TWO)
        run(python, "-c", TUNE, **options)
        tour = shutil.copy(ROOT / "examples" / "python" / "tour.py", folder)
        out = run(python, tour, "dots.ppm", capture_output=True, **options).stdout
        assert "cpu against gpu-on-cpu: equal" in out, out
        assert (folder / "dots.ppm").stat().st_size > 128 * 128 * 3
    print(f"{wheel.name}: installed and used")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", required=True, type=pathlib.Path)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    parser.add_argument("--check", action="store_true")
    args = parser.parse_args()
    wheel = make(args.build, args.out)
    print(f"{wheel}, {wheel.stat().st_size / 1e6:.1f} MB")
    if args.check:
        check(wheel)


if __name__ == "__main__":
    run_main(main)
