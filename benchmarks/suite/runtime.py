# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What an edge between two stages costs."""

import re
import sys

from commands import call
from suite.section import Section, draw_groups

LINE = re.compile(r"(\S.*?) +emit +([\d.]+) ms +([\d.]+) ns +"
                  r"join +([\d.]+) ms +([\d.]+) ns +peak (\d+) MB")


def measure(options):
    rows, records, joins = [], [], {}
    for threads in options.threads:
        text = call([f"{options.bin}/piko-runtime-benchmark",
                     str(options.records), str(threads),
                     str(options.runtime_frames)])
        found = LINE.findall(text)
        if not found:
            sys.exit(f"piko-runtime-benchmark: expected edges, but got '{text}'")
        for edge, emit, emit_ns, join, join_ns, peak in found:
            rows.append([edge, str(threads), f"{emit} ms", f"{emit_ns} ns",
                         f"{join} ms", f"{join_ns} ns", f"{peak} MB"])
            records.append({"edge": edge, "threads": threads,
                            "emit_ms": emit, "emit_ns": emit_ns,
                            "join_ms": join, "join_ns": join_ns,
                            "peak_mb": peak})
            joins.setdefault(edge, []).append(float(join_ns))
    groups = {f"{threads} thread{'s' * (threads != 1)}":
              [times[i] for times in joins.values()]
              for i, threads in enumerate(options.threads)}
    return Section(
        "runtime", "Edges of the runtime",
        [f"{options.records:,} records of 48 bytes, the best of "
         f"{options.runtime_frames} frames. Nanoseconds are for a record and "
         "thread."],
        ["edge", "threads", "emit", "a record", "join", "a record", "peak"],
        rows, records,
        lambda pyplot: draw_groups(pyplot, list(joins), groups,
                                 "join, ns a record and thread"),
        keys=["edge", "threads"], times=["emit_ns", "join_ns"])
