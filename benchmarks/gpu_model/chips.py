# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Published limits of chips, of `chips.json`, which names their sources."""

import json
import pathlib
from dataclasses import dataclass

DATA = pathlib.Path(__file__).with_name("chips.json")


@dataclass(frozen=True)
class Chip:
    """Counts are of a multiprocessor, unless their name says otherwise."""
    name: str
    compute_capability: str
    multiprocessors: int
    gigahertz: float
    issue: int  # warp instructions a cycle
    lanes: dict  # a cycle, by the kind of instruction
    l1_kilobytes: int  # with shared memory
    l1_bytes_per_clock: int
    l2_bytes_per_clock: int | None  # of the chip; None if not published
    l2_megabytes: float
    dram_gb_per_s: float
    arithmetic_cycles: int
    shared_cycles: int
    l1_cycles: int
    l2_cycles: int
    launch_us: float  # of a kernel after another in a stream
    graph_us: float  # in a graph
    wait_us: float  # of the host for the device, and the launch after it
    sources: tuple

    @property
    def latencies(self):
        """As PIKO_TEST_DRIVER_LATENCIES takes them."""
        return (f"{self.arithmetic_cycles},{self.shared_cycles},{self.l1_cycles},"
                f"{self.l2_cycles},{1024 * self.l1_kilobytes}")

    def milliseconds(self, cycles):
        return cycles / (self.gigahertz * 1e6)


def read_chips(file=DATA):
    """Chips by their names, and the texts of sources by theirs."""
    with open(file) as stream:
        data = json.load(stream)
    chips = {}
    for name, values in data["chips"].items():
        for source in values["sources"]:
            if source not in data["sources"]:
                raise ValueError(f"{name}: expected a source of the file, but got "
                                 f"'{source}'")
        chips[name] = Chip(name=name, **values)
    return chips, data["sources"]
