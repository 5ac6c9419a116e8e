# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""A roofline of kernels: from counted instructions and bytes to milliseconds.

Two figures for each kernel, in the terms of work and span (Brent, The Parallel
Evaluation of General Arithmetic Expressions, JACM 21(2), 1974):

* `least`: the greatest of what the chip's limits take for all of the work, and of
  the span: how long the last warp runs that has a multiprocessor for itself, whose
  instructions wait for what they read. Caches hold what they can, until a fence of
  the device's scope empties the first level, which is not coherent. No kernel can be
  faster that has as much room for blocks as was assumed.
* `most`: the work and after it the span, as a device does that always runs
  something when it can. Of the first level of the cache a block has a part in the
  span, as small as where all blocks that find room are beside it; the work finds
  nothing there. Kernels may be still slower: banks of shared memory and atomics on one
  address are not in it.

What the host does is in neither.
"""

import math
from dataclasses import dataclass

WARP = 32
SECTOR = 32  # bytes

# Instructions of the machine for one of PTX: as gpu_model/slots.py measures them with
# ptxas 13.0, for sm_80 and sm_90 alike. Ways for rare operands are not in it. Moves
# are taken to be spared half of the time: with that, these are 86 % of the
# instructions that ptxas writes for the kernels of the examples, whose rest is such
# ways and padding.
SLOTS = {
    "integer": 1, "integer64": 2, "float32": 1, "float64": 1, "special": 1,
    "integerDivision": 18, "float32Division": 11, "float64Division": 20,
    "convert": 1, "move": 0.5, "control": 1,
    "loadGlobal": 1, "storeGlobal": 1, "loadShared": 1, "storeShared": 1,
    "loadLocal": 1, "storeLocal": 1, "loadGeneric": 1, "storeGeneric": 1,
    "parameter": 0,  # an operand of what uses it
    "atomic": 1, "barrier": 1, "warpOperation": 1,
}
# Which unit of a multiprocessor takes them, and how many of its instructions.
UNITS = {
    "integer": {"integer": 1, "integer64": 2, "integerDivision": 12},
    "float32": {"float32": 1, "float32Division": 9},
    "float64": {"float64": 1, "float64Division": 9},
    "special": {"special": 1, "float32Division": 1, "float64Division": 1,
                "integerDivision": 1},
    "convert": {"convert": 1, "integerDivision": 2},
    "memory": {"loadGlobal": 1, "storeGlobal": 1, "loadShared": 1,
               "storeShared": 1, "loadLocal": 1, "storeLocal": 1,
               "loadGeneric": 1, "storeGeneric": 1, "atomic": 1,
               "warpOperation": 1},
}
LOCAL = ("loadLocal", "storeLocal")
LOCAL_SECTORS = 4  # of a warp that reads or writes 4 bytes a lane


def count_slots(counts):
    return sum(counts[kind] * slots for kind, slots in SLOTS.items())


def find_memory(counts, chip, units):
    """Milliseconds of caches and of memory: (at least, at most)."""
    sectors, distinct = counts["globalSectors"], counts["distinctSectors"]
    local = LOCAL_SECTORS * sum(counts[kind] for kind in LOCAL)
    l1 = chip.milliseconds((sectors + local) * SECTOR /
                           (chip.l1_bytes_per_clock * units))
    footprint = distinct * SECTOR
    dram = footprint / (chip.dram_gb_per_s * 1e6)
    of_launch = footprint / max(counts["launches"], 1)
    fits = of_launch <= chip.l2_megabytes * 2**20
    least, most = {"L1": l1, "DRAM": 0 if fits else dram}, {"L1": l1, "DRAM": dram}
    if chip.l2_bytes_per_clock:
        for times, count in ((least, distinct), (most, sectors)):
            times["L2"] = chip.milliseconds(
                count * SECTOR / chip.l2_bytes_per_clock)
    return least, most


@dataclass
class Estimate:
    least: dict  # milliseconds by limit
    work: dict  # the same, with caches that hold nothing for long
    span_ms: float  # with such caches

    @property
    def least_ms(self):
        return max(self.least.values())

    @property
    def most_ms(self):
        return max(self.work.values()) + self.span_ms

    @property
    def limit(self):
        return max(self.least, key=self.least.get)

    @property
    def most_limit(self):
        """What takes more of it."""
        limit = max(self.work, key=self.work.get)
        return limit if self.work[limit] > self.span_ms else "span"


def estimate_kernel(counts, chip, launch_us=None):
    """Of all launches of a kernel together, which are counted so."""
    slots = count_slots(counts)
    # No more than there are blocks have work.
    units = min(chip.multiprocessors,
                math.ceil(counts["blocks"] / max(counts["launches"], 1)) or 1)
    busy = {"issue": chip.milliseconds(slots / (chip.issue * units))}
    for unit, kinds in UNITS.items():
        lanes = WARP * sum(counts[kind] * n for kind, n in kinds.items())
        busy[unit] = chip.milliseconds(lanes / (chip.lanes[unit] * units))
    busy["launch"] = 1e-3 * counts["launches"] * (
        chip.launch_us if launch_us is None else launch_us)
    least, most = find_memory(counts, chip, units)
    span = {"span": chip.milliseconds(counts["leastSpan"])}
    return Estimate({**busy, **least, **span}, {**busy, **most},
                    chip.milliseconds(counts["mostSpan"]))


@dataclass
class Frame:
    kernels: dict  # estimates by name
    least_ms: float
    most_ms: float
    waits: int


def find_launch(report, chip):
    """Microseconds of a launch: kernels of graphs take less."""
    host = report.get("host", {})
    kernels = host.get("launches", 0) + host.get("graphKernels", 0)
    part = host.get("graphKernels", 0) / kernels if kernels else 0
    return part * chip.graph_us + (1 - part) * chip.launch_us


def estimate_frame(report, chip):
    """`report` is what the driver for tests wrote."""
    launch_us = find_launch(report, chip)
    kernels = {name: estimate_kernel(counts, chip, launch_us)
               for name, counts in report["kernels"].items()}
    waits = report.get("host", {}).get("waits", 0)
    return Frame(kernels, sum(k.least_ms for k in kernels.values()),
                 sum(k.most_ms for k in kernels.values())
                 + waits * chip.wait_us * 1e-3, waits)
