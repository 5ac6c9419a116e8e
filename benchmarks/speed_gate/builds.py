# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""The builds that are compared, and how that of another commit is made."""

import os
import subprocess
import sys
from dataclasses import dataclass, replace

from commands import call

TARGETS = ["piko-render", "pikoc", "pikort"]


@dataclass(frozen=True)
class Build:
    """Of a source tree, with what the measurements of other benchmarks ask for."""
    root: str
    bin: str
    lib: str
    work: str  # where bodies are built
    cpu: str
    scene: list[str]
    warmup: int
    frames: int
    seconds: float
    march: str | None = None  # of references, of which there are none

    def once(self):
        return replace(self, warmup=0, frames=1)


def find_commit(root, name):
    done = subprocess.run(
        ["git", "-C", root, "rev-parse", "--verify", "--quiet", f"{name}^{{commit}}"],
        capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"bench-gate: expected a commit, but got '{name}'")
    return done.stdout.strip()


def check_out(root, commit, folder):
    """A work tree that shares the repository, which stays for the next time."""
    if os.path.exists(f"{folder}/.git"):
        call(["git", "-C", folder, "checkout", "--quiet", "--detach", commit])
        return
    # Of a folder that somebody removed git would still know.
    call(["git", "-C", root, "worktree", "prune"])
    call(["git", "-C", root, "worktree", "add", "--quiet", "--detach", folder, commit])


def build_commit(root, name, folder, jobs):
    """Makes a commit's tools; returns where its tree is. As a build folder lies in
    its tree alike, relative paths are, and ccache knows what has not changed."""
    check_out(root, find_commit(root, name), folder)
    environment = {"CCACHE_BASEDIR": root, **os.environ}
    for command in (["cmake", "--preset", "release", "-D", "PIKO_UNITE=ON"],
                    ["cmake", "--build", "build", "--parallel", str(jobs),
                     "--target", *TARGETS]):
        done = subprocess.run(command, cwd=folder, env=environment,
                              stdout=sys.stderr)
        if done.returncode:
            sys.exit(f"bench-gate: {' '.join(command)} failed for '{name}'")
    return folder
