# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What runs did, and where their time went."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Tuple

from . import _core

_STATES = ("expected", "tried", "measured", "fixed")


@dataclass(frozen=True)
class KernelStats:
    """Of a kernel; milliseconds are sums over all runs. Of `ms`, `join_ms` is ordering
    and binning, `wait_ms` threads without work, on average."""

    name: str
    ms: float
    join_ms: float
    wait_ms: float
    launches: int
    parallel_launches: int


@dataclass(frozen=True)
class StageStats:
    """Of a stage: primitives that came in, pairs of primitive and bin that were
    processed, primitives that were emitted. A bin's size of 0 is the domain's."""

    name: str
    bin_size: Tuple[int, ...]
    taken: int
    placed: int
    emitted: int


@dataclass(frozen=True)
class Mapping:
    """A loop that a kernel holds as vectors and one at a time, and which of them runs;
    `ratio` is vectors' time over the other's, 0 if nothing was measured."""

    kernel: str
    number: int
    loop: str
    vectors: bool
    state: str
    ratio: float


@dataclass(frozen=True)
class Stats:
    """Sums over `runs`. `times` has the parts of a run, in milliseconds: kernels,
    waiting, joins, cycles, clears, allocation, program, device. `peak_bytes` is the most
    that bins and queues held, `reserved_bytes` all that the pipeline holds now."""

    runs: int
    kernels: Tuple[KernelStats, ...]
    stages: Tuple[StageStats, ...]
    mappings: Tuple[Mapping, ...]
    times: Dict[str, float]
    peak_bytes: int
    reserved_bytes: int

    @property
    def ms(self) -> float:
        """Milliseconds of a run, on average."""
        return sum(self.times.values()) / self.runs if self.runs else 0.0


def read_stats(core: _core.Pipeline) -> Stats:
    return Stats(
        core.runs(),
        tuple(KernelStats(*one) for one in core.kernels()),
        tuple(
            StageStats(name, tuple(size), *counts)
            for name, size, *counts in core.stages()
        ),
        tuple(
            Mapping(kernel, number, loop, vectors, _STATES[state], ratio)
            for kernel, number, loop, vectors, state, ratio in core.mappings()
        ),
        core.times(),
        core.peak_bytes(),
        core.reserved_bytes(),
    )
