#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Gives piko-opt mutated modules, and passes in any order.

  piko-mutate.py --opt build/bin/piko-opt --count 100000 --seed 1
  piko-mutate.py --opt build/bin/piko-opt --count 1 --seed 4711 --show

A module of the tests, or a form of an example that `--pikoc` writes, gets a few of
its tokens deleted, copied, swapped or replaced, and numbers made extreme; then up to
eight passes run on it. It may be refused with an error. A crash, a failed assertion
or more than `--timeout` seconds is a failure. A run follows from its number, the
files and the list of passes; those with one sequence of passes share a process.
"""

import argparse
import concurrent.futures
import pathlib
import random
import re
import subprocess
import sys
import tempfile
from collections import Counter

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
TOKEN = re.compile(
    r'"[^"\n]*"|[%@^!#][\w$.:-]+|-?\d+\.\d+(?:[eE][+-]?\d+)?|-?0x[0-9a-fA-F]+|-?\d+'
    r"|[A-Za-z_][\w.]*|->|[^\s\w]"
)
NUMBER = re.compile(r"-?\d")
EXTREMES = (
    "0 1 -1 2 63 64 65 255 256 65535 65536 1048576 2147483647 -2147483648 4294967295 "
    "4294967296 9223372036854775807 -9223372036854775808 9223372036854775808 "
    "18446744073709551615 340282366920938463463374607431768211456 0.0 -0.0 1.0e+30 "
    "3.4e+38 1.0e+400 1.0e-400 0x7FC00000 0x7F800000"
).split()
LONGEST = 60_000  # characters of a module
SEQUENCES = (
    "piko-synthesize piko-to-machine piko-to-units piko-to-cpu piko-cpu-to-llvm "
    "piko-to-gpu piko-gpu-to-nvvm"
).split()
UPSTREAM = "canonicalize cse loop-invariant-code-motion symbol-dce".split()


def passes_of(opt):
    """The project's passes and sequences, and upstream's that they run."""
    text = subprocess.run([opt, "--help"], capture_output=True, text=True).stdout
    found = re.findall(r"^ +--((?:convert-)?piko-[\w-]+|convert-gpu-to-[\w-]+)", text, re.M)
    return sorted(set(found) | set(SEQUENCES) | set(UPSTREAM))


def corpus_of(pikoc):
    modules = []
    for path in sorted((ROOT / "test").glob("**/*.mlir")):
        modules += re.split(r"^// -----.*$", path.read_text(), flags=re.M)
    if pikoc:
        for source in sorted((ROOT / "examples").glob("*/*.piko.cpp")):
            names = subprocess.run(
                [pikoc, "--list-pipes", source], capture_output=True, text=True
            ).stdout.split()
            for form in ("authored", "kernels", "machine"):
                modules.append(subprocess.run(
                    [pikoc, f"--emit={form}", "--pipe", names[0], source],
                    capture_output=True, text=True).stdout)
    # Comments are no part of a module; checks would be noise.
    plain = [re.sub(r"^\s*//.*\n", "", module, flags=re.M) for module in modules]
    return [module for module in plain if module.strip() and len(module) <= LONGEST]


def mutate(text, pool, rng):
    """Changes one to six places."""
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3, 4, 6))):
        lines = text.split("\n")
        if rng.random() < 0.2:
            at = rng.randrange(len(lines))
            action = rng.randrange(3)
            if action == 0:
                del lines[at]
            elif action == 1:
                lines.insert(rng.randrange(len(lines) + 1), lines[at])
            else:
                other = rng.randrange(len(lines))
                lines[at], lines[other] = lines[other], lines[at]
            text = "\n".join(lines)
            continue
        tokens = list(TOKEN.finditer(text))
        if not tokens:
            return text
        token = rng.choice(tokens)
        numbers = [t for t in tokens if NUMBER.match(t.group())]
        action = rng.randrange(6)
        if action == 0:
            new = ""
        elif action == 1:
            new = token.group() + " " + token.group()
        elif action == 2:
            new = rng.choice(tokens).group()
        elif action == 3:
            new = rng.choice(pool)
        elif numbers:
            token, new = rng.choice(numbers), rng.choice(EXTREMES)
        else:
            new = rng.choice(EXTREMES)
        text = text[: token.start()] + new + text[token.end():]
    return text


class Fuzzer:
    def __init__(self, args):
        self.args = args
        self.passes = passes_of(args.opt)
        self.corpus = corpus_of(args.pikoc)
        tokens = {t for module in self.corpus for t in TOKEN.findall(module)}
        self.pool = sorted(tokens)

    def sequence(self, batch):
        """The passes of a batch."""
        rng = random.Random(f"passes {batch}")
        return rng.choices(self.passes, k=rng.randrange(9))

    def module(self, seed):
        rng = random.Random(f"module {seed}")
        return mutate(rng.choice(self.corpus), self.pool, rng)

    def run(self, passes, modules, seconds):
        """How piko-opt ends: "" if as it should."""
        with tempfile.NamedTemporaryFile("w", suffix=".mlir") as file:
            file.write("\n// -----\n".join(modules))
            file.flush()
            command = [self.args.opt, "--split-input-file", "--mlir-disable-threading",
                       *("--" + name for name in passes), file.name, "-o", "/dev/null"]
            try:
                done = subprocess.run(command, capture_output=True, text=True,
                                      errors="replace", timeout=seconds)
            except subprocess.TimeoutExpired:
                return "hangs"
        if done.returncode in (0, 1):
            return ""
        lines = [line for line in done.stderr.splitlines()
                 if "Assertion" in line or "LLVM ERROR" in line or "UNREACHABLE" in line]
        return f"ends with {done.returncode} {lines[:1]}"

    def keep(self, seeds, passes, modules):
        """Writes what failed to a file that piko-opt can read."""
        if self.args.keep:
            self.args.keep.mkdir(parents=True, exist_ok=True)
            command = "// piko-opt --split-input-file " + " ".join("--" + p for p in passes)
            (self.args.keep / f"{seeds[0]}.mlir").write_text(
                command + "\n" + "\n// -----\n".join(modules))

    def batch(self, number):
        """The runs of a batch that fail, and how."""
        size = self.args.batch
        seeds = range(number * size, min((number + 1) * size, self.args.end))
        seeds = [seed for seed in seeds if seed >= self.args.seed]
        passes = self.sequence(number)
        modules = [self.module(seed) for seed in seeds]
        together = self.run(passes, modules, self.args.timeout * len(modules))
        if not together:
            return []
        failures = []
        for seed, module in zip(seeds, modules):
            if how := self.run(passes, [module], self.args.timeout):
                failures.append((seed, passes, how))
                self.keep([seed], passes, [module])
        if not failures:
            failures = [(seeds[0], passes, f"{together}, one process with {len(seeds)} runs")]
            self.keep(seeds, passes, modules)
        return failures


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--opt", required=True, help="piko-opt")
    parser.add_argument("--pikoc", help="writes forms of the examples, to mutate")
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1, help="the first run's number")
    parser.add_argument("--batch", type=int, default=40, help="runs in a process")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--timeout", type=float, default=20, help="seconds a run")
    parser.add_argument("--keep", type=pathlib.Path, help="a folder for what failed")
    parser.add_argument("--show", action="store_true", help="print runs, do not run them")
    args = parser.parse_args()
    args.end = args.seed + args.count
    fuzzer = Fuzzer(args)
    if args.show:
        for seed in range(args.seed, args.end):
            print("// piko-opt", *("--" + p for p in fuzzer.sequence(seed // args.batch)))
            print(fuzzer.module(seed))
        return 0
    batches = range(args.seed // args.batch, (args.end - 1) // args.batch + 1)
    ways = Counter()
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        for failures in pool.map(fuzzer.batch, batches):
            for seed, passes, how in failures:
                ways[how] += 1
                print(f"{seed}: {how}: {' '.join('--' + name for name in passes)}", flush=True)
    print(f"{args.count} runs, {sum(ways.values())} failed")
    return 1 if ways else 0


if __name__ == "__main__":
    sys.exit(main())
