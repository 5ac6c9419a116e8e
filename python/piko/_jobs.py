# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Waiting for the compiler: for signals, too, and with a line on a terminal."""

from __future__ import annotations

import atexit
import os
from typing import Any

from . import _core
from ._progress import Progress

# How often signals are looked for.
_TICK = 0.05

# A process must not end while LLVM works in it; a child has no jobs of its parent.
atexit.register(_core.finish_jobs)
os.register_at_fork(after_in_child=_core.forget_jobs)


def finish(job: _core.Job, what: str) -> Any:
    """Waits for a job and returns it. Where a signal's handler raises an exception,
    as Ctrl-C does, that is raised at once; the compiler ends in the background."""
    with Progress(what):
        while not job.wait(_TICK):
            pass
    return job
