#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Lists which test of a folder runs on which target, as its RUN lines say.

  targets.py FOLDER

Prints a line for each file and a column for each target: `runs`, or `-` for a hole.
A file explains its holes, one or more in a line:

  HOLE: cuda, gpu-on-cpu: what is checked is written down on the host

The exit status is 1 if a hole has no explanation, or an explanation no hole.
"""

import pathlib
import re
import sys

TARGETS = ["cpu", "x86-64-v3", "x86-64", "gpu-on-cpu", "cuda"]
#: By substitutions of lit.cfg.py.
NAMED = {"%compare_targets": TARGETS, "%compare_checked": TARGETS[:-1]}
SUFFIXES = {".cpp", ".mlir", ".test"}


def read_commands(text):
    """The commands of the RUN lines, what is defined in them replaced."""
    definitions, commands, begun = {}, [], ""
    for kind, line in re.findall(r"\b(RUN|DEFINE|REDEFINE): *(.*)", text):
        if kind != "RUN":
            name, value = re.match(r"(%\{[\w:-]+\}) *= *(.*)", line).groups()
            definitions[name] = value
            continue
        begun += line.rstrip()
        if begun.endswith("\\"):
            begun = begun[:-1]
            continue
        # A definition may use others, also later ones.
        for _ in range(4):
            for name, value in definitions.items():
                begun = begun.replace(name, value)
        commands += re.split(r"\|\||&&|[|;]", begun)
        begun = ""
    return commands


def get_values(words, option):
    """The words after an option, up to the next one."""
    values, found = [], False
    for word in words:
        name, _, value = word.partition("=")
        if word.startswith("-"):
            found = name == option
            values += [value] if found and value else []
        elif found:
            values.append(word)
    return [v for value in values for v in value.split(",")]


def get_targets(command):
    """What a command runs pipelines on."""
    words = command.split()
    for name, targets in NAMED.items():
        if name in words:
            return targets
    if "pikoc" in words and get_values(words, "--header"):
        # What is linked to a program.
        return get_values(words, "--cpu") or ["x86-64-v3"]
    if "PIKO_CUDA_DRIVER=%test_driver" in words and \
            any(w.startswith("./") for w in words):
        return ["cuda"]
    if any(w.endswith("compare-targets.py") for w in words):
        if "--blocks" in words:
            return ["gpu-on-cpu"]
        return get_values(words, "--cpus") or ["cpu"]
    if not {"piko-compare", "piko-render"} & set(words):
        return []
    against = [t for t in get_values(words, "--against") if t != "reference"]
    return against + (
        get_values(words, "--targets") or
        [t for t in get_values(words, "--target")[:1] if t != "cpu"] or
        get_values(words, "--cpu")[:1] or ["cpu"])


def name_target(name):
    return "cpu" if name == "native" else name


def check(path):
    """The targets that a file runs on, and what is wrong with its holes."""
    text = path.read_text()
    runs = {name_target(t) for c in read_commands(text) for t in get_targets(c)}
    explained, faults = set(), []
    for names, reason in re.findall(r"^(?:// )?HOLE: *([^:\n]*)(.*)", text,
                                    re.MULTILINE):
        if not re.match(r": +\S+ \S+", reason):
            faults.append(f"HOLE: {names}: expected a reason")
        for name in re.split(r",\s*", names.strip()):
            if name not in TARGETS:
                faults.append(f"HOLE: expected {', '.join(TARGETS)}, but got '{name}'")
            elif name in runs:
                faults.append(f"HOLE: {name}: the file does run there")
            explained.add(name)
    faults += [f"does not run on {t}; expected a RUN line, or 'HOLE: {t}: reason'"
               for t in TARGETS if t not in runs | explained]
    return runs, faults


def main():
    folder = pathlib.Path(sys.argv[1])
    files = sorted((p for p in folder.rglob("*")
                    if p.suffix in SUFFIXES and "Inputs" not in p.parts),
                   key=lambda p: p.name)
    status = 0
    print(f"{'':32}", *TARGETS)
    for path in files:
        runs, faults = check(path)
        columns = [("runs" if t in runs else "-").ljust(len(t)) for t in TARGETS]
        print(f"{path.name:32}", *columns)
        for fault in faults:
            print(f"{path}: {fault}", file=sys.stderr)
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
