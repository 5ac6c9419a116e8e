# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What FailureTests says of the scenes that methods fail on."""

import csv
import os
import sys

from commands import call


def collect(options):
    """A mode for each family of scenes; none where the tests are not built."""
    tool = f"{options.bin}/FailureTests"
    if not os.path.exists(tool):
        return []
    folder = f"{options.out}/failures"
    wanted = options.modes or []
    call([tool, "--charts", folder,
          *(word for name in wanted for word in ("--only", name))])
    modes = {}
    with open(f"{folder}/failures.csv", newline="") as file:
        for row in csv.DictReader(file):
            mode = modes.setdefault(row["mode"], {
                "name": row["mode"], "points": [],
                **{key: row[key] for key in
                   ("title", "hardness", "error", "naive", "ours")}})
            mode["points"].append({"scene": float(row["scene"]),
                                   "naive": float(row["naive error"]),
                                   "ours": float(row["our error"])})
    for name in wanted:
        if name not in modes:
            sys.exit(f"--modes: expected a failure mode, but got '{name}'")
    for mode in modes.values():
        files = {who: f"{folder}/{mode['name']}-{who}.png"
                 for who in ("naive", "ours")}
        mode["pictures"] = {who: file for who, file in files.items()
                            if os.path.exists(file)}
    return list(modes.values())
