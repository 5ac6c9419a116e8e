# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Figures 4a to 4c of the Piko paper: mappings of one rasterizer."""

from charts import COLORS
from figure4 import PANELS
from suite.section import Section

from . import timing

# As in the paper; (d) is ours.
PAPER = PANELS[:3]


def measure(options, timer):
    pipes = list(dict.fromkeys(
        pipe for _, shown, base in PAPER for pipe in (base, *shown)))
    ratios, rows, records = {}, [], []
    for scene in options.scene:
        word = timing.name_scene(scene)
        for lights in options.lights:
            timings, _ = timer.time_all(
                [(timing.RASTER, pipe) for pipe in pipes], scene, lights)
            times = {pipe: it for (_, pipe), it in timings.items()}
            if len({it.image_hash for it in times.values()}) > 1:
                raise ValueError(f"{word}: expected one image of {', '.join(pipes)}")
            for title, (pipe,), base in PAPER:
                ratio = times[pipe].ms / times[base].ms
                ratios.setdefault((title, word), []).append(ratio)
                rows.append([word, str(lights), pipe, base, str(times[pipe]),
                             str(times[base]), f"{ratio:.2f}"])
            records += [{"scene": word, "lights": lights, "pipe": pipe,
                         "how": timer.described, **it.as_record()}
                        for pipe, it in times.items()]
    return Section(
        "figure4", f"Figure 4 of the Piko paper, {timer.described}",
        ["Frame time relative to another mapping of the same rasterizer: lower is "
         "better. The paper's are of a Tesla K40c, of other scenes."],
        ["scene", "lights", "pipeline", "relative to", "of the pipeline",
         "of the other", "ratio"],
        rows, records, lambda pyplot: draw(pyplot, ratios, options.lights, timer))


def draw(pyplot, ratios, lights, timer):
    figure, axes = pyplot.subplots(1, len(PAPER), figsize=(11, 4))
    words = list(dict.fromkeys(word for _, word in ratios))
    for (title, _, base), where in zip(PAPER, axes):
        for color, word in zip(COLORS, words):
            where.plot(lights, ratios[title, word], "-o", color=color, label=word)
        where.axhline(1, color="black", linewidth=1, linestyle=":")
        where.set_title(title, fontsize=11)
        where.set_xscale("log")
        where.set_xticks(lights, [str(n) for n in lights])
        where.minorticks_off()
        where.set_xlabel("number of lights")
        where.set_ylabel(f"frame time relative to {base}" +
                         (", estimated" if timer.estimated else ""))
        where.set_ylim(0, max(1.3, 1.1 * where.dataLim.ymax))
        where.grid(axis="y", color="#dddddd")
    axes[0].legend(frameon=False)
    figure.tight_layout()
    return figure
