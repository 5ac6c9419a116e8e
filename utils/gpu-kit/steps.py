#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Proves and times pipelines on a card.

  run.sh [options]

Each thing is a process of its own, with a limit of time, and the next goes on where one
fails. A line of JSON for each is added to RESULTS as soon as it is done: that file is
what to bring back, and what benchmarks/gpu-results.py makes tables of. Steps:

  smoke        the device, its driver, a kernel, a join, loops, nested ones, a barrier
               of a grid, each in a process of its own, with the time of that
  conformance  what every target must do alike
  examples     all pictures of the examples are the processor's
  time         frames of all examples, by the device's events and by the wall clock,
               with 1 to 1000 lights: what figures 4 and 5 and table 4 of the Piko
               paper have
  rerun        a hundred runs of six pipelines leave one picture
  random       random pipelines leave what the reference executor does
  peer         with --peer: the same scenes by another renderer
  opengl       the same scenes and lights by OpenGL, through EGL where the machine has
               it: Piko's picture, but for a few pixels, and the time of that
  sanitize     compute-sanitizer, where it is, finds nothing in small cases
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

from scenes import camera_of

KIT = pathlib.Path(__file__).resolve().parent
RENDER = KIT / "bin/piko-render-library"
CONFORMANCE = KIT / "bin/PikoConformance-cuda"
GL_PEER = KIT / "bin/gl-peer"
PROGRAMS = (RENDER, CONFORMANCE, GL_PEER)
STEPS = ["smoke", "conformance", "examples", "time", "rerun", "random", "peer",
         "opengl", "sanitize"]
# Of eight minutes; later steps share what a step leaves.
SHARES = {"smoke": 60, "conformance": 60, "examples": 75, "time": 120, "rerun": 30,
          "random": 55, "peer": 20, "opengl": 30, "sanitize": 30}
# What each stands for, and which conformance test has it by itself.
SMOKE = [("a kernel and its clears", "Frame.ImagesAreClearedAndBuffersStay", {}),
         ("a join by one block", "Order.BranchesAndSourcesJoin", {}),
         ("a join by a grid with barriers", "Order.BranchesAndSourcesJoin",
          {"PIKO_CUDA_ALONE": "0"}),
         ("a conditional node", "Order.CyclesWhoseHopsAreSeen", {}),
         ("nested conditional nodes", "Order.CyclesInRounds", {}),
         ("strips", "Order.StripsTakeLessMemory", {}),
         ("an error of a kernel", "Error.IndexOutsideIsThatOfTheFirstPrimitive", {}),
         ("modules loaded eagerly", "Order.SchedulesInAChain",
          {"CUDA_MODULE_LOADING": "EAGER"})]
RERUN = [("visibility", "Visibility"), ("raster", "Tiled"), ("raster", "Baseline"),
         ("shadow", "Bins16"), ("oit", "Bins16"), ("reyes", "Reyes")]
LIGHTS = [1, 10, 100, 1000]
# gl-peer's exit status where a machine lacks EGL, or OpenGL by a card.
NO_OPENGL = 3
TECHNIQUES = ["forward", "prepass"]
DRAWN_BY_OPENGL = [("visibility", "Visibility"), ("raster", "Fused")]
# Of all pixels, how many may be another triangle's by OpenGL: at edges, where what
# rounds a corner's place decides.
MOST_DIFFERING = 0.01


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False)
    parser.add_argument("--results", default="results.jsonl", type=pathlib.Path,
                        help="(results.jsonl)")
    parser.add_argument("--seconds", default=480, type=float,
                        help="for all steps (480)")
    parser.add_argument("--from", dest="first", choices=STEPS, default=STEPS[0],
                        metavar="STEP", help="leave out what is before it")
    parser.add_argument("--only", choices=STEPS, metavar="STEP", help="nothing else")
    parser.add_argument("--jobs", default=4, type=int,
                        help="processes at a time where nothing is timed (4)")
    parser.add_argument("--slow", default=1, type=float, metavar="FACTOR",
                        help="on limits of time, but for --seconds (1)")
    parser.add_argument("--peer", metavar="COMMAND",
                        help="prints as its last line JSON with ms_median; {scene}, "
                             "{lights}, {width} and {height} stand for what is drawn, "
                             "and the scene's camera is added in piko-render's words")
    parser.add_argument("--software-opengl", action="store_true",
                        help="opengl by a renderer on the processor, to try the step")
    arguments = parser.parse_args()
    try:
        fill_in(arguments.peer or "", "", 1)
    except (KeyError, IndexError, ValueError) as error:
        parser.error(f"--peer: expected {{scene}}, {{lights}}, {{width}} or {{height}}, "
                     f"but got {error}")
    return arguments


def fill_in(command, scene, lights):
    return [word.format(scene=scene, lights=lights, width=1024, height=768)
            for word in shlex.split(command)]


