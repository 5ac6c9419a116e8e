#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Tables of what the GPU kit has measured on a card.

  gpu-results.py RESULTS.jsonl --out gpu-measured.md

Writes OUT and, beside it, OUT's name with -lights.svg where Debian's
python3-matplotlib is installed. Of things that were done twice, as by `run.sh --from`,
the last counts. docs/GPU.md says how the results come about.
"""

import argparse
import json
import os
import sys

from charts import COLORS, find_pyplot
from outputs import save_figure, write_text
from commands import run_main

BASE = "Baseline"


def read(path):
    """(step, name): what was noted last."""
    found = {}
    with open(path, encoding="utf-8") as file:
        for number, line in enumerate(file, 1):
            try:
                told = json.loads(line)
                found[told["step"], told["name"]] = told
            except (ValueError, KeyError, TypeError):
                sys.exit(f"gpu-results.py: {path}:{number}: expected a result of run.sh, "
                         f"but got {line.strip()[:80]!r}")
    if not found:
        sys.exit(f"gpu-results.py: {path}: expected results")
    return found


def table(head, rows):
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines) + "\n"


def summarize(results):
    rows = []
    for step in dict.fromkeys(step for step, _ in results):
        of_step = [told for (other, _), told in results.items() if other == step]
        counts = [sum(told["status"] == status for told in of_step)
                  for status in ("ok", "failed", "left", "absent")]
        rows.append([step, *counts, f"{sum(it.get('seconds', 0) for it in of_step):.0f}"])
    return table(["step", "ok", "failed", "left for want of time",
                  "that the machine lacks", "seconds of its processes"], rows)


def list_reasons(results, status):
    """Of what has that status, the first line of what it said; empty if nothing has."""
    rows = [[step, name, told.get("text", "").strip().splitlines()[0][:160]
             .replace("|", "\\|") if told.get("text", "").strip() else told.get("code")]
            for (step, name), told in results.items() if told["status"] == status]
    return table(["step", "what", "why"], rows) if rows else ""


def list_smoke(results):
    rows = [[name, told["status"], f"{told.get('seconds', 0):.2f} s"]
            for (step, name), told in results.items() if step == "smoke"
            and name != "kit"]
    return table(["what", "", "with loading"], rows) if rows else ""


def frames_of(results):
    """{(scene, lights): {pipe: told}} of frames, and the same of kernels by themselves."""
    frames, kernels = {}, {}
    for (step, _), told in results.items():
        if step == "time" and told["status"] == "ok" and "told" in told:
            pipe, scene, lights = (told[key] for key in ("pipe", "scene", "lights"))
            if told["example"] not in ("raster", "visibility"):
                pipe = f"{told['example']} {pipe}"
            into = kernels if "kernels" in told["told"] and any(
                "ms" in it for it in told["told"]["kernels"]) else frames
            into.setdefault((scene, int(lights)), {})[pipe] = told["told"]
    return frames, kernels


def opengl_of(results):
    """{(scene, lights): {technique: told}} of frames by OpenGL."""
    found = {}
    for (step, _), told in results.items():
        if step == "opengl" and told["status"] == "ok" and "technique" in told:
            key = told["scene"], int(told["lights"])
            found.setdefault(key, {})[told["technique"]] = told["told"]
    return found


def describe_opengl(opengl):
    """By what it was drawn, and how far its pictures are from Piko's."""
    all_told = [told for techniques in opengl.values() for told in techniques.values()]
    if not all_told:
        return ""
    renderers = dict.fromkeys(f"{it['renderer']}, {it['version']}" for it in all_told)
    differing = [it["differs"] for it in all_told if "differs" in it]
    compared = (f"; of its pictures at most {max(differing):,} pixels differ from Piko's "
                "by more than 2 of 255" if differing else "")
    return (f"OpenGL is {'; '.join(renderers)}: fragments are shaded in the mesh's order "
            f"(forward), or after a pass of depths (prepass){compared}. What is over "
            "OpenGL is over the faster of these.\n")


def device_of(told):
    return told.get("time", {}).get("device_ms", 0)


