#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Stands in for ptxas: kernels need NEEDED registers, and take 64 unless a bound
(.maxnreg) says otherwise. Each call is a line of the file CALLS."""
import os
import re
import sys

arguments = sys.argv[1:]
chosen = [arguments[i + 1] for i, each in enumerate(arguments) if each == "-e"]
text = open(arguments[4]).read()
open(arguments[3], "w").write("cubin")
with open(os.environ["CALLS"], "a") as calls:
    calls.write(" ".join(chosen) or "all")
    calls.write("\n")
for name, head in re.findall(r"\.entry (\w+)\((.*?)\n{", text, re.DOTALL):
    if chosen and name not in chosen:
        continue
    bound = re.search(r"\.maxnreg (\d+)", head)
    registers = min(int(bound[1]) if bound else 64, int(os.environ["NEEDED"]))
    spilled = 4 * (int(os.environ["NEEDED"]) - registers)
    print(f"""ptxas info    : Compiling entry function '{name}' for 'sm_90'
ptxas info    : Function properties for {name}
    {spilled} bytes stack frame, {spilled} bytes spill stores, {spilled} bytes spill loads
ptxas info    : Used {registers} registers, used 1 barriers""")
