#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Makes documents that were installed fit to what is installed beside them.

  install-documents.py --source SOURCE --include HEADERS FOLDER
  install-documents.py --check FOLDER

FOLDER has README.md, docs and examples of the tree SOURCE. A link to a public header
then leads into HEADERS, where those are installed, as it is called from FOLDER. A link
to what only the tree has, tests and results of measurements, becomes its text, and a
picture of these is left out. --check prints the links that lead nowhere.
"""

import argparse
import os
import pathlib
import re
import sys

from document_links import FENCED, find_dead, is_outside, leads_somewhere

# [text](target), ![text](target) and <img src="target">; a text may hold a picture.
PART = re.compile(
    r"(?P<mark>!?)\[(?P<text>(?:[^][]|\[[^][]*\])*)\]\((?P<target>[^)\s]+)\)"
    r"|<img [^>]*src=\"(?P<image>[^\"]+)\"[^>]*>")
HEADERS = ("runtime/include/", "include/")


class Documents:
    def __init__(self, folder, source, headers):
        self.folder, self.source, self.headers = folder, source, headers
        self.known = {}

    def find_header(self, page, target):
        """Where a link to a header of the tree leads now; none of another link."""
        file = os.path.normpath(page.parent.relative_to(self.folder) / target)
        for start in HEADERS:
            if file.startswith(start) and (self.source / file).exists():
                path = self.folder / self.headers / file.removeprefix(start)
                return os.path.relpath(path, page.parent)
        return None

    def rewrite(self, page, part):
        target = part["target"] or part["image"]
        if is_outside(target) or leads_somewhere(page, target, self.known):
            return part[0]
        if header := self.find_header(page, target):
            return part[0].replace(target, header)
        return "" if part["image"] or part["mark"] else part["text"]

    def rewrite_page(self, page):
        text = page.read_text()
        pieces, end = [], 0
        for fence in FENCED.finditer(text):
            pieces += [(text[end : fence.start()], True), (fence[0], False)]
            end = fence.end()
        pieces.append((text[end:], True))
        new = "".join(
            PART.sub(lambda part: self.rewrite(page, part), piece) if is_prose else piece
            for piece, is_prose in pieces)
        if new != text:
            page.write_text(new)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--source", type=pathlib.Path)
    parser.add_argument("--include", help="from FOLDER, such as ../../../include")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("folder", type=pathlib.Path)
    arguments = parser.parse_args()
    pages = sorted(arguments.folder.rglob("*.md"))
    if not pages:
        sys.exit(f"expected documents in '{arguments.folder}'")
    if arguments.check:
        dead = list(find_dead(pages))
        for page, target in dead:
            print(f"{page.relative_to(arguments.folder)}: nothing is where '{target}'"
                  " leads to")
        sys.exit(1 if dead else 0)
    if not arguments.source or not arguments.include:
        sys.exit("expected --source and --include, or --check")
    documents = Documents(arguments.folder, arguments.source, arguments.include)
    for page in pages:
        documents.rewrite_page(page)


if __name__ == "__main__":
    main()
