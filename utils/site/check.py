# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Whether each link of a site leads somewhere, and each page is linked to."""

import html.parser
import os
import re
import urllib.parse

# What a page loads, which must be the site's own.
LOADS = {("link", "href"), ("img", "src"), ("script", "src"), ("source", "src")}
# Most of the tags, which say nothing of links.
COLOURS = re.compile(r'<span(?: class="\w+")?>|</span>')


class Page(html.parser.HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.anchors, self.links, self.faults = set(), [], []
        self.feed(COLOURS.sub("", text))
        self.close()

    def handle_starttag(self, tag, attributes):
        line = self.getpos()[0]
        named = {v for n, v in attributes if n == "id" or tag == "a" and n == "name"}
        for twice in named & self.anchors:
            self.faults.append((line, f"'{twice}' is there twice"))
        self.anchors |= named
        for name, value in attributes:
            if name in ("href", "src"):
                load = (tag, name) in LOADS
                self.links.append((line, value or "", load))


def check(folder):
    """Prints each fault, and how much is right; whether there is none."""
    files = {str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()}
    pages = {f: Page((folder / f).read_text()) for f in files if f.endswith(".html")}
    faults, local, outside, reached = [], 0, 0, {"index.html"}
    for name, page in pages.items():
        faults += [(name, *fault) for fault in page.faults]
        for line, link, load in page.links:
            if re.match(r"[a-z][a-z+.-]*:|//", link, re.I):
                if load and not link.startswith("data:"):
                    faults.append((name, line, f"'{link}' is not of the site"))
                outside += not load
                continue
            path, _, anchor = link.partition("#")
            path = urllib.parse.unquote(path)
            target = os.path.normpath(os.path.join(os.path.dirname(name), path))
            target = target if path else name
            anchor = urllib.parse.unquote(anchor)
            known = pages[target].anchors if target in pages else ()
            if target not in files or anchor and anchor not in known:
                faults.append((name, line, f"nothing is where '{link}' leads to"))
            local += 1
            if target != name:
                reached.add(target)
    for name in sorted(set(pages) - reached):
        faults.append((name, 1, "no page links to it"))
    for name, line, fault in sorted(faults):
        print(f"{folder / name}:{line}: {fault}")
    print(f"{len(pages)} pages, {local} links within, {outside} links to elsewhere,"
          f" {len(faults)} faults")
    return not faults
