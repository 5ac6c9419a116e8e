#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What lanes are given of each kernel of the examples and of benchmarks/bodies.

  lanes.py [options]           fails where lanes.md says something else
  lanes.py [options] --write   writes lanes.md anew

A row is a stage that has a kernel: what piko-map-lanes gives lanes, and, by
processor, what piko-vectorize makes of its loops, in the words of `pikoc --explain`
without places and estimates.
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
HEAD = """# What lanes are given

Of each kernel of the examples and of `benchmarks/bodies`, so that a change is seen.
`make lanes` writes this file anew; [lanes.py](lanes.py) says what is in it.
"""

REMARK = re.compile(r"    (?:\S+?:(\d+):(\d+): )?stage '([^']+)': (.*)")
# In the words of the table; the first one that fits.
WORDS = [
    (r"(\w+) is vectorized for (\d+) primitives at once", r"\1: \2 primitives"),
    (r"these iterations are vectorized for (\d+) at once", r"\1 iterations"),
    (r"iterations of this loop do not depend on one another, and are vectorized for "
     r"(\d+) at once", r"\1 iterations in order"),
    (r"(\w+) is not vectorized: ", r"\1: one primitive, "),
    (r"these iterations are not vectorized: ", "one iteration, "),
]
NOTES = {"lanes go on in this loop each by itself": "each lane by itself",
         "lanes take turns to go through this loop": "in turns"}


def shorten(text):
    for pattern, words in WORDS:
        if re.match(pattern, text):
            text = re.sub(pattern, words, text, count=1)
            break
    text = text.split("; specifyLanes")[0].removeprefix("process: ")
    # Estimates change with each constant of the model.
    text = re.sub(r"\d+ at once are expected to take .*", "as it costs more", text)
    text = re.sub(r": \d+ cycles are expected, and \d+", "", text)
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
    for line, column, stage, text, notes in read_remarks(report, "piko-vectorize"):
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
    return [[stage, said, *("; ".join(loops[cpu].get(stage, ["one"]))
                            for cpu in reports)]
            for stage, said in mappings.items()]


def write_table(pikoc, jobs):
    files = sorted(ROOT.glob("examples/*/*.piko.cpp"))
    files += sorted(ROOT.glob("benchmarks/bodies/*.piko.cpp"))
    with ThreadPoolExecutor(jobs) as pool:
        # The first one of a file leaves what its C++ means to the others.
        pipes = dict(zip(files, pool.map(
            lambda file: subprocess.run([pikoc, file, "--list-pipes"], check=True,
                                        capture_output=True, text=True)
            .stdout.split(), files)))
        reports = {(file, pipe, cpu): pool.submit(explain, pikoc, file, pipe, cpu)
                   for file in files for pipe in pipes[file] for cpu in CPUS}
        lines = [HEAD]
        for file in files:
            lines += [f"## {file.relative_to(ROOT)}", ""]
            lines += ["| pipeline | stage | lanes are given | " + " | ".join(CPUS)
                      + " |", "|---" * (3 + len(CPUS)) + "|"]
            for pipe in pipes[file]:
                rows = list_rows({cpu: reports[file, pipe, cpu].result()
                                  for cpu in CPUS})
                lines += [f"| {' | '.join([pipe, *row])} |" for row in rows]
            lines.append("")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pikoc", default=ROOT / "build/bin/pikoc")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    text = write_table(options.pikoc, options.jobs)
    if options.write:
        TABLE.write_text(text)
        return
    known = TABLE.read_text()
    if text != known:
        sys.stdout.writelines(difflib.unified_diff(
            known.splitlines(True), text.splitlines(True), "lanes.md", "now", n=0))
        sys.exit("\nlanes.py: lanes are given something else; if that is meant, "
                 "`make lanes` writes it down")


if __name__ == "__main__":
    main()
