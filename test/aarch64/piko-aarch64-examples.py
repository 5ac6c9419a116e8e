#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Runs the pipelines of the examples as code for AArch64, under an emulator.

  piko-aarch64-examples.py --bin build/bin --runner "qemu-aarch64 ... piko-run-capture"
  piko-aarch64-examples.py --bin build/bin --runner ... --only raster --cpu neoverse-n1

piko-render draws a small scene and writes down what the pipeline was given; on that
piko-compare runs the reference executor here and the code for AArch64 there, on 1, 2
and 4 threads, and all state must be the same. What piko-render has no scene for gets
made-up primitives. Prints each difference; the exit status is 1 if there is any.
"""

import argparse
import concurrent.futures
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "test" / "mappings"), str(ROOT / "test" / "gpu")]
write_torus = __import__("piko-mappings").write_torus
gpu_examples = __import__("piko-gpu-examples")


def run(command, **options):
    """What is wrong, or nothing."""
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True,
                          check=False, **options)
    if done.returncode == 0:
        return ""
    return f"{' '.join(map(str, command))}\n  {(done.stdout + done.stderr).strip()[-900:]}"


def check(arguments, folder, file, pipe):
    name = file.parent.name
    compare = [arguments.bin / "piko-compare", file, "--pipe", pipe, "--runner",
               arguments.runner, "--cpu", arguments.cpu, "--threads", "1", "2", "4",
               "--runs", "1"]
    if name in gpu_examples.COMPARED:
        return run(compare + ["--domain", *gpu_examples.COMPARED[name], "--count", "300"])
    captures = folder / f"{name}-{pipe}"
    captures.mkdir()
    scene = gpu_examples.SCENES.get(name, ["torus.ply"])
    wrong = run([arguments.bin / "piko-render", file, "--pipe", pipe, *scene,
                 *gpu_examples.SIZE], cwd=folder,
                env={**os.environ, "PIKO_CAPTURE": str(captures)})
    files = sorted(captures.iterdir())
    if wrong or len(files) != 1:
        return wrong or f"{file.name} {pipe}: expected one capture, but got {files}"
    return run(compare + ["--capture", files[0]])


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=ROOT / "build/bin", type=pathlib.Path)
    parser.add_argument("--runner", required=True, help="piko-run-capture, emulated")
    parser.add_argument("--cpu", default="aarch64", help="aarch64 or aarch64:NAME")
    parser.add_argument("--only", help="an example")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    arguments.bin = arguments.bin.resolve()

    tasks = []
    for file in sorted(ROOT.glob("examples/*/*.piko.cpp")):
        if arguments.only in (None, file.parent.name):
            names = subprocess.run([arguments.bin / "pikoc", file, "--list-pipes"],
                                   capture_output=True, text=True, check=True)
            tasks += [(file, pipe) for pipe in names.stdout.split()]
    if not tasks:
        sys.exit("no example")
    with tempfile.TemporaryDirectory() as name, \
            concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        folder = pathlib.Path(name)
        write_torus(folder / "torus.ply", rings=14, sides=8)
        wrong = [text for text in
                 pool.map(lambda task: check(arguments, folder, *task), tasks) if text]
    print("\n".join(wrong + [f"{len(tasks)} pipelines on AArch64: {len(wrong)} differ"]))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
