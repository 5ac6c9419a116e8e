# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""How far some work has got, on a terminal and nowhere else, as Piko's tools show it.

Uses nothing else of the package: benchmarks have it, too."""

from __future__ import annotations

import os
import sys
import threading
import time
from types import TracebackType
from typing import List, Optional, TextIO, Type

# How often lines are drawn, and how long the thread that does it waits for more work.
_TICK, _IDLE = 0.1, 1.0


def _read_threshold() -> float:
    """Of $PIKO_PROGRESS_AFTER; two seconds if it is no number."""
    try:
        return min(max(float(os.environ.get("PIKO_PROGRESS_AFTER", "")), 0.0), 1e6)
    except ValueError:
        return 2.0


class Progress:
    """Shows a line on standard error while some work lasts, if that is a terminal and
    the work takes longer than two seconds ($PIKO_PROGRESS_AFTER: another number of them;
    with 0 each change is shown at once). The line is wiped at the end.

    Of works that are parts of another one, that one's line is shown. To begin and to
    end costs next to nothing: one thread watches all.
    """

    def __init__(self, label: str) -> None:
        """`label` is what is done, as in "compiling a.piko.cpp"."""
        self._label = label
        self._begin = time.monotonic()
        self._part = -1.0  # unknown if below 0
        self._is_shown = False
        self._stream: Optional[TextIO] = None
        self._after = 0.0
        if sys.stderr is not None and sys.stderr.isatty():
            self._stream = sys.stderr
            self._after = _read_threshold()

    def __enter__(self) -> Progress:
        if self._stream is not None:
            _watcher.add(self)
        return self

    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        value: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        if self._stream is not None:
            _watcher.remove(self)

    def update(self, part: float) -> None:
        """The part that is done, from 0 to 1."""
        self._part = min(max(part, 0.0), 1.0)
        if self._stream is not None and self._after == 0:
            _watcher.draw()

    def say(self, line: str) -> None:
        """Prints a line on standard output, which stays, a terminal or not."""
        with _watcher.lock:
            self.wipe()
            print(line, flush=True)

    def draw(self) -> None:
        """Under the watcher's lock, as what follows."""
        seconds = time.monotonic() - self._begin
        if self._stream is None or seconds < self._after:
            return
        if self._part >= 0:
            bar = "#" * int(self._part * 40)
            said = f" [{bar:.<40}] {int(self._part * 100)}%"
        else:
            said = f" ... {int(seconds)} s"
        self._stream.write(f"\r{self._label}{said}\x1b[K")
        self._stream.flush()
        self._is_shown = True

    def wipe(self) -> None:
        if self._is_shown and self._stream is not None:
            self._stream.write("\r\x1b[K")
            self._stream.flush()
        self._is_shown = False


class _Watcher:
    """Draws the line of the first of all works that are going on."""

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self._works: List[Progress] = []
        self._thread: Optional[threading.Thread] = None

    def add(self, work: Progress) -> None:
        with self.lock:
            self._works.append(work)
            if work._after == 0:
                self.draw()
            if self._thread is None:
                self._thread = threading.Thread(target=self._watch, daemon=True)
                try:
                    self._thread.start()
                except RuntimeError:  # without one to spare the work goes on unseen
                    self._thread = None

    def remove(self, work: Progress) -> None:
        with self.lock:
            self._works.remove(work)
            work.wipe()

    def draw(self) -> None:
        with self.lock:
            if self._works:
                self._works[0].draw()

    def _watch(self) -> None:
        idle = 0.0
        while True:
            time.sleep(_TICK)
            with self.lock:
                idle = 0.0 if self._works else idle + _TICK
                if idle > _IDLE:
                    self._thread = None
                    return
                self.draw()


_watcher = _Watcher()


def _forget() -> None:
    """A child has no thread of its parent's."""
    global _watcher
    _watcher = _Watcher()


os.register_at_fork(after_in_child=_forget)
