# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Links of documents in Markdown to files and headings beside them."""

import re

LINK = re.compile(r"\]\(([^)\s]+)\)|(?:src|href)=\"([^\"]+)\"")
FENCED = re.compile(r"^ *```.*?^ *```", re.S | re.M)


def anchors(text):
    """What links within a document can name, as GitHub makes it of headings."""
    found = set(re.findall(r"<a (?:id|name)=\"([^\"]+)\"", text))
    for heading in re.findall(r"^#+ (.+)$", FENCED.sub("", text), re.M):
        heading = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading)
        name = re.sub(r"[^\w\- ]", "", heading.lower().strip()).replace(" ", "-")
        number = 0
        while (unique := f"{name}-{number}" if number else name) in found:
            number += 1
        found.add(unique)
    return found


def is_outside(target):
    return bool(re.match(r"\w+:", target))


def leads_somewhere(page, target, known):
    """Whether there is what a link of a page names; `known` has anchors by file."""
    file, _, anchor = target.partition("#")
    path = page.parent / file if file else page
    if path.suffix == ".md" and path.is_file() and path not in known:
        known[path] = anchors(path.read_text())
    return path.exists() and (not anchor or anchor in known.get(path, ()))


def find_dead(pages):
    """(page, target) of each link that leads nowhere."""
    known = {}
    for page in pages:
        for link in LINK.finditer(FENCED.sub("", page.read_text())):
            target = link[1] or link[2]
            if not is_outside(target) and not leads_somewhere(page, target, known):
                yield page, target
