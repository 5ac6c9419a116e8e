# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Says whether piko-render --json knows what of a frame with a cycle takes time.

How long that is nobody asks: a clock's number is no test's.
"""

import json
import sys

with open(sys.argv[1], encoding="utf-8") as file:
    report = json.load(file)
parts = report["time"]
assert all(ms >= 0 for ms in parts.values()), parts
assert parts["kernels_ms"] > 0 and parts["cycles_ms"] > 0, parts
took = {kernel["name"]: kernel["ms"] for kernel in report["kernels"]}
assert took["trace"] > 0 and took["shade"] > 0, took
print("kernels of the cycle and its joins took time")
