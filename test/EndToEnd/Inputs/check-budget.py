# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Compares reports of piko-render: check-budget.py WHOLE {BUDGET REPORT}..."""

import json
import pathlib
import sys


def read(path):
    return json.loads(pathlib.Path(path).read_text())


whole = read(sys.argv[1])
for budget, path in zip(sys.argv[2::2], sys.argv[3::2]):
    report = read(path)
    strips = max(kernel["launches"] for kernel in report["kernels"])
    if report["image_hash"] != whole["image_hash"] or not whole["pixels"]:
        sys.exit(f"{path}: another image")
    if not report["peak_bin_bytes"] <= int(budget) < whole["peak_bin_bytes"]:
        sys.exit(f"{path}: {report['peak_bin_bytes']} bytes, whole "
                 f"{whole['peak_bin_bytes']}, budget {budget}")
    print(f"same image in {strips:.0f} strips within {budget} bytes")