class Run:
    """What has been asked for, the time that is left, and the results."""

    def __init__(self, arguments):
        self.arguments = arguments
        self.manifest = json.loads((KIT / "manifest.json").read_text())
        self.chosen = ([arguments.only] if arguments.only
                       else STEPS[STEPS.index(arguments.first):])
        self.end = time.monotonic() + arguments.seconds
        self.step, self.step_end, self.counts = "", self.end, {}
        self.log = open(arguments.results, "a", encoding="utf-8")
        self.lock = threading.Lock()
        paths = [str(KIT / "lib"), os.environ.get("LD_LIBRARY_PATH", "")]
        self.own = {"LD_LIBRARY_PATH": ":".join(filter(None, paths))}

    def begin(self, step):
        self.step = step
        self.counts = {"ok": 0, "failed": 0, "left": 0, "absent": 0}
        now = time.monotonic()
        to_come = self.chosen[self.chosen.index(step):]
        self.step_end = now + ((self.end - now) * SHARES[step]
                               / sum(SHARES[it] for it in to_come))

    def note(self, name, status, **more):
        """status: ok, failed, left (for want of time), or absent (the machine has no
        such thing, which is no failure)."""
        with self.lock:
            self.counts[status] += 1
            self.log.write(json.dumps({"step": self.step, "name": name,
                                       "status": status, **more}) + "\n")
            self.log.flush()
            os.fsync(self.log.fileno())
        if status in ("failed", "absent"):
            out = "left out: " if status == "absent" else ""
            print(f"  {name}: {out}{more.get('text', '').strip()[:400]}", flush=True)

    def call(self, name, words, judge=None, limit=60, absent=None, **environment):
        """Runs a command and notes how it went; what it printed, or None. `judge`
        takes that, and returns what is wrong and what else to note. `absent`: the exit
        status that says that the machine lacks what is needed."""
        left = self.step_end - time.monotonic()
        if left < 1:
            self.note(name, "left")
            return None
        try:
            if words[0] == RENDER:
                unpack(words[1])
        except (OSError, subprocess.CalledProcessError) as error:
            self.note(name, "failed", text=f"taking its library out: {error}")
            return None
        start = time.monotonic()
        code, out, text = run_limited(
            [str(word) for word in words], min(limit * self.arguments.slow, left),
            {**os.environ, **(self.own if words[0] in PROGRAMS else {}),
             **environment})
        seconds = round(time.monotonic() - start, 3)
        wrong, more = ("", {})
        if code == 0 and judge:
            try:
                wrong, more = judge(out)
            except (ValueError, LookupError, TypeError) as error:
                wrong = f"expected a line of JSON, but {error}"
        ok = code == 0 and not wrong
        status = "ok" if ok else "absent" if code == absent else "failed"
        self.note(name, status, seconds=seconds, code=code,
                  **({"environment": environment} if environment else {}), **more,
                  **({} if ok else {"text": (wrong + "\n" + text[-3000:]).strip()}))
        return out if ok else None

    def call_all(self, tasks):
        """Several at a time; a task is the arguments of call()."""
        with concurrent.futures.ThreadPoolExecutor(self.arguments.jobs) as pool:
            for future in [pool.submit(self.call, *words, **named)
                           for words, named in tasks]:
                future.result()


UNPACKING = threading.Lock()


def unpack(library):
    """Takes a library out where that was not done."""
    path = KIT / library
    with UNPACKING:
        if not path.exists():
            subprocess.run(["zstd", "-q", "-d", "-f", f"{path}.zst", "-o",
                            f"{path}.new"], check=True)
            pathlib.Path(f"{path}.new").rename(path)


def run_limited(words, limit, environment):
    """Status, standard output, and all output. What is late is killed with all that it
    has started, and not waited for: a card that hangs may hold it."""
    with tempfile.TemporaryFile("w+", errors="replace") as out, \
            tempfile.TemporaryFile("w+", errors="replace") as said:
        try:
            process = subprocess.Popen(words, stdout=out, stderr=said, cwd=KIT,
                                       env=environment, start_new_session=True)
        except OSError as error:
            return -1, "", str(error)
        late = ""
        try:
            code = process.wait(limit)
        except subprocess.TimeoutExpired:
            code, late = -1, f"it took more than {limit:.0f} s\n"
            os.killpg(process.pid, signal.SIGKILL)
            try:
                process.wait(5)
            except subprocess.TimeoutExpired:
                late += "and was not to be killed\n"
        out.seek(0)
        said.seek(0)
        text = out.read()
        return code, text, late + text + said.read()


def render(library, pipe, scene, *options):
    return [RENDER, KIT / library, "--pipe", pipe, KIT / scene, "--target", "cuda",
            "--json", *options]


