# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What benchmarks run."""

import subprocess
import sys


def call(command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return done.stdout
