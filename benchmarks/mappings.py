#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Lane mappings as they are expected, as they are measured, and which is best.

  mappings.py [options] [NAME..]

Compiles each variant of the examples and each body of benchmarks/bodies with both
versions of every loop that lanes may share (--mapping-window 1000), and runs each
kernel with all versions of its loops: as vectors of primitives, of iterations, or
one after the other. Runs take turns. Prints a table in Markdown, a loop a row:

  expected   vectors' time over that of the scalar loop, by the cost model
  measured   the same, as the clock has it
  choice     the regret of what the cost model chooses: the time of the kernel, or
             of the body's frame, over that with the best versions of all its loops
  runtime    the regret of what the runtime chooses

and how many choices are within 5 % and within 15 % of the best. Ways of choosing
that come to the same versions have the same time: it is the same code. What takes
less than --least milliseconds is left out, and counted.

With --fit the numbers of the cost model (Vectorize/Cost/LaneCycles.cpp of
lib/Transforms) are fitted to the ratios that were measured, by damped Gauss-Newton
steps on the logarithms of the ratios of expected to measured time with a prior that
holds each number where it is, and printed as they belong into that file.
"""

import argparse
import glob
import json
import math
import os
import statistics
import subprocess
import sys

from bodies import CXX, find_bodies, get_includes, get_openmp, get_source
from commands import call, run_main
from outputs import write_text

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
EXAMPLES = ["raster", "visibility", "shadow", "oit", "raytrace", "reyes"]
BUNNY = "/usr/share/glmark2/models/bunny.obj"
KNOT = f"{ROOT}/examples/reyes/knot.bpt"
SCENES = {"reyes": [KNOT], "raytrace": [BUNNY, "--ground"],
          "shadow": [BUNNY, "--ground"]}
EVERYTHING = "1000"  # as a window: all loops are held in two versions
LANES = {"x86-64-v4": 16, "x86-64-v3": 8, "x86-64": 4}


def parse_arguments():
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME",
                        help="examples, their pipelines (raster.Fused) and bodies "
                             "(all)")
    parser.add_argument("--bin", default=f"{ROOT}/build/bin")
    parser.add_argument("--lib", default=f"{ROOT}/build/lib")
    parser.add_argument("--work", default=f"{ROOT}/build/mappings")
    parser.add_argument("--cpu", default="x86-64-v4", choices=LANES,
                        help="(%(default)s)")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--frames", type=int, default=7)
    parser.add_argument("--lights", default="10")
    parser.add_argument("--least", type=float, default=0.05,
                        help="milliseconds of a kernel (%(default)s)")
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--json", metavar="FILE",
                        help="keep what was measured")
    return parser.parse_args()


def name_of(mapping):
    return f"{mapping['kernel']}:{mapping['number']}"


class Example:
    """A pipeline of an example; its kernels are timed one by one."""

    def __init__(self, arguments, example, pipe):
        self.arguments = arguments
        self.name = f"{example} {pipe}"
        self.file = f"{ROOT}/examples/{example}/{example}.piko.cpp"
        self.pipe = pipe
        self.scene = SCENES.get(example, [BUNNY])

    def run(self, setting):
        """The report of kernels with a setting of mappings. What the runtime tries
        is over before what is timed."""
        warmup, seconds = ("30", "2") if setting == "measured" else ("2", "0.4")
        report = json.loads(call([
            f"{self.arguments.bin}/piko-render", self.file, *self.scene,
            "--pipe", self.pipe, "--cpu", self.arguments.cpu, "--json",
            "--lights", self.arguments.lights, "--threads", "1",
            "--warmup", warmup, "--frames", str(self.arguments.frames),
            "--seconds", seconds,
            "--mapping-window", EVERYTHING, "--mappings", setting]))
        for kernel in report["kernels"]:
            for mapping in kernel.get("mappings", []):
                mapping["kernel"] = kernel["name"]
        return [{"name": kernel["name"],
                 "ms": kernel["ms"] - kernel["join_ms"] - kernel["wait_ms"],
                 "mappings": kernel.get("mappings", [])}
                for kernel in report["kernels"]]

    def estimate(self):
        return print_sensitivities(
            self.arguments, [self.file, "--pipe", self.pipe])


class Body:
    """A body; its frame is timed. It has one kernel that matters."""

    def __init__(self, arguments, body):
        self.arguments = arguments
        self.name = body
        self.file = get_source(body)
        self.program = f"{arguments.work}/{body}"
        header = f"{self.program}.h"
        call([f"{arguments.bin}/pikoc", self.file, "-o", f"{self.program}.o",
              "--header", header, "--cpu", arguments.cpu,
              "--mapping-window", EVERYTHING])
        call(["g++", *CXX, *get_includes(), f'-DPIKO_BODY_HEADER="{header}"',
              "-c", self.file, "-o", f"{self.program}.host.o"])
        call(["g++", f"{self.program}.host.o", f"{self.program}.o",
              f"-L{arguments.lib}", "-lpikort", get_openmp(),
              f"-Wl,-rpath,{arguments.lib}", "-o", self.program])

    def run(self, setting):
        done = subprocess.run(
            [self.program, "0.25", "1", "--mappings"], capture_output=True,
            text=True, env=os.environ | {"PIKO_MAPPINGS": setting})
        if done.returncode:
            sys.exit(f"{self.program}\n{done.stderr}")
        first, *lines = done.stdout.splitlines()
        return [{"name": self.name, "ms": float(first.split()[1]),
                 "mappings": [json.loads(line) for line in lines]}]

    def estimate(self):
        return print_sensitivities(self.arguments, [self.file])


def name_kernel(symbol):
    """The runtime's name of a kernel: source_1_a of a's is a.assign1."""
    kind, _, rest = symbol.partition("_")
    if kind == "source":
        number, _, stage = rest.partition("_")
        return f"{stage}.assign{number}"
    return rest


def print_sensitivities(arguments, options):
    """What estimates depend on, loop by loop."""
    machine = call([f"{arguments.bin}/pikoc", *options, "--emit=machine",
                    "--cpu", arguments.cpu, "-o", "-"])
    done = subprocess.run(
        [f"{arguments.bin}/piko-opt", "-o", "/dev/null",
         f"--piko-to-cpu=lanes={LANES[arguments.cpu]} window={EVERYTHING} "
         "sensitivities"], input=machine, capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    found = [json.loads(line) for line in done.stdout.splitlines()
             if line.startswith("{")]
    return {f"{name_kernel(one['kernel'])}:{one['number']}": one
            for one in found}


def find_cases(arguments):
    wanted = set(arguments.names)
    for example in EXAMPLES:
        if wanted and not any(name.split(".")[0] == example
                              for name in wanted):
            continue
        file = f"{ROOT}/examples/{example}/{example}.piko.cpp"
        for pipe in call([f"{arguments.bin}/pikoc", "--list-pipes",
                          file]).split():
            if wanted and not wanted & {example, f"{example}.{pipe}"}:
                continue
            yield Example(arguments, example, pipe)
    for body in find_bodies():
        if not wanted or body in wanted:
            yield Body(arguments, body)


def write_setting(choice):
    return ",".join(["expected"] + [f"{name}={version}"
                                    for name, version in choice.items()])


def is_in_play(mapping, choice, mappings):
    """Whether a loop runs: no loop around it is one of vectors."""
    within = mapping.get("within", -1)
    if within < 0:
        return True
    outer = next(other for other in mappings if other["number"] == within
                 and other["kernel"] == mapping["kernel"])
    return (choice[name_of(outer)] == "scalar"
            and is_in_play(outer, choice, mappings))


def run_in_turn(case, settings, rounds):
    """What kernels report under each setting, by their names: a list each."""
    reports = {setting: {} for setting in settings}
    for _ in range(rounds):
        for setting in settings:
            for kernel in case.run(setting):
                reports[setting].setdefault(kernel["name"], []).append(kernel)
    return reports


def measure_settings(case, settings, rounds):
    """The median milliseconds of each kernel under each setting, in turn."""
    return {setting: {name: statistics.median(one["ms"] for one in list_)
                      for name, list_ in kernels.items()}
            for setting, kernels in run_in_turn(case, settings, rounds).items()}


def find_versions(kernel):
    """Which versions of its loops a kernel ran: what is the same code."""
    choice = {name_of(m): m["runs"] for m in kernel["mappings"]}
    return frozenset((name_of(m), m["runs"]) for m in kernel["mappings"]
                     if is_in_play(m, choice, kernel["mappings"]))


def find_regrets(reports):
    """How much longer each way of choosing takes than the best one, of reports by
    ways, and the least milliseconds. Runs of the same versions are one sample."""
    samples = {}
    for kernels in reports.values():
        for kernel in kernels:
            samples.setdefault(find_versions(kernel), []).append(kernel["ms"])
    medians = {versions: statistics.median(times)
               for versions, times in samples.items()}
    # What the runtime tried in one run alone is no sample.
    least = min(medians[versions] for versions, times in samples.items()
                if len(times) > 1)
    return {way: statistics.median(medians[find_versions(kernel)]
                                   for kernel in kernels) / least - 1
            for way, kernels in reports.items()}, least


class Descent:
    """The search for the best versions of a kernel's loops: one loop after the
    other changes, as long as that gains something."""

    def __init__(self, kernel):
        self.name = kernel["name"]
        self.mappings = kernel["mappings"]
        self.expected = {name_of(m): m["runs"] for m in self.mappings}
        self.choice = dict(self.expected)
        self.ratios = {}
        self.isDone = False

    def list_settings(self):
        """The choice, and those that differ in one loop which it runs."""
        settings = [(None, self.choice)]
        for mapping in [] if self.isDone else self.mappings:
            if is_in_play(mapping, self.choice, self.mappings):
                name = name_of(mapping)
                other = ("scalar" if self.choice[name] == "vectors"
                         else "vectors")
                settings.append((name, self.choice | {name: other}))
        return settings

    def take(self, settings, times):
        """Goes on from the milliseconds of each of these."""
        for (name, setting), ms in zip(settings[1:], times[1:]):
            ratio = ms / times[0]
            self.ratios[name] = (ratio if setting[name] == "vectors"
                                 else 1 / ratio)
        fastest = min(range(len(times)), key=times.__getitem__)
        if times[fastest] > 0.98 * times[0]:
            self.isDone = True
        else:
            self.choice = settings[fastest][1]


def measure_case(arguments, case):
    """For each kernel with a choice: its time by settings, and its loops.
    Kernels change their settings in the same runs."""
    descents = [Descent(kernel) for kernel in case.run("expected")
                if kernel["mappings"]]
    most = 3  # iterations; loops that are inside of each other are not more
    for _ in range(most):
        lists = [descent.list_settings() for descent in descents]
        runs = max(map(len, lists), default=0)
        if runs < 2:
            break
        settings = []
        for run in range(runs):
            merged = {}
            for list_ in lists:
                merged |= list_[run if run < len(list_) else 0][1]
            settings.append(write_setting(merged))
        times = measure_settings(case, settings, arguments.rounds)
        for descent, list_ in zip(descents, lists):
            descent.take(list_, [times[settings[run]][descent.name]
                                 for run in range(len(list_))])
    best = {}
    for descent in descents:
        best |= descent.choice
    names = {"choice": "expected", "best": write_setting(best),
             "runtime": "measured"}
    reports = run_in_turn(case, list(names.values()), arguments.rounds + 1)
    found = []
    for descent in descents:
        regrets, least = find_regrets({key: reports[setting][descent.name]
                                       for key, setting in names.items()})
        found.append({
            "case": case.name, "kernel": descent.name, "ms": least,
            "choice": regrets["choice"], "runtime": regrets["runtime"],
            "loops": [{"name": name_of(m), "loop": m["loop"],
                       "expected": m["expected_ratio"],
                       "measured": descent.ratios.get(name_of(m)),
                       "best": descent.choice[name_of(m)]}
                      for m in descent.mappings]})
    return found


def print_table(kernels):
    print("| case | loop | expected | measured | best | ms | choice | runtime |")
    print("|---|---|---|---|---|---|---|---|")
    for kernel in kernels:
        for i, loop in enumerate(kernel["loops"]):
            measured = loop["measured"]
            cells = [kernel["case"], f"{loop['name']} {loop['loop']}",
                     f"{loop['expected']:.2f}",
                     f"{measured:.2f}" if measured else "", loop["best"]]
            cells += ([f"{kernel['ms']:.3f}", f"{kernel['choice']:.0%}",
                       f"{kernel['runtime']:.0%}"] if i == 0 else [""] * 3)
            print("| " + " | ".join(cells) + " |")


def print_summary(kernels, left_out):
    print()
    for key, who in (("choice", "by the cost model"),
                     ("runtime", "by the runtime")):
        regrets = [kernel[key] for kernel in kernels]
        within = [sum(regret <= limit for regret in regrets)
                  for limit in (0.05, 0.15)]
        print(f"- choices {who}: {within[0]} of {len(regrets)} kernels within "
              f"5 % of the best, {within[1]} within 15 %; the worst "
              f"{max(regrets):.0%}")
    print(f"- {left_out} kernels took too little time to say")


def solve(matrix, vector):
    """Gaussian elimination with pivots."""
    n = len(vector)
    rows = [list(row) + [value] for row, value in zip(matrix, vector)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda r: abs(rows[r][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for r in range(i + 1, n):
            factor = rows[r][i] / rows[i][i]
            for c in range(i, n + 1):
                rows[r][c] -= factor * rows[i][c]
    result = [0.0] * n
    for i in reversed(range(n)):
        rest = sum(rows[i][c] * result[c] for c in range(i + 1, n))
        result[i] = (rows[i][n] - rest) / rows[i][i]
    return result


def fit(kernels, estimates):
    """The factors by which numbers of the cost model should change: of the
    logarithm of each the step that minimizes the squares of what is left of the
    logarithms of expected over measured ratios, and of the steps."""
    prior = 0.3  # how much one is taken to be off: a factor of e^0.3
    rows, names = [], set()
    for kernel in kernels:
        for loop in kernel["loops"]:
            found = estimates.get(kernel["case"], {}).get(loop["name"])
            if not loop["measured"] or not found:
                continue
            by = {name: pair[0] - pair[1]
                  for name, pair in found["by"].items()}
            residual = math.log(loop["measured"] / loop["expected"])
            # Few outliers are not to move everything.
            residual = max(-1.5, min(1.5, residual))
            rows.append((by, residual))
            names |= set(by)
    names = sorted(names)
    normal = [[0.0] * len(names) for _ in names]
    right = [0.0] * len(names)
    for by, residual in rows:
        for i, a in enumerate(names):
            right[i] += by.get(a, 0) * residual
            for j, b in enumerate(names):
                normal[i][j] += by.get(a, 0) * by.get(b, 0)
    for i in range(len(names)):
        normal[i][i] += 1 / prior ** 2
    steps = dict(zip(names, solve(normal, right)))
    before = math.sqrt(statistics.mean(r * r for _, r in rows))
    after = math.sqrt(statistics.mean(
        (r - sum(by.get(n, 0) * steps[n] for n in names)) ** 2
        for by, r in rows))
    return steps, len(rows), before, after


def print_fit(kernels, estimates):
    steps, loops, before, after = fit(kernels, estimates)
    print(f"\nFit to {loops} loops: estimates are off by a factor of "
          f"{math.exp(before):.2f} (root mean square), and by "
          f"{math.exp(after):.2f} with these changes:\n")
    for name, step in sorted(steps.items(), key=lambda item: -abs(item[1])):
        print(f"  {name}: times {math.exp(step):.2f}")


def main():
    arguments = parse_arguments()
    os.makedirs(arguments.work, exist_ok=True)
    kernels, estimates, left_out = [], {}, 0
    for case in find_cases(arguments):
        print(f"{case.name} ...", file=sys.stderr, flush=True)
        for kernel in measure_case(arguments, case):
            if kernel["ms"] < arguments.least:
                left_out += 1
            else:
                kernels.append(kernel)
        if arguments.fit:
            estimates[case.name] = case.estimate()
        if arguments.json:
            write_text(arguments.json, json.dumps(
                {"kernels": kernels, "estimates": estimates}))
    if not kernels:
        sys.exit("expected a kernel with a choice, but found none")
    print_table(kernels)
    print_summary(kernels, left_out)
    if arguments.fit:
        print_fit(kernels, estimates)


if __name__ == "__main__":
    run_main(main)
