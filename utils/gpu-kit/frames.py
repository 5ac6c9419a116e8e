#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Draws the examples on a card and times their frames.

  frames.py RESULTS.jsonl SECONDS

First all pipelines, small, whose pictures are to be those of this machine's
processor; then frames at 1024 x 768, the most telling first: medians by the host's
clock, and kernels and joins by events of the device. A line of JSON for each run.
"""

import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import time

ROOT = pathlib.Path(os.environ["PIKO_KIT_ROOT"])
SCENES = pathlib.Path("/opt/piko-kit/scenes")
TOOL = "/opt/piko-kit/bin/piko-render"
RASTER = ["Fused", "Tiled", "Baseline", "FreePipe", "Binned", "BinnedFused",
          "Bucketed", "Indexed"]
PIPES = [("visibility", "Visibility"), *(("raster", name) for name in RASTER),
         ("visibility", "RelaxedVisibility"),
         *(("shadow", name)
           for name in ("WholeScreen", "Bins8", "Bins16", "Bins32", "MapBins32")),
         *(("oit", name) for name in ("WholeScreen", "Bins8", "Bins16", "Bins32")),
         ("raytrace", "Raytracer"), ("reyes", "Reyes")]
# As these scenes are usually seen.
CAMERAS = {"mixed174k": "--eye 0 0 11.24 --at 0 0 0",
           "apartment": "--eye 8.5 12 1 --at 8 0 -5.5"}


class Runs:
    def __init__(self, results, seconds):
        self.log = open(results, "w", encoding="utf-8")
        self.end = time.time() + seconds

    def run(self, label, pipe, scene, *options, target="cuda", **environment):
        """The JSON of piko-render; {} where it failed or there is no time."""
        if time.time() > self.end:
            return {}
        example, name = pipe
        camera = CAMERAS.get(scene.stem, "").split()
        words = [TOOL, ROOT / f"examples/{example}/{example}.piko.cpp", "--pipe", name,
                 *camera, scene, "--target", target, "--json", *options]
        try:
            done = subprocess.run([str(word) for word in words], capture_output=True,
                                  text=True, check=False, timeout=60,
                                  env={**os.environ, **environment})
            status, text = done.returncode, done.stdout + done.stderr
        except subprocess.TimeoutExpired:
            status, text = 124, "takes more than a minute"
        told = json.loads(done.stdout) if status == 0 else {}
        self.log.write(json.dumps({
            "label": label, "example": example, "pipe": name, "scene": scene.stem,
            "options": [str(it) for it in options], "target": target,
            "environment": environment, "status": status, "told": told,
            "text": "" if told else text[-2000:]}) + "\n")
        self.log.flush()
        if status:
            print(f"{label} {example} {name} {scene.stem}: {text[-300:]}", flush=True)
        return told


def say(label, pipe, scene, told):
    if not told:
        return
    kernels = "".join(f" {it['name']} {it['ms'] - it['join_ms']:.3f}"
                      f"+{it['join_ms']:.3f}" for it in told["kernels"])
    print(f"{label}: {pipe[1]} {scene.stem} {told['lights']} lights "
          f"{told['ms_median']:.3f} ms, least {told['ms_min']:.3f};{kernels}",
          flush=True)


def scene_of(pipe, scenes):
    return (ROOT / "examples/reyes/knot.bpt" if pipe[0] == "reyes"
            else min(scenes, key=lambda it: it.stat().st_size))


def check_pictures(runs, scenes):
    small = ["--width", "320", "--height", "240", "--frames", "1", "--warmup", "0",
             "--threads", "2"]
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        futures = {(pipe, target): pool.submit(runs.run, "picture", pipe,
                                               scene_of(pipe, scenes), *small,
                                               target=target)
                   for pipe in PIPES for target in ("cuda", "cpu")}
    for pipe in PIPES:
        card, processor = (futures[pipe, target].result().get("image_hash", "none")
                           for target in ("cuda", "cpu"))
        same = card == processor != "none"
        print("same" if same else f"OTHER {card} {processor}", *pipe, flush=True)


def main():
    runs = Runs(sys.argv[1], float(sys.argv[2]))
    scenes = sorted(SCENES.glob("*.*"))
    if not scenes:
        sys.exit("frames.py: expected scenes in the kit: make.sh --scene FILE")
    check_pictures(runs, scenes)
    frames = ["--warmup", "5", "--frames", "60", "--seconds", "0.5"]

    def measure(label, pipe, scene, *options, **environment):
        say(label, pipe, scene, runs.run(label, pipe, scene, *frames, "--kernel-times",
                                         *options, **environment))

    for scene in scenes:
        for pipe in PIPES[:2]:
            measure("frame", pipe, scene)
    for scene in scenes:
        say("processor", PIPES[0], scene,
            runs.run("processor", PIPES[0], scene, *frames, target="cpu"))
    for alone in ("0", "512", "2048"):
        for scene in scenes:
            measure(f"alone {alone}", PIPES[0], scene, PIKO_CUDA_ALONE=alone)
    for pipe in PIPES[2:]:
        measure("frame", pipe, scene_of(pipe, scenes))
    for lights in ("10", "100", "1000"):
        for pipe in PIPES[:2]:
            measure("lights", pipe, scene_of(pipe, scenes), "--lights", lights)


if __name__ == "__main__":
    main()
