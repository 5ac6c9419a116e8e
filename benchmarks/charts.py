# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Charts, where Debian's python3-matplotlib is installed."""

# Told apart by all eyes.
COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00"]


def find_pyplot():
    """None where there is no matplotlib."""
    try:
        import matplotlib
    except ImportError:
        return None
    matplotlib.use("Agg")
    from matplotlib import pyplot

    pyplot.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "piko"})
    return pyplot
