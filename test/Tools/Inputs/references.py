#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Says how many objects of reference executors are in a cache."""

import pathlib
import sys

entries = [p.read_bytes() for p in pathlib.Path(sys.argv[1]).glob("llvmcache-*")]
found = [e for e in entries if b"\x7fELF" in e and b"piko_reference_program" in e]
print(f"{len(found)} references")
