#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Checks of the source tree; exit status 1 when one finds a fault.

format    every C++ file is formatted as .clang-format says (--fix: make it so)
licence   every source file has the licence line at its top
paths     no file holds an absolute path of somebody's machine
layers    the runtime's common part knows nothing of the targets' parts, nor the
          CPU's of a device's; no library includes a file of another one by its path
folders   none has more files than a reader looks through
classes   none has more functions than that
words     terms are the field's: none of those of utils/words.txt
links     documents link to files and headings that there are
tidy      clang-tidy over the compile commands of a build (--build DIR), or over
          the files without headers of LLVM, a folder at a time (--quick)
all       all but the last
"""

import argparse
import bisect
import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

from document_links import find_dead
from tool import run_main

ROOT = pathlib.Path(__file__).resolve().parent.parent
LLVM_BIN = "/usr/lib/llvm-22/bin"
CXX = {".h", ".c", ".cpp", ".inc"}
LICENSED = CXX | {".td", ".py", ".sh", ".cmake"}
LICENSED_NAMES = {"CMakeLists.txt", "Makefile", "run"}
LICENCE = "SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception"
MACHINE_PATH = re.compile(r"(?<![\w.$}])/(home|root|work|Users|mnt|media)/\w")


def tool(name):
    found = shutil.which(f"{name}-22") or shutil.which(name, path=LLVM_BIN)
    if not found:
        sys.exit(f"lint: expected {name} 22, but it is not installed")
    return found


def sources():
    """The files of the project: known to git, or new and not ignored."""
    command = ["git", "ls-files", "-z", "-co", "--exclude-standard"]
    try:
        out = subprocess.run(
            command, cwd=ROOT, check=True, capture_output=True
        ).stdout
        names = out.decode().split("\0")[:-1]
    except (OSError, subprocess.CalledProcessError):  # a source archive
        names = [
            str(p.relative_to(ROOT))
            for p in ROOT.rglob("*")
            if not p.relative_to(ROOT).parts[0].startswith("build")
        ]
    return sorted({n for n in names if (ROOT / n).is_file()})


def format(fix):
    files = [f for f in sources() if pathlib.Path(f).suffix in CXX]
    if not files:
        return 0
    mode = ["-i"] if fix else ["--dry-run", "-Werror"]
    command = [tool("clang-format"), "--style=file", *mode, *files]
    return subprocess.run(command, cwd=ROOT).returncode


def licence():
    faults = 0
    for name in sources():
        path = pathlib.Path(name)
        if path.suffix not in LICENSED and path.name not in LICENSED_NAMES:
            continue
        with open(ROOT / name, errors="replace") as file:
            top = [file.readline() for _ in range(3)]
        if not any(LICENCE in line for line in top):
            print(f"{name}:1: expected '{LICENCE}' in the first three lines")
            faults += 1
    return faults


def paths():
    faults = 0
    for name in sources():
        try:
            text = (ROOT / name).read_text()
        except UnicodeDecodeError:
            continue
        for number, line in enumerate(text.splitlines(), 1):
            match = MACHINE_PATH.search(line)
            if match and "MACHINE_PATH" not in line:
                print(f"{name}:{number}: path of a machine: {match.group()}")
                faults += 1
    return faults


def layers():
    """runtime/common includes none of runtime/cpu, runtime/gpu and runtime/cuda,
    and declares none of the first two's types itself; those two include nothing
    of runtime/cuda, and runtime/cpu nothing of runtime/gpu, nor does it name an
    accelerator. No library includes a file of another one by its path."""
    runtime = ROOT / "runtime"
    foreign = set()
    for header in [*runtime.glob("cpu/**/*.h"), *runtime.glob("gpu/**/*.h")]:
        foreign |= set(re.findall(r"^(?:class|struct) (\w+)", header.read_text(), re.M))
    faults = 0
    for name in sources():
        if not re.match(r"(lib|include|tools)/.*\.(h|cpp)$", name):
            continue
        for number, line in enumerate((ROOT / name).read_text().splitlines(), 1):
            included = re.match(r'#include "(\.\./[^"]+)', line)
            if included and not os.path.normpath(
                os.path.join(os.path.dirname(name), included[1])
            ).startswith("/".join(name.split("/")[:2]) + "/"):
                print(
                    f"{name}:{number}: expected a header of its own library, or of"
                    " include"
                )
                faults += 1
    for path in sorted([*runtime.glob("cpu/**/*.*"), *runtime.glob("gpu/**/*.*")]):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            if re.match(r'#include "cuda/', line):
                print(
                    f"{path.relative_to(ROOT)}:{number}: expected nothing of"
                    " runtime/cuda in what runs without it"
                )
                faults += 1
            if path.is_relative_to(runtime / "cpu") and re.search(
                r'#include "(gpu/|common/Accelerator)|\b[Aa]ccelerator\b', line
            ):
                print(
                    f"{path.relative_to(ROOT)}:{number}: expected nothing of a device"
                    " in runtime/cpu"
                )
                faults += 1
    for path in sorted(runtime.glob("common/*")):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            part = re.search(r"\b(cpu|gpu|cuda)/", line)
            declared = re.match(r"\s*(?:class|struct) (\w+);", line)
            name = part and part.group() or declared and declared.group(1)
            if part or name in foreign:
                print(
                    f"{path.relative_to(ROOT)}:{number}: expected nothing of a"
                    f" target in runtime/common, but got '{name}'"
                )
                faults += 1
    return faults


# How many files a folder has at most.
MOST_FILES = 25
# Programs that are listed by name.
LISTS = ("benchmarks/bodies",)


def folders():
    """A folder has MOST_FILES files, without those of its own folders."""
    counts = {}
    for name in sources():
        folder = os.path.dirname(name)
        counts[folder] = counts.get(folder, 0) + 1
    faults = 0
    for folder, count in sorted(counts.items()):
        if count > MOST_FILES and folder not in LISTS:
            print(f"{folder}: expected at most {MOST_FILES} files, but it has {count}")
            faults += 1
    return faults


MOST_METHODS = 40
# What a user's stage inherits: the language.
LANGUAGE = ("BasicStage",)
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.S)
CLASS = re.compile(r"\b(?:class|struct)\s+(?:alignas\(\w+\)\s+)?(\w+)(?:\s+final)?"
                   r"\s*(?::[^;{()]*)?\{")


def declarations(text):
    """What a class declares, without bodies and what is nested: `text` begins after
    its brace."""
    depth, flat = 1, ""
    for char in text:
        depth += (char == "{") - (char == "}")
        if depth == 0:
            break
        if depth == 1:
            flat += ";" if char == "}" else char
    return re.sub(r"\b(?:public|private|protected):", "", flat).split(";")


def classes():
    """A class declares MOST_METHODS functions, constructors aside."""
    faults = 0
    for name in sources():
        if not re.match(r"(lib|include|runtime|tools|test-driver)/.*\.(h|hpp|cpp)$", name):
            continue
        text = COMMENT.sub("", (ROOT / name).read_text())
        for found in CLASS.finditer(text):
            methods = 0
            for one in declarations(text[found.end():]):
                head = re.match(r"([^=]*?)\b(~?\w+|operator\W+)\s*\(", one)
                methods += bool(head and head[1].strip() and head[2].strip("~") != found[1]
                                and not re.search(r"\b(using|friend|typedef)\b", head[1]))
            if methods > MOST_METHODS and found[1] not in LANGUAGE:
                print(f"{name}: expected at most {MOST_METHODS} functions in"
                      f" '{found[1]}', but it has {methods}")
                faults += 1
    return faults


def links():
    pages = [ROOT / name for name in sources() if name.endswith(".md")]
    faults = 0
    for page, target in find_dead(pages):
        print(f"{page.relative_to(ROOT)}: nothing is where '{target}' leads to")
        faults += 1
    return faults


WORDS = "utils/words.txt"
# Comments go from line to line.
JOINED = re.compile(r"\s*\n\s*(?://+<?|#+|\*)?\s*")


def words():
    lines = [line for line in (ROOT / WORDS).read_text().splitlines()
             if not line.startswith("#")]
    banned = [(re.compile(pattern, re.I), instead)
              for pattern, instead in (line.split("\t") for line in lines)]
    faults = 0
    for name in sources():
        try:
            text = (ROOT / name).read_text()
        except UnicodeDecodeError:
            continue
        if name in (WORDS, "docs/Glossary.md"):
            continue
        starts, joined, end = [], "", 0
        for match in JOINED.finditer(text):
            starts.append(len(joined))
            joined += text[end:match.start()] + " "
            end = match.end()
        joined += text[end:]
        for pattern, instead in banned:
            for match in pattern.finditer(joined):
                # Empty lines are joined, too: near enough to find the place.
                number = bisect.bisect_right(starts, match.start())
                print(f"{name}:{number}: expected '{instead}', but got"
                      f" '{match.group()}'")
                faults += 1
    return faults


# No headers of LLVM, which take most of clang-tidy's time.
QUICK = ("runtime/common", "runtime/cpu", "runtime/gpu", "runtime/cuda", "tools/scene")


# What CMake writes to compile several files as one.
UNITED = re.compile(r'^#include "(.+)"$', re.M)


def commands(build, folders):
    """The compile command of each file of these folders, as a list."""
    database = pathlib.Path(build) / "compile_commands.json"
    if not database.exists():
        sys.exit(f"lint: expected {database}; configure the build first")
    folders = tuple(str(ROOT / f) + os.sep for f in folders)
    found = {}
    for entry in json.loads(database.read_text()):
        unit, files = pathlib.Path(entry["file"]), [entry["file"]]
        if unit.parent.name == "Unity":
            files = UNITED.findall(unit.read_text())
        for file in files:
            if file.startswith(folders):
                command = shlex.split(entry["command"])
                found[file] = [file if w == str(unit) else w for w in command]
    return found


def options(file, command):
    """A command's, but for what it reads and writes."""
    kept, out = [], False
    for word in command[1:]:
        if not out and word not in ("-c", "-o", file):
            kept.append(word)
        out = word == "-o"
    return kept


