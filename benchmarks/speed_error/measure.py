# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Time and error of the settings of a choice on a scene."""

import json
import os
import shlex
import statistics
import sys
from dataclasses import dataclass, field

from commands import call
from speed_error.lod import Simplifier

METRICS = ["largest", "mean", "rms", "p99", "psnr", "flip"]


@dataclass
class Point:
    choice: str
    scene: str
    setting: str
    command: str  # that repeats it
    times: list[float] = field(default_factory=list)  # ms, one for each round
    errors: dict[str, float] = field(default_factory=dict)
    front: bool = False  # by rms
    image: str = ""
    map: str = ""  # of FLIP

    @property
    def ms(self):
        return statistics.median(self.times)

    def record(self):
        return {"choice": self.choice, "scene": self.scene,
                "setting": self.setting, "ms": f"{self.ms:.4g}",
                "least ms": f"{min(self.times):.4g}",
                "most ms": f"{max(self.times):.4g}",
                **{m: f"{self.errors[m]:.4g}" for m in METRICS},
                "front": int(self.front), "command": self.command}


@dataclass
class Scene:
    name: str
    words: list[str]  # the file and what options it needs

    @classmethod
    def parse(cls, text, root):
        words = shlex.split(text)
        if not words:
            raise ValueError("expected a scene to have a file")
        if os.path.exists(words[0]):  # Tools run in the tree's folder.
            file = os.path.abspath(words[0])
            words[0] = file.removeprefix(f"{root}/")
        return cls(os.path.splitext(os.path.basename(words[0]))[0], words)

    def is_patches(self):
        return self.words[0].endswith(".bpt")


def mark_front(points, metric="rms"):
    """Those that no other one is both faster and better than."""
    for point in points:
        point.front = not any(
            other.ms <= point.ms and
            other.errors[metric] <= point.errors[metric] and
            (other.ms < point.ms or
             other.errors[metric] < point.errors[metric])
            for other in points)


class Measurer:
    def __init__(self, options, root):
        self.options = options
        self.render = f"{options.bin}/piko-render"
        self.diff = f"{options.bin}/piko-diff"
        self.root = root
        self.folder = options.out
        self.simplifier = Simplifier(options, root)
        self.steps = 0  # that are done
        self.advance = lambda: None  # is called after each
        os.makedirs(f"{self.folder}/images", exist_ok=True)

    def count_steps(self, choice):
        """Of measure(): the reference, then each setting's picture and rounds."""
        return 1 + len(choice.settings) * (1 + self.options.rounds)

    def end_step(self):
        self.steps += 1
        self.advance()

    def size(self):
        return ["--width", str(self.options.width),
                "--height", str(self.options.height)]

    def can_measure(self, choice):
        """Says so, if something is not installed."""
        if not any(s.level for s in choice.settings) or self.simplifier.build():
            return True
        print(f"{choice.name}: expected libmeshoptimizer-dev to be installed",
              file=sys.stderr)
        return False

    def command(self, choice, setting, scene, tool):
        words = scene.words
        if setting.level:
            words = self.simplifier.words(scene, setting.level)
        return [*setting.command(tool), *words, *self.size(),
                *choice.options, "--threads", str(self.options.threads)]

    def draw(self, choice, setting, scene, *files):
        call([*self.command(choice, setting, scene, self.render), "--frames",
              "1", "--warmup", "0",
              *(word for file in files for word in ("--out", file))],
             cwd=self.root)

    def time(self, choice, setting, scene):
        line = call([*self.command(choice, setting, scene, self.render),
                     "--frames", str(self.options.frames), "--seconds",
                     str(self.options.seconds), "--warmup", "2", "--json"],
                    cwd=self.root)
        return json.loads(line)["ms_median"]

    def compare(self, reference, image, flip_map):
        line = call([self.diff, reference, image, "--json", "--map", flip_map])
        errors = json.loads(line)
        # Of equal images JSON has no number.
        errors["psnr"] = float("inf" if errors["psnr"] is None
                               else errors["psnr"])
        return {metric: errors[metric] for metric in METRICS}

    def measure(self, choice, scene):
        """Settings take turns, so that what slows the machine down hits all."""
        stem = f"{self.folder}/images/{choice.name}-{scene.name}"
        reference = f"{stem}-reference"
        self.draw(choice, choice.reference, scene, f"{reference}.exr",
                  f"{reference}.jpg")
        self.end_step()
        points = []
        for i, setting in enumerate(choice.settings):
            point = Point(choice.name, scene.name, setting.name,
                          shlex.join(self.command(choice, setting, scene,
                                                  "piko-render")))
            point.image, point.map = f"{stem}-{i}.jpg", f"{stem}-{i}-flip.jpg"
            self.draw(choice, setting, scene, f"{stem}-{i}.exr", point.image)
            point.errors = self.compare(f"{reference}.exr", f"{stem}-{i}.exr",
                                        point.map)
            os.remove(f"{stem}-{i}.exr")
            points.append(point)
            self.end_step()
        os.remove(f"{reference}.exr")
        for _ in range(self.options.rounds):
            for setting, point in zip(choice.settings, points):
                point.times.append(self.time(choice, setting, scene))
                self.end_step()
        mark_front(points)
        return points
