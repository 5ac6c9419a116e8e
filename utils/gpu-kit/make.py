#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Packs what proves and times pipelines on a machine with a card.

  make.py [options]      also: make gpu-kit

That machine needs NVIDIA's driver, glibc, Python and zstd; nothing of LLVM, and no
toolkit. Pipelines are compiled here, ahead of time, to shared libraries with code for
processors, PTX, and, where ptxas is found, cubins; so are the conformance tests. With
them come scenes, and the hashes of all pictures, drawn here by the processor, which
the tests hold to the reference executor. Random pipelines are compared with it here,
and come with what they took.

Writes OUT, a tar.zst of a folder gpu-kit: what it is unpacked for is ./run.sh
(docs/GPU.md).
"""

import argparse
import concurrent.futures
import importlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
BUNNY = pathlib.Path("/usr/share/glmark2/models/bunny.obj")
SIZES = [(320, 240), (1024, 768)]
# What piko-render draws; the first one is the most telling.
EXAMPLES = ["visibility", "raster", "shadow", "oit", "raytrace", "reyes"]
TARGETS = ["pikoc", "piko-compare", "piko-render", "piko-render-library", "pikort",
           "PikoConformance-cuda", "gl-peer"]


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False)
    parser.add_argument("--build", default=ROOT / "build", type=pathlib.Path,
                        help="(build)")
    parser.add_argument("--out", type=pathlib.Path, help="(BUILD/gpu-kit.tar.zst)")
    parser.add_argument("--scene", action="append", default=[], type=pathlib.Path,
                        help="a mesh to draw and time as well; may be repeated")
    parser.add_argument("--chips", default="sm_80,sm_90,sm_100,sm_120",
                        help="for which there are cubins where ptxas knows them "
                             "(sm_80,sm_90,sm_100,sm_120)")
    parser.add_argument("--random-chips", default="sm_90", metavar="CHIPS",
                        help="the same of random pipelines; others translate (sm_90)")
    parser.add_argument("--random", default=500, type=int, metavar="N",
                        help="random pipelines (500)")
    parser.add_argument("--examples", nargs="+", choices=EXAMPLES, default=EXAMPLES)
    parser.add_argument("--jobs", default=os.cpu_count(), type=int)
    arguments = parser.parse_args()
    arguments.build = arguments.build.resolve()
    arguments.out = (arguments.out or arguments.build / "gpu-kit.tar.zst").resolve()
    return arguments


def call(words, **options):
    """What a command prints; ends where it fails."""
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True,
                          errors="replace", check=False, **options)
    if done.returncode:
        sys.exit(f"make.py: {' '.join(map(str, words))}\n{done.stderr[-3000:]}")
    return done.stdout


def describe_commit():
    try:
        return subprocess.run(["git", "-C", ROOT, "describe", "--always", "--dirty"],
                              capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


class Maker:
    def __init__(self, arguments, work):
        self.arguments, self.work = arguments, work
        self.kit = work / "gpu-kit"
        self.tools = arguments.build / "bin"
        self.pool = concurrent.futures.ThreadPoolExecutor(arguments.jobs)
        self.manifest = {"commit": describe_commit(),
                         "chips": arguments.chips, "pictures": [], "random": []}
        for folder in ["bin", "lib", "pipelines", "scenes", "captures"]:
            (self.kit / folder).mkdir(parents=True)
        # Nothing runs on a device here.
        self.environment = {**os.environ, "PIKO_CUDA_DRIVER": "none.so",
                            "LD_LIBRARY_PATH": str(self.kit / "lib")}

    def cached(self, name):
        text = (self.arguments.build / "CMakeCache.txt").read_text()
        found = re.search(rf"^{name}:\w+=(.*)$", text, re.M)
        return found[1] if found else None

    # --- Programs and what they are linked to --------------------------------

    def build(self):
        call(["cmake", "--build", self.arguments.build, "--target", *TARGETS])
        programs = [self.tools / name for name in
                    ("piko-render-library", "PikoConformance-cuda", "gl-peer")]
        own = "linux-vdso|ld-linux|libc|libm|libdl|libpthread|librt"
        for program in programs:
            shutil.copy(program, self.kit / "bin")
            for line in call(["ldd", program]).splitlines():
                words = line.split()
                if "=>" in words and not re.match(rf"({own})[.-]", words[0]):
                    shutil.copy(words[2], self.kit / "lib" / words[0])
        for file in [*(self.kit / "bin").iterdir(), *(self.kit / "lib").iterdir()]:
            call(["strip", file])

    def compile(self, file, pipe, *target):
        """An object of one pipeline."""
        out = self.work / f"{file.name.split('.')[0]}-{pipe}{target[0]}.o"
        call([self.tools / "pikoc", file, "--pipe", pipe, "-o", out, *target])
        return out

    def link(self, out, objects):
        llvm = self.cached("PIKO_LLVM_PREFIX") or "/usr/lib/llvm-22"
        call([f"{llvm}/bin/clang++", "-shared", "-s", "-o", out, *objects,
              "-L", self.arguments.build / "lib", "-lpikort"])

    # --- Examples -------------------------------------------------------------

    def copy_scenes(self):
        for scene in [*self.arguments.scene, *[BUNNY][: BUNNY.exists()]]:
            shutil.copy(scene, self.kit / "scenes")
        shutil.copy(ROOT / "examples/reyes/knot.bpt", self.kit / "scenes")
        scenes = importlib.import_module("scenes")
        scenes.write_torus(self.kit / "scenes" / "torus.ply")

    def compile_examples(self):
        files = {name: ROOT / f"examples/{name}/{name}.piko.cpp"
                 for name in self.arguments.examples}
        pipes = {name: call([self.tools / "pikoc", file, "--list-pipes"]).split()
                 for name, file in files.items()}
        target = "--target=auto", f"--gpu-chip={self.arguments.chips}"
        objects = {name: [self.pool.submit(self.compile, files[name], pipe, *target)
                          for pipe in found] for name, found in pipes.items()}
        for name, futures in objects.items():
            self.link(self.kit / f"pipelines/{name}.so",
                      [future.result() for future in futures])
        return pipes

    def is_exact(self, name, pipe):
        """Whether no stage gives up its bits by piko::Precision::Relaxed."""
        text = call([self.tools / "pikoc", ROOT / f"examples/{name}/{name}.piko.cpp",
                     "--pipe", pipe, "--emit=authored"])
        return "relaxed" not in text

    def capture_rays(self, scene):
        """Trees of boxes are Embree's, which the kit is without."""
        call([self.tools / "piko-render", ROOT / "examples/raytrace/raytrace.piko.cpp",
              scene, "--width", SIZES[0][0], "--height", SIZES[0][1], "--frames", 1,
              "--warmup", 0],
             env={**self.environment, "PIKO_CAPTURE": str(self.kit / "captures")})
        return "captures/Raytracer.capture"

    def draw(self, picture, library=None):
        """Notes the picture's hash, as the processor draws it; `library`: by that."""
        words = [self.kit / "bin/piko-render-library",
                 library or self.kit / picture["library"], "--pipe", picture["pipe"],
                 self.kit / picture["scene"], *picture["options"], "--frames", 1,
                 "--warmup", 0, "--json"]
        told = json.loads(call(words, env=self.environment))
        picture["hash"] = told["image_hash"] if picture.pop("exact", True) else None
        return picture

    def draw_examples(self, pipes):
        camera_of = importlib.import_module("scenes").camera_of
        meshes = [it.name for it in (self.kit / "scenes").iterdir()
                  if it.suffix != ".bpt"]
        plain = "bunny.obj" if "bunny.obj" in meshes else "torus.ply"
        pictures = []
        for name, found in pipes.items():
            for pipe in found:
                exact = self.is_exact(name, pipe)
                scenes = [f"scenes/{it}" for it in [plain] + [
                    it for it in meshes if it not in (plain, "torus.ply")
                    and name in ("visibility", "raster")]]
                if name == "reyes":
                    scenes = ["scenes/knot.bpt"]
                sizes = [["--width", str(w), "--height", str(h)] for w, h in SIZES]
                if name == "raytrace":
                    scenes, sizes = [self.capture_rays(self.kit / "scenes" / plain)], [[]]
                pictures += [{"library": f"pipelines/{name}.so", "pipe": pipe,
                              "scene": scene, "options": camera_of(scene) + size,
                              "exact": exact}
                             for scene in scenes for size in sizes]
        self.manifest["pictures"] = [*self.pool.map(self.draw, pictures)]

    # --- Random pipelines -----------------------------------------------------

    def compare_random(self, first, count):
        """Writes a file of pipelines and what each has taken; the names of those that
        leave the reference executor's bits. Ends where one does not."""
        cpp, pipelines, runner = (importlib.import_module(name)
                                  for name in ("cpp", "pipelines", "runner"))
        pipes = [pipelines.generate(seed, set(pipelines.FEATURES), f"Random{seed}")
                 for seed in range(first, first + count)]
        file = self.work / f"random{first}.cpp"
        file.write_text(cpp.write_file(pipes))
        verdicts = runner.Runner(self.tools / "piko-compare", threads=(2,)).run(pipes)
        names = []
        for pipe, verdict in zip(pipes, verdicts):
            if verdict == runner.EQUAL:
                names.append(pipe.name)
            elif verdict != runner.BLANK and not verdict.startswith(
                    "the reference stops"):
                sys.exit(f"make.py: pipeline {pipe.name}: {verdict[:2000]}")
        return file, names

    def make_random(self, first, count):
        file, names = self.compare_random(first, count)
        # What is for a processor draws here, and would make the kit larger.
        objects, drawing = {}, []
        for name in names:
            if not (self.kit / f"captures/{name}.capture").exists():
                continue
            objects[name] = self.compile(file, name, "--target=cuda",
                                         f"--gpu-chip={self.arguments.random_chips}")
            drawing.append(self.compile(file, name, "--target=cpu"))
        for capture in (self.kit / "captures").glob("Random*.capture"):
            seed = int(capture.stem.removeprefix("Random"))
            if first <= seed < first + count and capture.stem not in objects:
                capture.unlink()
        library = f"pipelines/random{first}.so"
        drawer = self.work / f"random{first}.so"
        if objects:
            self.link(self.kit / library, objects.values())
            self.link(drawer, drawing)
        return [self.draw({"library": library, "pipe": name,
                           "scene": f"captures/{name}.capture", "options": []}, drawer)
                for name in objects]

    def make_all_random(self, batch=20):
        # Each pipeline's first run writes what it has taken.
        os.environ["PIKO_CAPTURE"] = str(self.kit / "captures")
        wanted, first = self.arguments.random, 1
        while len(self.manifest["random"]) < wanted:
            if first > 4 * wanted + batch:
                sys.exit("make.py: hardly any random pipeline leaves anything")
            lacking = wanted - len(self.manifest["random"])
            starts = range(first, first + lacking, batch)
            for found in self.pool.map(
                    lambda start: self.make_random(start, min(batch, first + lacking - start)),
                    starts):
                self.manifest["random"] += found
            first += lacking

    # --- The kit --------------------------------------------------------------

    def pack(self):
        here = pathlib.Path(__file__).resolve().parent
        for name in ["run.sh", "steps.py", "scenes.py"]:
            shutil.copy(here / name, self.kit)
        (self.kit / "manifest.json").write_text(json.dumps(self.manifest, indent=0))
        # They are ten times as large as compressed; steps.py takes them out.
        [*self.pool.map(lambda file: call(["zstd", "-q", "-19", "--rm", file]),
                        (self.kit / "pipelines").glob("*.so"))]
        call(["tar", "-C", self.work, "-I", "zstd -19 -T0", "-cf", self.arguments.out,
              "gpu-kit"])
        unpacked = sum(it.stat().st_size for it in self.kit.rglob("*") if it.is_file())
        print(f"{self.arguments.out}: {self.arguments.out.stat().st_size / 1e6:.1f} MB, "
              f"{unpacked / 1e6:.1f} MB unpacked, {len(self.manifest['pictures'])} "
              f"pictures, {len(self.manifest['random'])} random pipelines")


def main():
    sys.path += [str(ROOT / "test/random"), str(ROOT / "utils/gpu-kit")]
    with tempfile.TemporaryDirectory() as work:
        maker = Maker(parse_arguments(), pathlib.Path(work))
        for what, step in [("programs", maker.build), ("scenes", maker.copy_scenes)]:
            print(f"gpu-kit: {what}", flush=True)
            step()
        print("gpu-kit: examples", flush=True)
        maker.draw_examples(maker.compile_examples())
        print("gpu-kit: random pipelines", flush=True)
        maker.make_all_random()
        maker.pack()


if __name__ == "__main__":
    sys.path.append(str(ROOT / "utils"))
    from tool import run_main

    run_main(main)