# In a group, names that two files each have for themselves meet.
CLASH = re.compile(r"^(.+?):\d+:\d+: error: .*\[clang-diagnostic-error\]$", re.M)


def tidy_group(files, flags, folder):
    """Checks files as one, so that what they include is read once: most of
    clang-tidy's time. Those that clash with others are a group of their own.
    Returns the faults' text; none is empty."""
    with tempfile.NamedTemporaryFile("w", suffix=".cpp", dir=folder) as unit:
        for file in files:
            unit.write(f'#include "{file}" // NOLINT(bugprone-suspicious-include)\n')
        unit.flush()
        path = files[0] if len(files) == 1 else unit.name
        command = [tool("clang-tidy"), "--quiet", f"--config-file={ROOT}/.clang-tidy"]
        command += [path, "--", *flags, "-ferror-limit=0"]
        result = subprocess.run(command, capture_output=True, text=True)
    if not result.returncode:
        return ""
    clashing = set(CLASH.findall(result.stdout)) & set(files[1:])
    if not clashing:
        return result.stdout or result.stderr
    parts = [[f for f in files if (f in clashing) == clash] for clash in (False, True)]
    return "".join(tidy_group(part, flags, folder) for part in parts)


def tidy_quick(build, jobs):
    groups = {}
    for file, command in sorted(commands(build, QUICK).items()):
        key = (os.path.dirname(file), *options(file, command))
        groups.setdefault(key, []).append(file)
    with tempfile.TemporaryDirectory() as folder, \
            concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        done = [pool.submit(tidy_group, files, flags, folder)
                for (_, *flags), files in groups.items()]
        faults = [text for future in done if (text := future.result())]
    print("".join(faults), end="")
    count = sum(map(len, groups.values()))
    print(f"clang-tidy: {count} files, {len(faults)} groups with faults")
    return faults or not count