def judge_render(expected=None, **more):
    """It ran on a device, and left what is expected; `more` is noted, too."""
    def judge(out):
        told = json.loads(out)
        if "device" not in told:
            return "it ran on the processor", {}
        if expected and told["image_hash"] != expected:
            return f"expected {expected}, but got {told['image_hash']}", {}
        kept = ["ms_median", "ms_min", "ms_max", "frames", "tris", "lights", "w", "h",
                "compile_ms", "image_hash", "time", "device", "kernels"]
        return "", {**more, "told": {key: told[key] for key in kept if key in told}}
    return judge


def judge_tests(out):
    passed = re.search(r"\[  PASSED  \] (\d+) tests?", out)
    return ("" if passed and int(passed[1]) else "no test ran",
            {"tests": int(passed[1]) if passed else 0})


# --- Steps ---------------------------------------------------------------------

def describe_device():
    try:
        return subprocess.run(
            ["nvidia-smi", "--query-gpu=name,driver_version,memory.total,compute_cap",
             "--format=csv,noheader"], capture_output=True, text=True, check=True,
            timeout=20).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return "a device that nvidia-smi does not tell of"


def smoke(run):
    run.note("kit", "ok", device=describe_device(), commit=run.manifest["commit"])
    for name, test, environment in SMOKE:
        run.call(name, [CONFORMANCE, f"--gtest_filter={test}"], judge_tests, 40,
                 **environment)


def conformance(run):
    run.call("conformance", [CONFORMANCE], judge_tests, 120)
    run.call("conformance, joins by grids", [CONFORMANCE], judge_tests, 120,
             PIKO_CUDA_ALONE="0")


def example_of(library):
    return pathlib.Path(library).stem


def name_of(picture):
    return " ".join([example_of(picture["library"]), picture["pipe"],
                     pathlib.Path(picture["scene"]).name, *picture["options"]])


def examples(run):
    run.call_all([((name_of(it), render(it["library"], it["pipe"], it["scene"],
                                        *it["options"], "--frames", "1", "--warmup",
                                        "0", "--threads", "2"),
                    judge_render(it["hash"])), {}) for it in run.manifest["pictures"]])


def make_scenes(run):
    if not (KIT / "scenes/mixed.ply").exists():
        run.call("scenes", [sys.executable, KIT / "scenes.py", KIT / "scenes"])


def list_meshes():
    """What frames are timed of."""
    meshes = sorted(it for it in (KIT / "scenes").iterdir()
                    if it.suffix not in ("", ".bpt") and it.name != "torus.ply")
    return meshes or [KIT / "scenes/torus.ply"]


def time_frames(run):
    make_scenes(run)
    frames = ["--warmup", "5", "--frames", "60", "--seconds", "0.5"]
    pipes = list(dict.fromkeys((it["library"], it["pipe"])
                               for it in run.manifest["pictures"]))
    own = {(it["library"], it["pipe"]): it for it in run.manifest["pictures"]}
    meshes = list_meshes()

    def measure(pipe, scene, lights, *more):
        options = [] if scene.suffix == ".capture" else [
            *camera_of(scene), "--lights", str(lights)]
        run.call(" ".join([example_of(pipe[0]), pipe[1], scene.name, str(lights),
                           *(["kernels"] if more else [])]),
                 render(*pipe, scene.relative_to(KIT), *options, *frames, *more),
                 judge_render(example=example_of(pipe[0]), pipe=pipe[1],
                              scene=scene.name, lights=lights))

    # The most telling first; then each pipeline once; then all with all lights.
    telling = [it for it in pipes if it[1] in ("Visibility", "Fused", "Tiled")]
    for scene in meshes:
        for pipe in telling[:2]:
            measure(pipe, scene, 1)
            measure(pipe, scene, 1, "--kernel-times")
    for pipe in pipes:
        if pipe not in telling[:2]:
            picture = own[pipe]
            is_mesh = pathlib.Path(picture["scene"]).suffix not in (".bpt", ".capture")
            measure(pipe, meshes[0] if is_mesh else KIT / picture["scene"], 1)
    variants = [it for it in pipes if "raster.so" in it[0] or "visibility.so" in it[0]]
    for lights in LIGHTS:
        for scene in meshes:
            for pipe in variants:
                if lights != 1 or pipe not in telling[:2]:
                    measure(pipe, scene, lights)


def rerun(run):
    for library, pipe in RERUN:
        found = [it for it in run.manifest["pictures"]
                 if it["pipe"] == pipe and f"/{library}.so" in it["library"]]
        if found:
            it = found[-1]
            run.call(f"{name_of(it)}, 100 times",
                     render(it["library"], pipe, it["scene"], *it["options"],
                            "--frames", "1", "--warmup", "0", "--reruns", "99"),
                     judge_render(it["hash"]))


