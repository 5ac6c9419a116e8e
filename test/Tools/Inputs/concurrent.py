# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Compiles the same file in several processes at once, with one cache, and ends
some of them on the way: whoever finishes has the right object, and what is left
in the cache is whole."""

import pathlib
import subprocess
import sys
import time

work, expected, command = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3:]
work.mkdir()
expected = pathlib.Path(expected).read_bytes()


def start(name):
    return subprocess.Popen(
        command + ["--cache-dir", str(work / "cache"), "-o", str(work / name)],
        stderr=subprocess.DEVNULL,
    )


for wave in range(2):
    names = [f"{wave}-{number}.o" for number in range(6)]
    processes = [start(name) for name in names]
    time.sleep(0.02)
    processes[0].kill()
    assert [process.wait() for process in processes][1:] == [0] * 5
    for name in names[1:]:
        assert (work / name).read_bytes() == expected, name
    # Whole or not there, never half.
    if (work / names[0]).exists():
        assert (work / names[0]).read_bytes() == expected
assert start("last.o").wait() == 0
assert (work / "last.o").read_bytes() == expected
