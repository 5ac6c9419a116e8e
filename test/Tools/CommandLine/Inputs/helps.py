# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Looks at what tools say of themselves, in the manuals' folder and by --help."""

import gzip
import json
import pathlib
import subprocess
import sys

manuals, *tools = sys.argv[1:]


def call(tool, *words):
    return subprocess.run([tool, *words], check=True, capture_output=True, text=True).stdout


for tool in tools:
    text = call(tool, "--help")
    lines = text.splitlines()
    assert len(lines) <= 40, f"{tool} --help has {len(lines)} lines"
    assert all(len(line) <= 80 for line in lines), f"{tool} --help: {max(lines, key=len)}"
    assert f"usage: {tool} " in text and f"example: {tool} " in text, text
    assert call(tool, "--version").startswith(f"{tool} 0."), call(tool, "--version")
    table = json.loads(call(tool, "--help-json"))
    everything = call(tool, "--help-all")
    manual = gzip.open(pathlib.Path(manuals) / "man1" / f"{tool}.1.gz", "rt").read()
    manual = manual.replace("\\-", "-")
    assert f"\n{tool} - " in manual and ".SH SYNOPSIS" in manual
    for option in table["options"]:
        for name in option["names"]:
            assert name in everything or table["llvm"], f"{tool} --help-all lacks {name}"
            assert f"\\fB{name}\\fR" in manual, f"the manual of {tool} lacks {name}"
    if table["llvm"]:  # as many as there are
        assert manual.count(".TP") > 100, manual.count(".TP")
print(len(tools), "tools")
