# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Runs piko-opt as the tests of passes run it; each pass of Passes.md changes
something in one of them, and its report says so."""

import json
import pathlib
import re
import shlex
import subprocess
import sys

tests, document = map(pathlib.Path, sys.argv[1:])
COMMAND = re.compile(r"// RUN: (piko-opt [^|>]*)")


def list_commands(file):
    for line in file.read_text().splitlines():
        if match := COMMAND.match(line):
            text = match[1].replace("%s", str(file)).replace("%S", str(file.parent))
            yield shlex.split(text.removesuffix(" 2"))


def run(command):
    """What each pass changed: operations by kind, or none of them."""
    done = subprocess.run([*command, "--report-passes=json", "-o", "/dev/null"],
                          capture_output=True, text=True)
    assert done.returncode == 0, (command, done.stderr)
    return json.loads(done.stderr.splitlines()[-1])


files = sorted(file for folder in ("Transforms", "Conversion")
               for file in (tests / folder).rglob("*.mlir"))
commands = [command for file in files for command in list_commands(file)
            if "-o" not in command]
changed = {}
for command in commands:
    for it in run(command):
        assert 0 <= it["changes"] <= it["runs"], it
        assert it["changes"] or not it["operations"], it
        changed[it["pass"]] = changed.get(it["pass"], 0) + it["changes"]
passes = re.findall(r"^### `-(\S+)`$", document.read_text(), re.M)
assert len(passes) > 50, passes
unseen = [name for name in passes if not changed.get(name)]
assert not unseen, f"no test shows that these change anything: {unseen}"
