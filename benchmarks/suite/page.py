# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""A page with all tables and charts, in one file."""

import base64
import datetime
import os
import platform
import shlex
import sys
from html import escape

from charts import find_pyplot
from commands import call
from figure4 import print_table
from outputs import save_figure, write_csv, write_text

STYLE = """
body { font: 15px/1.45 sans-serif; max-width: 60em; margin: 2em auto; }
table { border-collapse: collapse; margin: 1em 0; }
th, td { padding: .25em .7em; border-bottom: 1px solid #ccc; text-align: right; }
th:first-child, td:first-child { text-align: left; }
img { max-width: 100%; }
"""


def find_processor():
    try:
        with open("/proc/cpuinfo") as file:
            names = [line.split(":", 1)[1].strip() for line in file
                     if line.startswith("model name")]
        return names[0]
    except (OSError, IndexError):
        return platform.machine()


def name_command():
    return f"benchmarks/{os.path.basename(sys.argv[0])}"


def describe_machine():
    versions = [call([tool, "--version"]).splitlines()[0]
                for tool in ("g++", "clang++-22")]
    return [
        f"{find_processor()}, {os.cpu_count()} threads; {platform.platform()}.",
        "; ".join(versions) + ".",
        f"Made on {datetime.date.today()} by "
        f"`{shlex.join([name_command(), *sys.argv[1:]])}`. "
        f"Load before: {os.getloadavg()[0]:.2f}; numbers count only from a "
        "machine that does nothing else.",
    ]


def write_table(section):
    def row(tag, cells):
        return "<tr>" + "".join(f"<{tag}>{escape(c)}</{tag}>" for c in cells)

    lines = [row("th", section.head), *(row("td", r) for r in section.rows)]
    return "<table>\n" + "\n".join(lines) + "\n</table>"


def write_section(section, folder):
    """With the chart, if it has been drawn."""
    text = [f'<h2 id="{section.name}">{escape(section.title)}</h2>']
    text += [f"<p>{escape(note)}</p>" for note in section.notes]
    text.append(write_table(section))
    chart = f"{folder}/{section.name}.svg"
    if os.path.exists(chart):
        with open(chart, "rb") as file:
            data = base64.b64encode(file.read()).decode()
        text.append(f'<img alt="{escape(section.title)}" '
                    f'src="data:image/svg+xml;base64,{data}">')
    return "\n".join(text)


def write_page(sections, machine, folder):
    body = "\n".join(write_section(section, folder) for section in sections)
    notes = "\n".join(f"<p>{escape(line)}</p>" for line in machine)
    write_text(f"{folder}/index.html",
               f"<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">"
               f"\n<title>Piko: benchmarks</title>\n<style>{STYLE}</style>\n"
               f"<h1>Benchmarks</h1>\n{notes}\n{body}\n</html>\n")


def measure_all(names, measure, notes, folder):
    """Measures a section for each name, prints its table, and writes its CSV file and
    chart into the folder, and a page with all that there are so far. `measure` takes a
    name; charts are left out where matplotlib is not installed. Returns the
    sections."""
    program = os.path.splitext(os.path.basename(sys.argv[0]))[0]
    pyplot = find_pyplot()
    sections = []
    for name in names:
        print(f"{program}: {name}", file=sys.stderr, flush=True)
        section = measure(name)
        write_csv(f"{folder}/{name}.csv", section.records)
        if pyplot:
            save_figure(section.draw(pyplot), f"{folder}/{name}.svg")
        print(f"\n{section.title}")
        print_table(section.head, section.rows)
        sections.append(section)
        write_page(sections, notes, folder)
    print(f"\n{folder}/index.html")
    return sections