def tidy(build, jobs):
    found = commands(build, ("lib", "tools", "runtime"))
    files = sorted(found)

    def check(file):
        command = [tool("clang-tidy"), "--quiet", file, "--"]
        command += options(file, found[file])
        return file, subprocess.run(command, cwd=build, capture_output=True, text=True)

    faults = 0
    show = sys.stderr.isatty()
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for done, (file, result) in enumerate(pool.map(check, files), 1):
            if show:
                print(f"\r{done}/{len(files)}", end="", file=sys.stderr)
            if result.returncode:
                print(result.stdout, end="")
                faults += 1
    if show:
        print(file=sys.stderr)
    print(f"clang-tidy: {len(files)} files, {faults} with faults")
    return faults or not files


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument(
        "check",
        choices=["format", "licence", "paths", "layers", "folders", "classes",
                 "words", "links", "tidy", "all"],
    )
    parser.add_argument("--fix", action="store_true")
    parser.add_argument("--build", default="build")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    args = parser.parse_args()
    checks = {
        "format": lambda: format(args.fix),
        "licence": licence,
        "paths": paths,
        "layers": layers,
        "folders": folders,
        "classes": classes,
        "words": words,
        "links": links,
        "tidy": lambda: (tidy_quick if args.quick else tidy)(args.build, args.jobs),
    }
    names = [args.check]
    if args.check == "all":
        names = [name for name in checks if name != "tidy"]
    faults = [name for name in names if checks[name]()]
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    run_main(main)
