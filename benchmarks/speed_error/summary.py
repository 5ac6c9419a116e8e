# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Which settings are on the Pareto front, and where methods fail, as tables."""

from outputs import write_text


def write_row(cells):
    return "| " + " | ".join(cells) + " |"


def write_fronts(measured):
    lines = [write_row(["choice", "scene", "Pareto front, from the fastest on",
                        "default", "is on it"]), "|---|---|---|---|---|"]
    for choice, points, _ in measured:
        for scene in dict.fromkeys(p.scene for p in points):
            own = [p for p in points if p.scene == scene]
            front = sorted((p for p in own if p.front), key=lambda p: p.ms)
            text = ", ".join(f"{p.setting} ({p.ms:.3g} ms, "
                             f"{p.errors['rms']:.2g})" for p in front)
            default = next(p for p in own if p.setting == choice.default)
            where = "yes" if default.front else (
                f"no ({default.ms:.3g} ms, {default.errors['rms']:.2g})")
            lines.append(write_row([choice.title, scene, text, choice.default,
                                    where]))
    return lines


def write_failures(modes):
    lines = [write_row(["scenes", "the hardest", "error", "naive", "ours"]),
             "|---|---|---|---|---|"]
    for mode in modes:
        hardest = mode["points"][-1]
        lines.append(write_row(
            [mode["title"], f"{hardest['scene']:g} {mode['hardness']}",
             mode["error"], f"{hardest['naive']:.3g} ({mode['naive']})",
             f"{hardest['ours']:.3g} ({mode['ours']})"]))
    return lines


def write_summary(measured, modes, file):
    lines = write_fronts(measured)
    if modes:
        lines += ["", *write_failures(modes)]
    write_text(file, "\n".join(lines) + "\n")
