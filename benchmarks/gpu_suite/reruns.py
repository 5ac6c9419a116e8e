# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""One image, however often it is drawn."""

from collections import Counter

from suite.section import Section, draw_groups

from . import timing
from .frames import list_pipes


def measure(options, timer):
    rows, records, counts = [], [], {}
    scene = options.scene[0]
    word = timing.name_scene(scene)
    for example, pipe in list_pipes(options.pipes):
        hashes = Counter(timer.rerun(example, pipe, scene, turn + 1)
                         for turn in range(options.reruns))
        if len(hashes) > 1:
            raise ValueError(f"{pipe}: expected one image of {options.reruns} runs, "
                             f"but got {len(hashes)}")
        image = next(iter(hashes))
        counts[pipe] = len(hashes)
        rows.append([word, pipe, str(options.reruns), str(len(hashes)), image])
        records.append({"scene": word, "pipe": pipe, "runs": options.reruns,
                        "images": len(hashes), "image_hash": image})
    how = ("in other orders of blocks, warps and lanes, behind the driver for tests"
           if timer.estimated else timer.described)
    return Section(
        "reruns", "One image, however often it is drawn",
        [f"Runs of {word}, each a process of its own, {how}. More than one image ends "
         "this with an error."],
        ["scene", "pipeline", "runs", "images", "hash"], rows, records,
        lambda pyplot: draw_groups(pyplot, list(counts),
                                   {"images": list(counts.values())}, "images"))
