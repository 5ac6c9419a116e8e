# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Runs piko-compare on a file of pipelines and says how each of them ended."""

import contextlib
import hashlib
import os
import random
import re
import subprocess
import tempfile
from pathlib import Path

import cpp
import dialect

EQUAL, BLANK = "equal", "equal, but blank"


#: What piko-compare may leave out of synthesis.
PASSES = ["pre-schedule", "infer-directives", "fuse-stages", "test-early", "prune",
          "own-pixels", "eliminate-schedules", "fuse-kernels", "form-gbuffer",
          "defer-shading", "form-tiles", "prefetch", "vectorize", "prove-bounds",
          "lockstep", "flatten-nests", "merge-nests", "compact-loops",
          "hoist-loads", "hoist-bounds", "merge-bounds", "combine-bounds", "thread-jumps",
          "narrow-integers", "merge-gathers", "pair-gathers", "if-convert",
          "unswitch-versions",
          "uplift-pixel-loops", "privatize", "reduce-updates",
          "reduce-by-atomics",
          "share-appends", "collapse-pixels", "group-updates", "share-by-count", "compact-work",
          "split-rare"]


def options_of(passes):
    # What is ours after the dialect works on vectors.
    level = ["-O0"] if "vectorize" in passes else []
    return ["--without", ",".join(passes), *level] if passes else []


def choose_passes(seed):
    """What the file that begins with this pipeline is compiled without: mostly
    nothing."""
    r = random.Random(seed)
    return [p for p in PASSES if r.random() < 0.4] if r.random() < 0.4 else []


def gpu_options(seed, target):
    """How the file that begins with this pipeline runs on a GPU, or on either
    kind."""
    r = random.Random(seed)
    if target == "any":
        target = r.choice(["cuda", "gpu-on-cpu"])
    # In PTX such large blocks may lack memory.
    large = [] if target == "cuda" else [512, 1024]
    threads = ["--gpu-threads", str(r.choice([1, 8, 32, 64, 128, *large]))]
    order = ["--gpu-seed", str(r.randrange(1000)),
             "--gpu-blocks", str(r.choice([0, 1, 3, 7]))]
    return ["--target", target, *threads, *(order if target != "cuda" else [])]


def case_of(pipe):
    return (f"--pipe {pipe.name} --domain {' '.join(map(str, pipe.domain))} "
            f"--count {' '.join(map(str, pipe.counts))} --seed {pipe.input_seed} --wide")


def simplify(verdict):
    """A stage that is not strict gives the same bits in all runs; how far they are
    from the reference's does not matter."""
    lines = verdict.splitlines()
    every = " in all runs"
    return lines[-1].removesuffix(every) if lines and lines[-1].endswith(every) \
        else verdict


def kind_of(verdict):
    """What makes two failures the same one: the words without what varies."""
    first = verdict.splitlines()[0] if verdict else ""
    if "differs" in verdict:
        return "differs"
    first = next((l for l in verdict.splitlines() if "error:" in l and ".cpp:" in l
                  or "expected:" in l or "got:" in l), first)
    first = re.sub(r"^.*?(error:|got:|expected:)", r"\1", first)
    return re.sub(r"'[^']*'|\d+", "", first)


def write(path, text):
    """At once: another run may read the same file in a folder that is kept."""
    with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False) as file:
        file.write(text)
    os.replace(file.name, path)


class Runner:
    """With `text` what is compiled is the text of the dialect, not the C++; the
    `passes` are left out; `target` are options that say what it runs on. With
    `keep`, files stay in that folder, by what they hold."""

    def __init__(self, tool, text=False, passes=(), threads=(1, 2, 7), timeout=120,
                 strip=0, target=(), keep=None):
        self.target, self.keep = list(target), keep
        self.tool, self.text, self.passes = tool, text, passes
        self.strip = strip
        self.threads, self.timeout = threads, timeout

    def run(self, pipes):
        """The verdict on each pipeline, in their order."""
        text = cpp.write_file(pipes)
        with self.folder_of(text) as folder:
            file = Path(folder) / "pipelines.cpp"
            write(file, text)
            if self.text:
                write(file.with_suffix(".mlir"), dialect.write_file(pipes))
            verdicts = self.compare(file, pipes)
            # A crash ends the process, and the pipelines after it wait.
            while len(verdicts) < len(pipes):
                verdicts += self.compare(file, pipes[len(verdicts):])
            return verdicts

    def folder_of(self, text):
        if not self.keep:
            return tempfile.TemporaryDirectory()
        folder = Path(self.keep) / hashlib.sha256(text.encode()).hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        return contextlib.nullcontext(folder)

    def compare(self, file, pipes):
        """At least one verdict, in order; the last one may be of a crash."""
        cases = file.with_suffix(".cases")
        write(cases, "".join(case_of(p) + "\n" for p in pipes))
        try:
            done = subprocess.run(
                [self.tool, file.with_suffix(".mlir") if self.text else file,
                 "--reference", file, "--cases", cases, "--runs", "1", "--timeout",
                 str(self.timeout), "--strip", str(self.strip), "--threads", *map(str, self.threads),
                 *options_of(self.passes), *self.target],
                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                errors="replace", timeout=self.timeout * 20)
            output, errors, status = done.stdout, done.stderr, done.returncode
        except subprocess.TimeoutExpired:
            output, errors, status = "", "", -14
        verdicts = []
        for line in output.splitlines():
            if re.fullmatch(r"(P|Random)\d+:", line):
                verdicts.append("")
            elif verdicts:
                verdicts[-1] += line + "\n"
        verdicts = [simplify(v.strip()) for v in verdicts]
        if len(verdicts) == len(pipes) and verdicts[-1]:
            return verdicts
        if verdicts:  # the last one did not end
            verdicts[-1] = f"error: the process ended with status {status}\n{errors[-2000:]}"
            return verdicts
        if len(pipes) == 1:
            return [f"error: status {status}\n{errors[-3000:]}"]
        # Something in the file itself: divide it.
        half = len(pipes) // 2
        return self.run(pipes[:half]) + self.run(pipes[half:])
