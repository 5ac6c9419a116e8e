# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Compiles the same file in many ways, of which the first is asked for again
each time: the cache must stay below PIKO_CACHE_SIZE and keep the first."""

import os
import pathlib
import subprocess
import sys

cache, command = pathlib.Path(sys.argv[1]), sys.argv[2:]
limit = int(os.environ["PIKO_CACHE_SIZE"])


def compile(number):
    options = ["--cache-dir", str(cache), f"--namespace=n{number}"]
    subprocess.run(command + options, check=True, stderr=subprocess.DEVNULL)
    return {entry.name for entry in cache.glob("llvmcache-*")}


first = compile(0)
everything = set(first)
for number in range(1, 8):
    now = compile(number) | compile(0)
    everything |= now
    size = sum(entry.stat().st_size for entry in cache.glob("llvmcache-*"))
    assert size <= limit, f"{size} bytes are kept"
    assert first <= now, "the entries that were read last are gone"
assert len(everything) == 16, f"{len(everything)} entries were made"
left = {entry.name for entry in cache.glob("llvmcache-*")}
assert left < everything, "nothing was removed"
