# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Waiting for the compiler: for signals, too, and with a line on a terminal."""

from __future__ import annotations

import atexit
import os
import sys
import time
from typing import Any, Optional, TextIO

from . import _core

# Seconds that a compilation takes before anything is said of it.
QUIET = 2.0
# How often signals are looked for.
_TICK = 0.05

# A process must not end while LLVM works in it; a child has no jobs of its parent.
atexit.register(_core.finish_jobs)
os.register_at_fork(after_in_child=_core.forget_jobs)


class _Progress:
    """A line that counts seconds, where standard error is a terminal."""

    def __init__(self, what: str) -> None:
        self._what = what
        self._begin = time.monotonic()
        self._shown = -1
        self._stream: Optional[TextIO] = None
        if sys.stderr is not None and sys.stderr.isatty():
            self._stream = sys.stderr

    def tick(self) -> None:
        seconds = time.monotonic() - self._begin
        if self._stream and seconds > QUIET and int(seconds) != self._shown:
            self._shown = int(seconds)
            self._stream.write(f"\rpiko: {self._what}: {self._shown} s")
            self._stream.flush()

    def end(self) -> None:
        if self._stream and self._shown >= 0:
            self._stream.write("\r\x1b[K")
            self._stream.flush()


def finish(job: _core.Job, what: str) -> Any:
    """Waits for a job and returns it. Where a signal's handler raises an exception,
    as Ctrl-C does, that is raised at once; the compiler ends in the background."""
    progress = _Progress(what)
    try:
        while not job.wait(_TICK):
            progress.tick()
    finally:
        progress.end()
    return job
