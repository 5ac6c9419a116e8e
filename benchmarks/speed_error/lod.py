# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Levels of detail of meshes, by benchmarks/lod/simplify.cpp."""

import argparse
import os
import subprocess
import sys
from dataclasses import dataclass

from commands import call

SOURCE = "benchmarks/lod/simplify.cpp"


@dataclass(frozen=True)
class Level:
    """How far a mesh may be off."""

    pixels: float
    cluster: int = 0  # triangles of what has a level of its own; 0: the mesh


def parse_view(words):
    """What a scene's options say of the camera, and the mesh's file."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--fovy", default="45")
    parser.add_argument("--eye", nargs=3, default=[])
    view, _ = parser.parse_known_args(words[1:])
    return words[0], [view.fovy, *view.eye]


class Simplifier:
    def __init__(self, options, root):
        self.root = root
        self.folder = f"{options.out}/meshes"
        self.size = [str(options.width), str(options.height)]
        self.program = None
        self.meshes = {}

    def build(self):
        """False where meshoptimizer is not installed."""
        os.makedirs(self.folder, exist_ok=True)
        self.program = f"{self.folder}/simplify"
        done = subprocess.run(
            ["g++", "-std=c++20", "-O2", SOURCE, "-o", self.program, "-lassimp",
             "-lmeshoptimizer"], capture_output=True, text=True, cwd=self.root)
        if done.returncode:
            print(done.stderr, file=sys.stderr)
        return done.returncode == 0

    def words(self, scene, level):
        """Those of a scene, with another mesh."""
        if (scene.name, level) not in self.meshes:
            mesh, view = parse_view(scene.words)
            file = f"{self.folder}/{scene.name}-{level.pixels}-{level.cluster}.obj"
            call([self.program, mesh, file, str(level.pixels),
                  str(level.cluster), *self.size, *view], cwd=self.root)
            self.meshes[scene.name, level] = file.removeprefix(f"{self.root}/")
        return [self.meshes[scene.name, level], *scene.words[1:]]
