# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Figure 5 of the Piko paper: the part of a frame's kernels that each takes."""

from charts import COLORS
from suite.section import Section

from . import timing
from .frames import list_pipes

UNKNOWN = "the frame is one submission, whose kernels nobody times"
# One of three kernels, as the paper's, and the one of visibility.
PIPES = ["Fused", "Visibility"]


def measure(options, timer):
    rows, records, bars = [], [], {}
    for scene in options.scene:
        word = timing.name_scene(scene)
        timings, _ = timer.time_all(list_pipes(PIPES), scene, 1)
        for (_, pipe), it in timings.items():
            # What costs nothing, such as joins that have no kernel, is not shown.
            total = sum(it.kernels.values())
            if total <= 0:
                rows.append([word, pipe, "all", "not known", ""])
                records.append({"scene": word, "pipe": pipe, "kernel": "all",
                                "ms": "", "part": "", "how": UNKNOWN})
                continue
            parts = {name: ms / total for name, ms in it.kernels.items()
                     if ms > total / 1000}
            bars[f"{word}, {pipe}"] = parts
            for name, part in parts.items():
                rows.append([word, pipe, name, f"{it.kernels[name]:.3g} ms",
                             f"{part:.0%}"])
                records.append({"scene": word, "pipe": pipe, "kernel": name,
                                "ms": it.kernels[name], "part": part,
                                "how": timer.described})
    return Section(
        "figure5", f"Figure 5 of the Piko paper, {timer.described}",
        ["The part of the time of all kernels that each takes, with one light. In the "
         "paper scenes of small triangles spend more in triangle setup, those of "
         "large ones in the rasterizer. Not known: " + UNKNOWN + "; a profiler does, or "
         "--estimate."],
        ["scene", "pipeline", "kernel", "time", "part"], rows, records,
        lambda pyplot: draw(pyplot, bars))


def draw(pyplot, bars):
    """Nothing, where nothing is known."""
    figure, axes = pyplot.subplots(figsize=(9, 1.5 + 0.5 * len(bars)))
    names = list(dict.fromkeys(name for parts in bars.values() for name in parts))
    left = [0.0] * len(bars)
    for number, name in enumerate(names):
        widths = [100 * parts.get(name, 0) for parts in bars.values()]
        axes.barh(list(bars), widths, left=left, label=name,
                  color=COLORS[number % len(COLORS)],
                  hatch="//" if number >= len(COLORS) else None)
        left = [a + b for a, b in zip(left, widths)]
    axes.invert_yaxis()
    axes.set_xlim(0, 100)
    axes.set_xlabel("% of the time of kernels")
    if names:
        figure.legend(loc="upper center", ncols=4, frameon=False)
    figure.tight_layout(rect=(0, 0, 1, 0.88))
    return figure
