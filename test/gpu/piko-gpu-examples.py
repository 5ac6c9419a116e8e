#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Runs every pipeline of every example on a GPU.

  piko-gpu-examples.py --bin build/bin --driver build/lib/libpiko-test-driver.so
  piko-gpu-examples.py --bin build/bin --only raster --jobs 1

Each runs on one emulated on the CPU, in blocks of 32 threads, and as PTX on a CUDA
device, in blocks of 64: on NVIDIA's driver, or the one that is given, such as
the driver for tests, with two orders of blocks. Pictures must
equal, bit for bit, those of the CPU, which other tests hold to the reference
executor; what draws no picture is compared with the reference executor on random
primitives. Prints each difference with the command that shows it again; the exit
status is 1 if there is any, or if an example has no pipeline.
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "test" / "mappings"))
write_torus = __import__("piko-mappings").write_torus

TARGETS = [["--target", "gpu-on-cpu", "--gpu-threads", "32", "--gpu-seed", "1"],
           ["--target", "cuda", "--gpu-threads", "64"]]
SIZE = ["--width", "41", "--height", "29", "--lights", "2", "--frames", "1",
        "--warmup", "0", "--json"]
SCENES = {"reyes": [str(ROOT / "examples/reyes/knot.bpt"), "--set", "rate=6"]}
# What piko-render has no scene for, and the size of its domain.
COMPARED = {"voxelize": ["33", "18", "7"], "bilateral": ["41", "29"],
            "histogram": ["41", "29"], "particles": ["41", "29"]}


class Failed(Exception):
    pass


def run(command, folder):
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        text = (done.stdout + done.stderr).strip()
        raise Failed(f"{' '.join(map(str, command))}\n  {text[-600:]}")
    return done.stdout


def compare(tools, folder, file, pipe, target):
    name = file.parent.name
    run([tools / "piko-compare", file, "--pipe", pipe, "--domain",
         *COMPARED[name], "--count", "300", "--runs", "1", "--threads", "2",
         *target], folder)


def draw(tools, folder, file, pipe, rest):
    scene = SCENES.get(file.parent.name, ["torus.ply"])
    quick = ["-O0"] if "gpu-on-cpu" in rest else []
    command = [tools / "piko-render", file, "--pipe", pipe, *scene, *SIZE, *quick, *rest]
    return command, json.loads(run(command, folder))


def check(tools, folder, file, pipe, expected, targets):
    if file.parent.name in COMPARED:
        for target in targets:
            compare(tools, folder, file, pipe, target)
        return
    expected = expected.result()
    if not expected["pixels"]:
        raise Failed(f"{file.name} {pipe} draws nothing")
    for target in targets:
        command, actual = draw(tools, folder, file, pipe, target)
        if actual["image_hash"] != expected["image_hash"]:
            raise Failed(f"another picture than the CPU's: "
                         f"{' '.join(map(str, command))}")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=str(ROOT / "build/bin"))
    parser.add_argument("--driver", help="in place of libcuda.so.1")
    parser.add_argument("--only", help="an example")
    parser.add_argument("--ranks", metavar="N,...",
                        help="not on a GPU, but divided among so many ranks in threads")
    parser.add_argument("--few", action="store_true",
                        help="every fourth pipeline of an example, in turn on one of both")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    tools = pathlib.Path(arguments.bin).resolve()
    if arguments.driver:
        os.environ["PIKO_CUDA_DRIVER"] = str(pathlib.Path(arguments.driver).resolve())
    os.environ.setdefault("PIKO_TEST_DRIVER_SEED", "2")
    # Joins of few primitives are not left to one block.
    os.environ.setdefault("PIKO_CUDA_ALONE", "0")

    targets_of_all = [["--ranks", ranks] for ranks in arguments.ranks.split(",")] \
        if arguments.ranks else TARGETS
    tasks = []
    for file in sorted(ROOT.glob("examples/*/*.piko.cpp")):
        if arguments.only not in (None, file.parent.name):
            continue
        pipes = run([tools / "pikoc", file, "--list-pipes"], None).split()
        if not pipes:
            sys.exit(f"{file} has no pipeline")
        tasks.append((file, pipes))
    if not tasks:
        sys.exit("no example")

    failures = 0
    with tempfile.TemporaryDirectory() as folder, \
            concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        write_torus(pathlib.Path(folder) / "torus.ply", rings=14, sides=8)
        done = []
        for file, pipes in tasks:
            expected = None
            if file.parent.name not in COMPARED:
                expected = pool.submit(
                    lambda *what: draw(*what)[1], tools, folder, file, pipes[0], [])
            for pipe in pipes[::4] if arguments.few else pipes:
                turn = len(done) % len(targets_of_all)
                targets = [targets_of_all[turn]] if arguments.few else targets_of_all
                done.append(pool.submit(
                    check, tools, folder, file, pipe, expected, targets))
        for future in concurrent.futures.as_completed(done):
            try:
                future.result()
            except Failed as failure:
                failures += 1
                print(failure, flush=True)
    where = "divided among ranks" if arguments.ranks else "on a GPU"
    print(f"{len(done)} pipelines {where}: {failures} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
