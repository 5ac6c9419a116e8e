#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Stands in for pikoc: a pipeline of two kernels, of which one spills."""
import sys

if "--list-pipes" in sys.argv:
    print("P")
else:
    print("""Pipeline P

On sm_90, as ptxas says:
  threads  block memory  registers  stack  spilled  occupancy  kernel
       64           264         48      0        0       66 %  cold
       64           264         80     16        8       38 %  hot""")
