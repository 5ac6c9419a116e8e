# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Compares a general frame with a specialized one, as piko-render counts them."""

import json
import sys

runs = {name: json.load(open(file))
        for name, file in zip(("general", "fixed"), sys.argv[1:])}
same = runs["general"]["image_hash"] == runs["fixed"]["image_hash"]
print("the same picture" if same else "another picture")
for name, run in runs.items():
    calls = {stage["name"]: stage["calls"] for stage in run["work"]["stages"]}
    iterations = sum(loop["iterations"] for loop in run["work"]["loops"]
                if loop["stage"] == "shade")
    kernels = " ".join(kernel["name"] for kernel in run["work"]["kernels"])
    print(f"{name}: shade {iterations // calls['shade']} lights a call, "
          f"kernels {kernels}")