def list_frames(frames, peers, opengl):
    """Wall clock and the device's events; beside them what Baseline takes."""
    rows = []
    for scene, lights in sorted({*frames, *opengl}):
        pipes = frames.get((scene, lights), {})
        techniques = opengl.get((scene, lights), {})
        base = pipes.get(BASE, {}).get("ms_median")
        best = min([it["ms_median"] for it in pipes.values()], default=0)
        peer = peers.get(scene, {}).get("told", {}).get("ms_median")
        other = min([it["wall_ms_median"] for it in techniques.values()], default=0)
        for technique, told in techniques.items():
            ms = told["wall_ms_median"]
            rows.append([scene, f"{told['tris']:,}", lights, f"OpenGL {technique}",
                         f"{ms:.3f}", f"{told['wall_ms_min']:.3f}",
                         f"{told['ms_median']:.3f}", f"{ms / base:.2f}" if base else "",
                         f"{ms / other:.2f}" if other else "", ""])
        for pipe, told in pipes.items():
            ms = told["ms_median"]
            rows.append([scene, f"{told.get('tris', 0):,}", lights,
                         f"**{pipe}**" if ms == best and len(pipes) > 1 else pipe,
                         f"{ms:.3f}", f"{told['ms_min']:.3f}", f"{device_of(told):.3f}",
                         f"{ms / base:.2f}" if base else "",
                         f"{ms / other:.2f}" if other else "",
                         f"{ms / peer:.2f}" if peer and lights == 1 else ""])
    return table(["scene", "triangles", "lights", "pipeline", "ms, median", "least",
                  "of them on the device", f"over {BASE}", "over OpenGL",
                  "over the peer"], rows)


def list_kernels(kernels):
    rows = []
    for (scene, _), pipes in sorted(kernels.items()):
        for pipe, told in pipes.items():
            for kernel in told["kernels"]:
                own = kernel.get("ms", 0) - kernel.get("join_ms", 0)
                rows.append([scene, pipe, kernel["name"], f"{own:.3f}",
                             f"{kernel.get('join_ms', 0):.3f}"])
    return table(["scene", "pipeline", "kernel", "ms", "its join, ms"], rows)


def draw_lights(frames, path):
    """Figure 4: pipelines over Baseline, by the number of lights; False where there is
    nothing to draw, or no matplotlib."""
    lines = {}
    for (scene, lights), pipes in sorted(frames.items()):
        base = pipes.get(BASE, {}).get("ms_median")
        for pipe, told in pipes.items():
            if base:
                lines.setdefault(scene, {}).setdefault(pipe, []).append(
                    (lights, told["ms_median"] / base))
    pyplot = find_pyplot()
    if not lines or not pyplot:
        return False
    figure, panels = pyplot.subplots(1, len(lines), squeeze=False,
                                     figsize=(4.5 * len(lines), 4))
    for axes, (scene, pipes) in zip(panels[0], lines.items()):
        for i, (pipe, points) in enumerate(pipes.items()):
            axes.plot(*zip(*points), "-o", label=pipe, color=COLORS[i % len(COLORS)],
                      linestyle=["-", "--", ":"][i // len(COLORS) % 3])
        axes.set_xscale("log")
        axes.set_title(scene)
        axes.set_xlabel("lights")
        axes.grid(color="#dddddd")
    panels[0][0].set_ylabel(f"frame time over {BASE}")
    panels[0][-1].legend(fontsize="small", frameon=False)
    figure.tight_layout()
    save_figure(figure, path)
    return True


def write_page(results, out):
    frames, kernels = frames_of(results)
    opengl = opengl_of(results)
    peers = {name.removeprefix("peer "): told for (step, name), told in results.items()
             if step == "peer" and told["status"] == "ok"}
    card = results.get(("smoke", "kit"), {})
    chart = os.path.splitext(out)[0] + "-lights.svg"
    parts = ["# On a card\n",
             f"{card.get('device', 'An unknown device')}; tree: commit "
             f"{card.get('commit', 'unknown')}. By `run.sh` of the GPU kit; "
             "`benchmarks/gpu-results.py` has made this page.\n",
             summarize(results), "## What failed\n",
             list_reasons(results, "failed") or "Nothing failed.\n"]
    if absent := list_reasons(results, "absent"):
        parts += ["## What the machine lacks\n", absent]
    if smoke := list_smoke(results):
        parts += ["## Each thing by itself\n", smoke]
    if frames or opengl:
        parts += ["## Frames\n",
                  "1024 x 768. The median by the host's clock, the least, and what the "
                  "device's events say of a mean frame, of OpenGL a median one. The fastest "
                  "pipeline of a scene is bold.\n",
                  describe_opengl(opengl), list_frames(frames, peers, opengl)]
        if draw_lights(frames, chart):
            parts.append(f"![frame times over {BASE}]({os.path.basename(chart)})\n")
    if kernels:
        parts += ["## Kernels\n",
                  "Launched one by one, in frames of their own: they sum to more than a "
                  "frame.\n", list_kernels(kernels)]
    write_text(out, "\n".join(parts))


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results")
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    write_page(read(arguments.results), arguments.out)


if __name__ == "__main__":
    run_main(main)
