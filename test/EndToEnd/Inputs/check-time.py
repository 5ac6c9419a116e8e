# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Says whether what piko-render --json knows of a frame's time is all of it.

The frame is measured from outside. Whoever else uses the processors may come
between the two clocks, so that one of several runs has to agree.
"""

import json
import sys

runs = []
for name in sys.argv[1:]:
    with open(name) as file:
        runs.append(json.load(file))
unnamed = []
for report in runs:
    parts, frame = report["time"], report["ms_mean"]
    assert all(ms >= 0 for ms in parts.values()), parts
    unnamed.append(1 - sum(parts.values()) / frame)
    assert parts["kernels_ms"] > 0 and parts["cycles_ms"] > 0, parts
    took = {kernel["name"]: kernel["ms"] for kernel in report["kernels"]}
    assert took["trace"] > 0 and took["shade"] > 0, took
assert min(map(abs, unnamed)) <= 0.02, unnamed
print("the parts sum to the frame")
print("the kernels of the cycle took time")
