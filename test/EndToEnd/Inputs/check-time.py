# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Says whether what piko-render --json knows of a frame's time is all of it."""

import json
import sys

with open(sys.argv[1]) as file:
    report = json.load(file)
parts, frame = report["time"], report["ms_mean"]
named = sum(parts.values())
assert all(ms >= 0 for ms in parts.values()), parts
assert abs(named - frame) <= 0.02 * frame, f"{named} of {frame} ms: {parts}"
print("the parts sum to the frame")
assert parts["program_ms"] <= 0.1 * frame, parts
print("the program between kernels is less than a tenth")
took = {kernel["name"]: kernel["ms"] for kernel in report["kernels"]}
assert parts["kernels_ms"] > 0.1 * frame and parts["cycles_ms"] > 0, parts
print("the kernels of the cycle took time:",
      ", ".join(name for name in ("trace", "shade") if took[name] > 0))
