#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""check-readme.py README.md: the commands of the first page are targets of the Makefile,
and the figures of its table stand on the pages of results that the rows link to."""

import pathlib
import re
import sys

page = pathlib.Path(sys.argv[1])
text = page.read_text()
targets = (page.parent / "Makefile").read_text()
fence = re.search(r"^```sh\n(.*?)^```", text, re.S | re.M)[1]
commands = re.findall(r"^make ([\w-]+)", fence, re.M)
print("commands:", *commands)
for command in commands:
    assert re.search(rf"^{command}:", targets, re.M), command

rows = figures = 0
for row in re.findall(r"^\|.*\(benchmarks/results/[\w.-]+\.md\) \|$", text, re.M):
    _, what, own, others, where, _ = row.split("|")
    results = page.parent / re.search(r"\(([^)]+)\)", where)[1]
    known = set(re.findall(r"\d+(?:\.\d+)?", results.read_text()))
    for figure in re.findall(r"(?<![\w-])\d+(?:\.\d+)?(?![\w-])", own + others):
        assert figure in known, f"{figure} is not in {results}"
        figures += 1
    rows += 1
print(f"figures: {figures} in {rows} rows")
