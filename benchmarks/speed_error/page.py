# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""The page: charts that answer to the pointer, in one file."""

import base64
import json
import math
import os
from html import escape

from outputs import write_text
from speed_error.measure import METRICS

FOLDER = os.path.dirname(__file__)
COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"]
INTRODUCTION = """Time a frame against error, for each choice that a pipeline
leaves to its user. Lower left is better; points on a line are the Pareto front:
no other setting is both faster and nearer to the reference. A bar is the spread
of the rounds. Point at a setting to see its picture beside the reference, and the
command that repeats it."""


def read(name):
    with open(f"{FOLDER}/{name}") as file:
        return file.read()


def encode(file):
    kind = {"jpg": "jpeg"}.get(file.rsplit(".", 1)[1], file.rsplit(".", 1)[1])
    with open(file, "rb") as stream:
        data = base64.b64encode(stream.read()).decode()
    return f"data:image/{kind};base64,{data}"


def name(image):
    return os.path.basename(image)


def describe_point(point, reference):
    errors = {m: point.errors[m] for m in METRICS}
    # JSON has no infinity; 400 dB is more than floats can tell apart.
    errors["psnr"] = min(errors["psnr"], 400)
    return {"scene": point.scene, "setting": point.setting, "ms": point.ms,
            "least": min(point.times), "most": max(point.times),
            "command": point.command, "image": name(point.image),
            "map": name(point.map), "reference": name(reference), **errors}


def get_reference(point):
    return f"{point.image.rsplit('-', 1)[0]}-reference.jpg"


def describe_choice(choice, points):
    return {"name": choice.name, "title": choice.title,
            "against": choice.against,
            "points": [describe_point(p, get_reference(p)) for p in points]}


def write_table(points):
    head = ["setting", "scene", "ms", *METRICS, "front"]
    rows = [[p.setting, p.scene, f"{p.ms:.3g}",
             *("inf" if math.isinf(p.errors[m]) else f"{p.errors[m]:.3g}"
               for m in METRICS), "yes" if p.front else ""] for p in points]

    def row(tag, cells):
        return "<tr>" + "".join(f"<{tag}>{escape(c)}</{tag}>" for c in cells)

    return ("<details><summary>all figures</summary><table>" +
            row("th", head) + "".join(row("td", r) for r in rows) +
            "</table></details>")


def write_choice(choice, points, price):
    return f"""<h2>{escape(choice.title)}</h2>
<p>{escape(choice.text)} Error is against {escape(choice.against)}. {escape(price)}</p>
<div class="choice" id="{choice.name}"><div class="chart"></div><div class="view"></div></div>
{write_table(points)}"""


def write_mode(mode):
    shots = "".join(
        f'<figure><img src="{encode(file)}" alt="{escape(mode[who])}">'
        f'<figcaption class="quiet">{escape(mode[who])}</figcaption></figure>'
        for who, file in mode["pictures"].items())
    return f"""<figure id="mode-{mode['name']}"><h3>{escape(mode['title'])}</h3>
<p class="legend quiet"><span><i style="background:{COLORS[1]}"></i>{escape(mode['naive'])}</span>
<span><i style="background:{COLORS[0]}"></i>{escape(mode['ours'])}</span></p>
<div class="shots">{shots}</div></figure>"""


def write_page(file, measured, modes, notes):
    """`measured`: choices, each with its points and what its default costs."""
    points = [p for _, ps, _ in measured for p in ps]
    images = {image for p in points
              for image in (p.image, p.map, get_reference(p))}
    scenes = list(dict.fromkeys(p.scene for p in points))
    data = {"choices": [describe_choice(c, ps) for c, ps, _ in measured],
            "modes": [{k: v for k, v in m.items() if k != "pictures"}
                      for m in modes],
            "scenes": scenes,
            "images": {name(image): encode(image) for image in sorted(images)}}
    legend = "".join(
        f'<span><i style="background:{COLORS[i % len(COLORS)]}"></i>{escape(s)}'
        "</span>" for i, s in enumerate(scenes))
    options = "".join(f'<option value="{m}">{m}</option>' for m in
                      ["rms", *(m for m in METRICS if m != "rms")])
    body = "\n".join(write_choice(*each) for each in measured)
    failures = ("<h2>Where methods fail</h2><p>Error against how hard the scene "
                "is, of a naive method and of ours.</p><div class=\"modes\">" +
                "\n".join(write_mode(m) for m in modes) + "</div>") if modes else ""
    data = json.dumps(data).replace("</", "<\\/")
    text = f"""<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Piko: speed against error</title>
<style>{read("page.css")}</style>
<h1>Speed against error</h1>
<p>{INTRODUCTION}</p>
{"".join(f'<p class="quiet">{escape(n)}</p>' for n in notes)}
<div class="controls"><label>error: <select id="metric">{options}</select></label>
<span class="legend">{legend}</span></div>
{body}
{failures}
<script>const DATA = {data};</script>
<script>{read("page.js")}</script>
</html>
"""
    write_text(file, text)
