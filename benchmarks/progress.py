# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""How far a benchmark has got, on a terminal: the line of the Python module, which need
not be built for that."""

import importlib.util
import os

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def load(path):
    spec = importlib.util.spec_from_file_location("piko_progress", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


Progress = load(f"{ROOT}/python/piko/_progress.py").Progress
