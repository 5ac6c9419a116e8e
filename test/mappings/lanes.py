#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What lanes are given of each kernel of the examples and of benchmarks/bodies.

  lanes.py [options]           fails where lanes.md says something else
  lanes.py [options] --quick   looks at the examples and the first processor alone
  lanes.py [options] --write   writes lanes.md anew

A row is a stage that has a kernel: what piko-map-lanes gives lanes, and, by
processor, what piko-plan-vectors makes of its loops, as `pikoc --explain` says it:

  16 primitives              at once
  16 or 1 primitives, as measured   both are there, and the runtime takes the faster
  16 iterations              of a parallel loop
  16 iterations in order     of another loop, which do not depend on one another
  1 primitive, WHY           one after the other
  .., in turns               lanes take turns through a part of it
  .., each lane by itself    goes on in an inner loop

Bodies are for one processor alone, which takes half of the time.
"""

import argparse
import difflib
import os
import pathlib
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
TABLE = pathlib.Path(__file__).with_name("lanes.md")
CPUS = ["x86-64-v4", "x86-64-v3", "x86-64"]
FILES = {"examples/*/*.piko.cpp": CPUS, "benchmarks/bodies/*.piko.cpp": CPUS[:1]}
HEAD = """# What lanes are given

Of each kernel of the examples and of `benchmarks/bodies`, so that a change is seen.
`make lanes` writes this file anew; [lanes.py](lanes.py) says what is in it.
"""

REMARK = re.compile(r"    (?:\S+?:(\d+):(\d+): )?stage '([^']+)': (.*)")
# In the words of the table, one after the other. Estimates are left out: they change
# with each constant of the model.
WORDS = [
    (r"(\w+) is vectorized for (\d+) primitives at once", r"\1: \2 primitives"),
    (r"(\w+) is not vectorized: ", r"\1: 1 primitive, "),
    (r"these iterations are vectorized for (\d+) at once", r"\1 iterations"),
    (r"these iterations are not vectorized: ", "1 iteration, "),
    (r"iterations of this loop do not depend on one another, and are vectorized for "
     r"(\d+) at once", r"\1 iterations in order"),
    (r"(\d+) (\w+)(.*), and held one after the other as well, to measure which is "
     r"faster.*", r"\1 or 1 \2\3, as measured"),
    (r"\d+ at once are expected to take .*", "by its cost"),
    (r"; specifyLanes.*", ""),
    (r"^process: ", ""),
]
NOTES = {"lanes go on in this loop each by itself": "each lane by itself",
         "lanes take turns to go through this loop": "in turns"}


def shorten(text):
    for pattern, words in WORDS:
        text = re.sub(pattern, words, text, count=1)
    return text.replace("|", "\\|")


def read_remarks(report, pass_name):
    """(place, stage, text, notes) of what a pass has said."""
    remarks, current = [], None
    for line in report.split("\nWhat the passes did or refused:\n")[-1].split("\n"):
        if not line:
            break
        if re.match(r"  \S", line):
            current = line.strip()
        elif current != pass_name:
            continue
        elif match := REMARK.fullmatch(line):
            remarks.append((match[1], match[2], match[3], match[4], []))
        elif line.startswith("      ") and remarks:
            remarks[-1][-1].append(line.strip())
    return remarks


def list_mappings(report):
    return {stage: text.removeprefix("lanes are given ").split(",")[0]
            for _, _, stage, text, _ in read_remarks(report, "piko-map-lanes")}


def list_loops(report):
    """What became of the loops of each stage, each once."""
    loops = {}
    remarks = [remark for step in ("piko-lockstep", "piko-plan-vectors")
               for remark in read_remarks(report, step)]
    for line, column, stage, text, notes in remarks:
        said = [shorten(text)]
        said += [word for note, word in NOTES.items() if any(note in it for it in notes)]
        loops.setdefault(stage, {})[line, column, ", ".join(said)] = None
    return {stage: [said for _, _, said in found] for stage, found in loops.items()}


def explain(pikoc, file, pipe, cpu):
    done = subprocess.run([pikoc, file, "--pipe", pipe, "--cpu", cpu, "--explain"],
                          capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{file} {pipe}\n{done.stderr}")
    return done.stdout


def list_rows(reports):
    """Of a pipeline, by processor."""
    mappings = {}
    for report in reports.values():
        mappings |= {stage: said for stage, said in list_mappings(report).items()
                     if stage not in mappings}
    loops = {cpu: list_loops(report) for cpu, report in reports.items()}
    for stages in loops.values():
        mappings |= {stage: "" for stage in stages if stage not in mappings}
    return [[stage, said, *("; ".join(loops[cpu].get(stage, ["1"]))
                            for cpu in reports)]
            for stage, said in mappings.items()]


def list_pipes(pikoc, file):
    return subprocess.run([pikoc, file, "--list-pipes"], check=True,
                          capture_output=True, text=True).stdout.split()


def cut(text):
    """The table of the examples with the first processor alone, without stages that
    have no lanes there, of which some are in the table for another one's sake."""
    text = text.split("## benchmarks/")[0].rstrip()
    lines = [re.split(r"(?<!\\) \| ", line.removesuffix(" |"))[:4]
             if line.startswith("| ") else [line.replace("|---" * 6, "|---" * 4)]
             for line in text.splitlines()]
    return "\n".join(" | ".join(line) for line in lines if line[3:] != ["1"]) + "\n"


def write_table(pikoc, jobs, is_quick):
    patterns = dict([*FILES.items()][:1]) if is_quick else FILES
    files = {file: cpus[:1] if is_quick else cpus for pattern, cpus in patterns.items()
             for file in sorted(ROOT.glob(pattern))}
    with ThreadPoolExecutor(jobs) as pool:
        pipes = dict(zip(files, pool.map(lambda file: list_pipes(pikoc, file), files)))
        reports = {(file, pipe, cpu): pool.submit(explain, pikoc, file, pipe, cpu)
                   for file, cpus in files.items() for pipe in pipes[file]
                   for cpu in cpus}
        lines = [HEAD]
        for file, cpus in files.items():
            head = ["pipeline", "stage", "lanes are given", *cpus]
            lines += [f"## {file.relative_to(ROOT)}", "", f"| {' | '.join(head)} |",
                      "|---" * len(head) + "|"]
            for pipe in pipes[file]:
                rows = list_rows({cpu: reports[file, pipe, cpu].result()
                                  for cpu in cpus})
                lines += [f"| {' | '.join([pipe, *row])} |" for row in rows]
            lines.append("")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pikoc", default=ROOT / "build/bin/pikoc")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("--quick", action="store_true")
    choice.add_argument("--write", action="store_true")
    options = parser.parse_args()
    text = write_table(options.pikoc, options.jobs, options.quick)
    if options.write:
        TABLE.write_text(text)
        return
    known = TABLE.read_text()
    if options.quick:
        text, known = cut(text), cut(known)
    if text != known:
        sys.stdout.writelines(difflib.unified_diff(
            known.splitlines(True), text.splitlines(True), "lanes.md", "now", n=0))
        sys.exit("\nlanes.py: lanes are given something else; if that is meant, "
                 "`make lanes` writes it down")


if __name__ == "__main__":
    main()
