# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Whole frames of the rasterizers, beside peers such as cudaraster."""

from suite.raster import measure_peer
from suite.section import Section, draw_groups

from . import timing


def list_pipes(names):
    """(example, pipeline)"""
    return [(timing.VISIBILITY if name == "Visibility" else timing.RASTER, name)
            for name in names]


def check_images(timings):
    """All pipelines of one example draw one image."""
    hashes = {}
    for (example, pipe), it in timings.items():
        first = hashes.setdefault(example, (pipe, it.image_hash))
        if it.image_hash != first[1]:
            raise ValueError(f"expected the image of {first[0]}, but got another of "
                             f"{pipe}")


def list_peers(options, scene, lights):
    """What measures each of them once."""
    size = {"width": options.width, "height": options.height}
    return {peer[0]: lambda peer=peer: measure_peer(peer, scene, lights, 1, size)
            for peer in options.peer}


def measure(options, timer):
    rows, records, bars = [], [], {}
    for scene in options.scene:
        word = timing.name_scene(scene)
        for lights in options.lights:
            timings, peers = timer.time_all(
                list_pipes(options.pipes), scene, lights,
                list_peers(options, scene, lights))
            check_images(timings)
            fastest = min(it.ms for it in timings.values())
            bars[f"{word}, {lights}"] = {
                **{pipe: it.ms for (_, pipe), it in timings.items()},
                **{name: it.median for name, it in peers.items()}}
            for (_, pipe), it in timings.items():
                rows.append([word, f"{it.triangles:,}", str(lights), pipe, str(it),
                             f"{it.ms / fastest:.2f}"])
                records.append({"scene": word, "triangles": it.triangles,
                                "lights": lights, "who": pipe, "how": timer.described,
                                **it.as_record()})
            for name, it in peers.items():
                rows.append([word, "", str(lights), name, str(it),
                             f"{it.median / fastest:.2f}"])
                records.append({"scene": word, "triangles": "", "lights": lights,
                                "who": name, "how": "measured", "ms": it.median,
                                "least_ms": "", "most_ms": "", "image_hash": ""})
    who = list(next(iter(bars.values())))
    return Section(
        "frames", f"Frames, {timer.described}",
        [f"{options.width} x {options.height}. An estimate is what was counted, "
         "against a chip's limits: at least, and at most; the host's work is not in "
         "it. What peers take is measured."
         if timer.estimated else
         f"{options.width} x {options.height}, medians of {options.rounds} rounds. "
         "What the host does of a frame is in it.",
         "The last column is relative to the fastest of ours."],
        ["scene", "triangles", "lights", "who", "milliseconds", "relative"],
        rows, records,
        lambda pyplot: draw_groups(
            pyplot, list(bars),
            {name: [times.get(name) for times in bars.values()] for name in who},
            f"milliseconds, {'estimated' if timer.estimated else 'measured'}",
            log=True))
