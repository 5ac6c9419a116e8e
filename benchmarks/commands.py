# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What benchmarks run."""

import subprocess
import sys


def call(command, cwd=None):
    done = subprocess.run(command, capture_output=True, text=True, cwd=cwd)
    if done.returncode:
        sys.exit(f"{' '.join(command)}\n{done.stderr}")
    return done.stdout
