#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What each optional pass changes, and what that is worth: an ablation.

  ablate.py [options] [TEXT..]

Compiles each pipeline of the examples, of benchmarks/bodies and of test/EndToEnd, or
of the texts named, for a CPU and for a GPU (`pikoc --emit=target`, `--emit=gpu`), with
all passes and without each of those that --without takes. A pipeline is changed where
more than --least lines are, names of values aside: leaving a pass out leaves out the
canonicalization after it, too. Of the examples and bodies that a pass changes most,
--times are run with it and without it, in turn; a ratio above 1 is what the pass gains.
For GPUs, --works are run by the driver for tests, and the warp instructions compared:
examples by a small frame of piko-render, other texts by piko-compare's made-up input.

Prints a table in Markdown, a pass a row; a text is a file. Ends with an error where a
pass changes fewer than --fewest texts, unless --report.
"""

import argparse
import json
import os
import re
import shlex
import statistics
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "benchmarks"))

import bodies  # noqa: E402
from suite import kernels  # noqa: E402
from tool import run_main

# LLVM's own change no dialect of MLIR.
OF_LLVM = {"loop-vectorize", "slp-vectorizer"}
BUNNY = "/usr/share/glmark2/models/bunny.obj"
EMISSIONS = ("target", "gpu")


@dataclass
class Text:
    """A file, and what pikoc needs to read it."""
    file: Path
    options: list[str]
    group: str


@dataclass(eq=False)
class Pipeline:
    text: Text
    name: str
    authored: Path | None = None
    lines: dict = field(default_factory=dict)  # by emission: those of all passes
    changed: dict = field(default_factory=dict)  # by emission and pass: how many lines

    def label(self):
        stem = self.text.file.name.removesuffix(".cpp").removesuffix(".piko")
        return f"{stem}/{self.name}"


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("texts", nargs="*", metavar="TEXT", type=Path)
    parser.add_argument("--build", type=Path, default=ROOT / "build",
                        help="where pikoc is built (%(default)s)")
    parser.add_argument("--cpu", default="native", help="(%(default)s)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--sample", type=int, default=1, metavar="N",
                        help="of test/EndToEnd, every Nth file (%(default)s)")
    parser.add_argument("--pipes", type=int, metavar="N",
                        help="of each text, the first N pipelines (all)")
    parser.add_argument("--emit", choices=EMISSIONS, action="append", metavar="WHAT",
                        help="target or gpu (both)")
    parser.add_argument("--passes", help="of these alone, between commas")
    parser.add_argument("--least", type=int, default=4, metavar="LINES",
                        help="of a pipeline that change at most where it is as it "
                             "was (%(default)s)")
    parser.add_argument("--fewest", type=int, default=3, metavar="TEXTS",
                        help="that a pass pays on (%(default)s)")
    parser.add_argument("--times", type=int, default=3, metavar="PIPELINES",
                        help="that are run for each pass (%(default)s)")
    parser.add_argument("--works", type=int, default=3, metavar="PIPELINES",
                        help="whose work on a GPU is counted for each pass "
                             "(%(default)s)")
    parser.add_argument("--rounds", type=int, default=5, help="(%(default)s)")
    parser.add_argument("--threads", type=int, default=os.cpu_count(),
                        help="of what is run (%(default)s)")
    parser.add_argument("--report", action="store_true",
                        help="no error where a pass pays on too few")
    return parser.parse_args()


def run(command, environment=None):
    """What a command prints, or None where it fails."""
    done = subprocess.run([str(part) for part in command], capture_output=True,
                          text=True, env=environment)
    return done.stdout if done.returncode == 0 else None


def list_texts(arguments):
    examples = [Text(file, [], "examples")
                for file in sorted(ROOT.glob("examples/*/*.piko.cpp"))]
    measured = [Text(Path(bodies.get_source(body)), bodies.get_includes(), "bodies")
                for body in bodies.find_bodies()]
    tests = [Text(file, [], "tests")
             for file in sorted(ROOT.glob("test/EndToEnd/*/*.cpp"))
             [::arguments.sample]]
    texts = examples + measured + tests
    if not arguments.texts:
        return texts
    known = {text.file.resolve(): text for text in texts}
    for file in arguments.texts:
        if not file.is_file():
            sys.exit(f"ablate: expected a file, but got '{file}'")
    return [known.get(file.resolve(), Text(file, [], "texts"))
            for file in arguments.texts]


def list_passes(arguments):
    """Those that the error of a wrong name lists."""
    done = subprocess.run([arguments.build / "bin/pikoc", "--without", "?", "-"],
                          capture_output=True, text=True)
    found = re.search(r"expected passes of (.*), but got", done.stderr)
    if not found:
        sys.exit(f"ablate: expected a list of passes, but got {done.stderr!r}")
    passes = [name for name in found[1].split(", ") if name not in OF_LLVM]
    if not arguments.passes:
        return passes
    wanted = arguments.passes.split(",")
    for name in wanted:
        if name not in passes:
            sys.exit(f"ablate: expected one of {', '.join(passes)}, but got '{name}'")
    return wanted


class Ablation:
    def __init__(self, arguments, folder):
        self.pikoc = arguments.build / "bin/pikoc"
        self.least, self.folder = arguments.least, Path(folder)
        self.pipes, self.emissions = arguments.pipes, arguments.emit or EMISSIONS
        self.cpu = arguments.cpu
        self.passes = list_passes(arguments)

    def read(self, text):
        """The pipelines of a text; none where it has errors, as some tests do."""
        names = run([self.pikoc, "--list-pipes", text.file, *text.options])
        made = []
        for name in (names or "").split()[:self.pipes]:
            pipeline = Pipeline(text, name)
            out = self.folder / f"{text.group}-{text.file.stem}-{name}.mlir"
            if run([self.pikoc, text.file, *text.options, "--pipe", name,
                    "--emit=authored", "-o", out]) is not None:
                pipeline.authored = out
                made.append(pipeline)
        return made

    def compile(self, pipeline, emission, without=None):
        """Its lines, without names; None where it is refused."""
        options = ["--without", without] if without else []
        if emission == "target":
            options += ["--cpu", self.cpu]
        text = run([self.pikoc, pipeline.authored, f"--emit={emission}", "-o", "-",
                    *options])
        if text is None:
            return None
        return Counter(re.sub(r"[%@#][\w.$:#]+", "", line).strip()
                       for line in text.splitlines())

    def compare(self, pipeline):
        for emission in self.emissions:
            whole = self.compile(pipeline, emission)
            if whole is None:
                continue
            pipeline.lines[emission] = whole.total()
            for name in self.passes:
                other = self.compile(pipeline, emission, name)
                if other is None:
                    continue
                lines = max((whole - other).total(), (other - whole).total())
                if lines > self.least:
                    pipeline.changed[emission, name] = lines
        return pipeline


class Timer:
    """Runs what is measured elsewhere: frames of examples, and bodies."""

    def __init__(self, arguments, folder):
        self.bin, self.lib = f"{arguments.build}/bin", f"{arguments.build}/lib"
        self.root, self.work = str(ROOT), folder
        self.cpu, self.rounds = arguments.cpu, arguments.rounds
        self.threads = arguments.threads
        self.scene, self.march = [BUNNY], None
        self.warmup, self.frames, self.seconds = 6, 11, 0.4

    def can_run(self, pipeline):
        text = pipeline.text
        if text.group == "bodies":
            return True
        return text.group == "examples" and os.path.exists(BUNNY) and \
            text.file.parent.name in kernels.PIPELINES

    def measure(self, pipeline, without):
        """The median ratio of a frame without a pass to one with it, and the
        milliseconds of the latter."""
        options = ["--without", without]
        if pipeline.text.group == "bodies":
            body = pipeline.text.file.name.removesuffix(".piko.cpp")
            builds = {"default": [], "ablated": [f"--without={without}"]}
            bodies.build_compiled(self, body, builds)
            times = bodies.measure_rounds(self, body, builds, self.threads)
            pairs = list(zip(times["default"], times["ablated"]))
        else:
            example = pipeline.text.file.parent.name
            threads = ["--threads", str(self.threads)]
            pairs = [tuple(kernels.render(self, example, pipeline.name,
                                          [*threads, *more])["ms_median"]
                           for more in ([], options)) for _ in range(self.rounds)]
        return (statistics.median(b / a for a, b in pairs),
                statistics.median(a for a, _ in pairs))


class WorkCounter:
    """Counts what a GPU has to do, by the driver for tests."""

    def __init__(self, arguments, folder):
        self.build, self.counts = arguments.build, Path(folder) / "counts.json"
        self.environment = {
            **os.environ,
            "PIKO_CACHE_DIR": f"{folder}/cache",
            "PIKO_CUDA_DRIVER": str(arguments.build / "lib/libpiko-test-driver.so"),
            "PIKO_TEST_DRIVER_COUNTS": str(self.counts)}
        self.known = {}  # by pipeline and pass

    def get_command(self, pipeline):
        text = pipeline.text
        example = text.file.parent.name
        if text.group == "examples" and example in kernels.PIPELINES:
            scene = f"{ROOT}/{kernels.KNOT}" if example == "reyes" else BUNNY
            return ["piko-render", text.file, *shlex.split(scene), "--pipe",
                    pipeline.name, *kernels.PIPELINES[example][1], "--target", "cuda",
                    "--width", 256, "--height", 192, "--frames", 1, "--warmup", 0]
        return ["piko-compare", text.file, "--pipe", pipeline.name, "--target", "cuda",
                "--runs", 1, "--threads", 1]

    def count(self, pipeline, without=None):
        """The warp instructions of all kernels; None where it does not run."""
        if (pipeline, without) not in self.known:
            tool, *rest = self.get_command(pipeline)
            options = ["--without", without] if without else []
            self.counts.unlink(missing_ok=True)
            done = run([self.build / "bin" / tool, *rest, *options], self.environment)
            counted = done is not None and self.counts.exists()
            self.known[pipeline, without] = sum(
                kernel["warpInstructions"]
                for kernel in json.loads(self.counts.read_text())["kernels"].values()
            ) if counted else None
        return self.known[pipeline, without]


def count_work(counter, pipelines, name, most):
    """Of different texts that a pass changes most, the ratio of the work without it,
    and the work."""
    found, texts = [], set()
    for pipeline in find_changed(pipelines, name, "gpu"):
        if len(found) == most:
            break
        if pipeline.text.file in texts:
            continue
        texts.add(pipeline.text.file)
        work, other = counter.count(pipeline), counter.count(pipeline, name)
        if work and other:
            found.append((pipeline, other / work, work))
    return found


def find_changed(pipelines, name, emission):
    return sorted((p for p in pipelines if (emission, name) in p.changed),
                  key=lambda p: -p.changed[emission, name] / p.lines[emission])


def measure(timer, pipelines, name, count):
    """Of different texts, those that a pass changes most."""
    found, texts = [], set()
    for pipeline in find_changed(pipelines, name, "target"):
        if len(found) == count:
            break
        if pipeline.text.file not in texts and timer.can_run(pipeline):
            texts.add(pipeline.text.file)
            found.append((pipeline, *timer.measure(pipeline, name)))
    return found


def count_texts(pipelines, group=None):
    return len({p.text.file for p in pipelines if group in (None, p.text.group)})


def main():
    arguments = parse_arguments()
    with tempfile.TemporaryDirectory() as folder:
        ablation = Ablation(arguments, folder)
        with ThreadPoolExecutor(arguments.jobs) as pool:
            read = pool.map(ablation.read, list_texts(arguments))
            pipelines = [pipeline for several in read for pipeline in several]
            pipelines = list(pool.map(ablation.compare, pipelines))
        timer, counter = Timer(arguments, folder), WorkCounter(arguments, folder)
        rows = [(name, measure(timer, pipelines, name, arguments.times),
                 count_work(counter, pipelines, name, arguments.works))
                for name in ablation.passes]
    print(f"{len(pipelines)} pipelines of {count_texts(pipelines)} texts.\n")
    groups = list(dict.fromkeys(p.text.group for p in pipelines))
    heads = ["pass", "CPU", "GPU", "texts", *(f"of {g}" for g in groups),
             "without it, a frame takes", "and a GPU's warps do"]
    print("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
    few = []
    for name, times, works in rows:
        changed = {e: find_changed(pipelines, name, e) for e in EMISSIONS}
        either = {*changed["target"], *changed["gpu"]}
        if count_texts(either) < arguments.fewest:
            few.append(name)
        said = "; ".join(f"{p.label()} {ratio:.2f} of {ms:.3g} ms"
                         for p, ratio, ms in times)
        counted = "; ".join(f"{p.label()} {ratio:.2f} of {work / 1e6:.3g} million"
                            for p, ratio, work in works)
        cells = [name, *(len(changed[e]) for e in EMISSIONS), count_texts(either),
                 *(count_texts(either, group) for group in groups), said, counted]
        print("| " + " | ".join(map(str, cells)) + " |")
    if few and not arguments.report:
        sys.exit("ablate: expected each pass to change "
                 f"{arguments.fewest} texts, but these do not: {', '.join(few)}")


if __name__ == "__main__":
    run_main(main)
