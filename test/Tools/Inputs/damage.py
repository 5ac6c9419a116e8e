# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Damages all entries of a cache: flips a bit, cuts them short, empties them."""

import pathlib
import sys

for entry in pathlib.Path(sys.argv[1]).glob("llvmcache-*"):
    data = bytearray(entry.read_bytes())
    if sys.argv[2] == "flip":
        data[len(data) // 2] ^= 1
    else:
        del data[len(data) // 2 if sys.argv[2] == "cut" else 0 :]
    entry.write_bytes(data)
