# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""What benchmarks run."""

import shlex
import subprocess
import sys

from progress import ROOT, load

run_main = load(f"{ROOT}/utils/tool.py").run_main


def call(command, cwd=None):
    done = subprocess.run(command, capture_output=True, text=True, cwd=cwd)
    if done.returncode:
        sys.exit(f"'{shlex.join(command)}' ended with {done.returncode}:\n"
                 f"{done.stderr}")
    return done.stdout