def random(run):
    """A library at a time: all of them are large."""
    libraries = {}
    for it in run.manifest["random"]:
        libraries.setdefault(it["library"], []).append(it)
    for library, pipes in libraries.items():
        compare_random(run, pipes)
        (KIT / library).unlink(missing_ok=True)


def compare_random(run, pipes):
    # Of every second one all joins are grids'.
    grids = [{"PIKO_CUDA_ALONE": "0"}, {}]
    run.call_all([((it["pipe"], render(it["library"], it["pipe"], it["scene"],
                                       "--frames", "1", "--warmup", "0", "--threads",
                                       "2"), judge_render(it["hash"])),
                   grids[i % 2]) for i, it in enumerate(pipes)])


def peer(run):
    if not run.arguments.peer:
        return
    make_scenes(run)

    def judge(out):
        told = json.loads(out.splitlines()[-1])
        return ("" if "ms_median" in told else "expected ms_median"), {"told": told}

    for scene in sorted((KIT / "scenes").iterdir()):
        if scene.suffix not in ("", ".bpt"):
            run.call(f"peer {scene.name}",
                     fill_in(run.arguments.peer, scene, 1) + camera_of(scene), judge)


def judge_opengl(**more):
    """It is Piko's picture; `more` is noted, too."""
    def judge(out):
        told = json.loads(out.splitlines()[-1])
        differing, pixels = told.get("differs", 0), told["w"] * told["h"]
        wrong = "" if differing <= MOST_DIFFERING * pixels else (
            f"expected Piko's picture, but {differing} of {pixels} pixels differ")
        return wrong, {**more, "told": told}
    return judge


def opengl(run):
    """By each technique, with each number of lights."""
    words = [GL_PEER, *["--software"] * run.arguments.software_opengl]
    torus = KIT / "scenes/torus.ply"
    if not run.call("OpenGL", [*words, torus, "--frames", "1"], judge_opengl(),
                    absent=NO_OPENGL):
        return
    make_scenes(run)
    pipe = next(((it["library"], it["pipe"]) for it in run.manifest["pictures"]
                 if (example_of(it["library"]), it["pipe"]) in DRAWN_BY_OPENGL), None)
    with tempfile.TemporaryDirectory() as folder:
        picture = pathlib.Path(folder) / "picture.png"
        for scene in list_meshes():
            for lights in LIGHTS:
                view = [scene, *camera_of(scene), "--lights", str(lights)]
                compare_opengl(run, words, view, pipe, picture)


def compare_opengl(run, words, view, pipe, picture):
    """A scene as it is seen, by OpenGL, beside the processor's picture of a pipeline,
    if there is one."""
    scene, lights = view[0].name, int(view[-1])
    picture.unlink(missing_ok=True)
    if pipe:
        run.call(f"picture of {scene} {lights}",
                 [RENDER, KIT / pipe[0], "--pipe", pipe[1], *view, "--frames", "1",
                  "--warmup", "0", "--quiet", "--out", picture],
                 PIKO_CUDA_DRIVER="none.so")
    for technique in TECHNIQUES:
        run.call(f"OpenGL {technique} {scene} {lights}",
                 [*words, *view, "--technique", technique, "--warmup", "5", "--frames",
                  "60", "--seconds", "0.5",
                  *(["--compare", picture] if picture.exists() else [])],
                 judge_opengl(technique=technique, scene=scene, lights=lights),
                 absent=NO_OPENGL)


def sanitize(run):
    tool = shutil.which("compute-sanitizer") or "/usr/local/cuda/bin/compute-sanitizer"
    if not os.access(tool, os.X_OK):
        return
    for kind in ["memcheck", "initcheck", "racecheck"]:
        run.call(kind, [tool, "--tool", kind, "--error-exitcode", "9", CONFORMANCE,
                        "--gtest_filter=Order.*Join:Frame.Feeds*"], judge_tests)


def main():
    arguments = parse_arguments()
    run = Run(arguments)
    steps = {"smoke": smoke, "conformance": conformance, "examples": examples,
             "time": time_frames, "rerun": rerun, "random": random, "peer": peer,
             "opengl": opengl, "sanitize": sanitize}
    failed, left = 0, []
    for step in run.chosen:
        run.begin(step)
        print(step, flush=True)
        steps[step](run)
        print("  " + ", ".join(f"{count} {what}" for what, count in run.counts.items()
                               if count or what != "absent"), flush=True)
        failed += run.counts["failed"]
        left += [step] if run.counts["left"] else []
    if left:
        print(f"time was up: run.sh --from {left[0]} goes on; left in: "
              + ", ".join(left))
    print(f"{arguments.results} is what to bring back")
    return 1 if failed or left else 0


if __name__ == "__main__":
    sys.exit(main())
