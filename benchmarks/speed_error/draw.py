# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Charts for print, by matplotlib."""

from charts import COLORS
from outputs import save_figure


def place_zeros(values):
    """Where a logarithmic axis has what is 0: below the least other one."""
    positive = [v for v in values if v > 0]
    return min(positive, default=1) / 10


def remove_overlapping(figure, labels):
    """Those that would cover one before them."""
    renderer = figure.canvas.get_renderer()
    boxes = []
    for label in labels:
        box = label.get_window_extent(renderer)
        if any(box.overlaps(other) for other in boxes):
            label.remove()
        else:
            boxes.append(box)


def draw_choice(pyplot, choice, points, metric="rms"):
    """Milliseconds against error; a colour for each scene. Where names would
    cover one another, those on the front and the default's go first."""
    figure, axes = pyplot.subplots(figsize=(7, 4.8))
    zero = place_zeros([p.errors[metric] for p in points])
    labels = []

    def place(point):
        return point.errors[metric] or zero

    for i, scene in enumerate(dict.fromkeys(p.scene for p in points)):
        color = COLORS[i % len(COLORS)]
        own = [p for p in points if p.scene == scene]
        front = sorted((p for p in own if p.front), key=lambda p: p.ms)
        axes.plot([place(p) for p in front], [p.ms for p in front], "-",
                  color=color, alpha=0.5)
        for p in own:
            axes.errorbar(place(p), p.ms,
                          [[p.ms - min(p.times)], [max(p.times) - p.ms]],
                          fmt="o", color=color,
                          markerfacecolor=color if p.front else "white",
                          label=scene if p is own[0] else None)
            label = axes.annotate(p.setting, (place(p), p.ms), xytext=(6, 5),
                                  textcoords="offset points", fontsize=8)
            labels.append((p.setting != choice.default, not p.front, label))
    axes.set_xscale("log")
    axes.set_yscale("log")
    exact = any(p.errors[metric] == 0 for p in points)
    note = f"; at {zero:.1e}: none" if exact else ""
    axes.set_xlabel(f"{metric} error against {choice.against}{note}")
    axes.set_ylabel("ms a frame")
    axes.grid(which="both", color="#eeeeee")
    axes.set_axisbelow(True)
    axes.set_title(choice.title)
    axes.legend(frameon=False)
    figure.tight_layout()
    remove_overlapping(figure, [label for *_, label in
                                sorted(labels, key=lambda l: l[:2])])
    return figure


def write(pyplot, figure, stem):
    save_figure(figure, f"{stem}.svg")
    save_figure(figure, f"{stem}.png", dpi=110)
    pyplot.close(figure)
