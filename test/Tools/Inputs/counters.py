# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Compares what piko-render counted in several runs, and prints the first."""

import json
import sys

runs = [json.load(open(name)) for name in sys.argv[1:]]


def text_of(run):
    work = run["work"]
    edges = [{key: edge[key] for key in edge if key != "stored"}
             for edge in work["edges"]]
    return work["stages"], edges, work["accesses"], work["loops"]


print("the same text" if all(text_of(run) == text_of(runs[0]) for run in runs)
      else "another text")
work = runs[0]["work"]
print("pixels", runs[0]["pixels"])
for stage in work["stages"]:
    print(f"{stage['name']}: {stage['calls']} calls, {stage['least']} needed")
for edge in work["edges"]:
    print(f"edge {edge['from']} to {edge['to']}: {edge['primitives']} primitives,"
          f" {edge['stored']} bytes stored")
for access in work["accesses"]:
    print(f"{access['stage']} {access['kind']} {access['state']}: "
          f"{access['count']} times, {access['elements']} elements")
print("kernels with lanes:",
      sum(kernel["active_lanes"] > 0 for kernel in work["kernels"]))
