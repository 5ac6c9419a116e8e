# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Charts, where Debian's python3-matplotlib is installed."""

import os

# Told apart by all eyes.
COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00"]


def find_pyplot():
    """None where there is no matplotlib."""
    # Its numerics may bind this thread to a core, by OMP_PROC_BIND, and what is
    # measured would be bound there, too.
    cores = os.sched_getaffinity(0)
    try:
        import matplotlib
    except ImportError:
        return None
    matplotlib.use("Agg")
    from matplotlib import pyplot

    os.sched_setaffinity(0, cores)
    pyplot.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "piko"})
    return pyplot
