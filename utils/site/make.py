#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""make.py --out FOLDER: the repository's documents as a static site.

A Markdown file NAME.md becomes NAME.html in the same place, README.md index.html. What
documents link to is taken in, too: pictures and tables as copies, texts and folders as
pages in source/. The API reference in api/ is Doxygen's. At the end each link and anchor
of all pages must lead somewhere, and each page be linked to.

For Debian's Python, with the packages of utils/packages-site.txt. --no-api leaves out
the reference, and needs no Doxygen; --check looks at a folder that is there.
"""

import argparse
import html
import os
import pathlib
import re
import shutil
import string
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent))
import api
import check
import lint
from page import Page, highlight
from tool import run_main

ROOT = lint.ROOT
# What the navigation is made of: the links of each of its sections.
INDEX = "docs/README.md"
LESSONS = "examples/lessons/"
RESULTS = "benchmarks/results/"
FIRST = ["README.md", INDEX, "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "LICENSE"]
COPIED = {".csv", ".html", ".png", ".svg"}


def relative(url, base):
    """What a page at `base` writes to link to `url`; both are paths in the site."""
    return os.path.relpath(url, os.path.dirname(base) or ".")


class Site:
    root = ROOT
    templates = ROOT / "docs" / "site"

    def __init__(self, out, api):
        self.out, self.api = out, api
        self.files = set(lint.sources())
        self.folders = {str(p) for f in self.files for p in pathlib.PurePath(f).parents}
        self.urls, self.queue, self.pages = {}, [], {}
        self.template = string.Template((self.templates / "page.html").read_text())
        index = self.page(INDEX)
        self.navigation = []  # each section: its name, and its pages
        name = ""
        for block in index.tokens:
            if block.type == "inline":
                if block.level == 1 and block.content in [s[1] for s in index.sections]:
                    name = block.content
                    self.navigation.append((name, []))
                for part in block.children if name else []:
                    link = part.attrGet("href") or ""
                    path = os.path.normpath(os.path.join("docs", link))
                    if path in self.files and path.endswith(".md"):
                        self.navigation[-1][1].append(path)

    def page(self, path):
        if path not in self.pages:
            self.pages[path] = Page(path, (ROOT / path).read_text())
        return self.pages[path]

    def url(self, path):
        """Where a file or folder of the tree is in the site, which takes it in."""
        if path in self.urls:
            return self.urls[path]
        pure = pathlib.PurePath(path)
        if path in self.folders:
            readme = str(pure / "README.md")
            if readme in self.files:
                return self.url(readme)
            url = f"source/{path}/index.html"
        elif pure.name == "README.md":
            url = str(pure.with_name("index.html"))
        elif pure.suffix == ".md":
            url = str(pure.with_suffix(".html"))
        else:
            url = path if pure.suffix in COPIED else f"source/{path}.html"
        self.urls[path] = url
        self.queue.append(path)
        return url

    def resolve(self, link, path):
        """A document's link, as its page has it. What leads nowhere stays, and is
        found at the end."""
        target, hash, anchor = link.partition("#")
        if not target or re.match(r"\w+:", link):
            return link
        target = os.path.normpath(os.path.join(os.path.dirname(path), target))
        if target not in self.files and target not in self.folders:
            return link
        return relative(self.url(target), self.url(path)) + hash + anchor

    def label(self, path):
        if path.startswith(RESULTS):
            return pathlib.PurePath(path).stem.replace("-", " ")
        return self.page(path).title

    def list_navigation(self, url, path):
        """The side of the page at `url`, which is made of `path`."""
        lines = []

        def add(label, target, here, level=""):
            mark = ' aria-current="page"' if here else ""
            lines.append(f'<li{level}><a href="{html.escape(relative(target, url))}"'
                         f"{mark}>{html.escape(label)}</a></li>")

        def add_page(one, level=""):
            add(self.label(one), self.url(one), one == path, level)
            if one == path:
                level = ' class="innermost"' if level else ' class="inner"'
                for anchor, text in self.page(one).sections:
                    lines.append(f'<li{level}><a href="#{html.escape(anchor)}">'
                                 f"{html.escape(text)}</a></li>")

        for name, paths in self.navigation:
            # Results are many, and are read one at a time.
            long = sum(one.startswith(RESULTS) for one in paths) > 5
            closed = long and not (path or "").startswith("benchmarks/")
            lines.append(f'<details{"" if closed else " open"}><summary>'
                         f"{html.escape(name)}</summary><ul>")
            for one in paths:
                add_page(one)
                if one == f"{LESSONS}README.md" and (path or "").startswith(LESSONS):
                    for lesson in sorted(self.files):
                        if re.match(rf"{LESSONS}[^/]+/README\.md$", lesson):
                            add_page(lesson, ' class="inner"')
            if self.api and name == self.navigation[0][0]:
                add("API reference", "api/index.html", url.startswith("api/"))
            lines.append("</ul></details>")
        return "\n".join(lines)

    def fill(self, url, path, title, body, made_of):
        root = os.path.relpath(".", os.path.dirname(url) or ".")
        footer = {name.split(".")[0].lower(): relative(self.url(name), url)
                  for name in FIRST}
        return self.template.substitute(
            footer, title=html.escape(title, False) + " - Piko" * (title != "Piko"), root=root, body=body,
            navigation=self.list_navigation(url, path), made_of=html.escape(made_of))

    def write(self, url, text):
        file = self.out / url
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def take_in(self, path):
        """What a file or folder of the tree links to."""
        if path in self.folders:
            for one in self.inside(path):
                self.url(one)
        elif path.endswith(".md"):
            page = self.page(path)
            for target, text in page.named_links():
                target = os.path.normpath(os.path.join(os.path.dirname(path), target))
                if target in self.files:
                    text.content = self.label(target)
            page.rewrite(lambda link: self.resolve(link, path))

    def inside(self, folder):
        """Its folders, then its files."""
        names = [n for n in self.folders | self.files if os.path.dirname(n) == folder]
        return sorted(names, key=lambda name: (name in self.files, name))

    def make(self, path, url):
        if path in self.folders:
            title, body = f"{path}/", self.list_folder(path, url)
        elif path.endswith(".md"):
            page = self.page(path)
            title, body = page.title or path, page.render()
        elif url == path:
            (self.out / url).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / path, self.out / url)
            return
        else:
            title, body = path, self.show_source(path, url)
        self.write(url, self.fill(url, path, title, body, path))

    def crumbs(self, path, url):
        """The way to a source, whose folders are links where they are in the site."""
        parts = []
        for folder in reversed([str(p) for p in pathlib.PurePath(path).parents][:-1]):
            name = html.escape(os.path.basename(folder))
            if folder in self.urls:
                name = f'<a href="{relative(self.urls[folder], url)}">{name}</a>'
            parts.append(name)
        return "<h1>" + " / ".join([*parts, html.escape(os.path.basename(path))]) + "</h1>"

    def list_folder(self, path, url):
        lines = [self.crumbs(path, url), '<ul class="files">']
        for one in self.inside(path):
            name = os.path.basename(one) + ("" if one in self.files else "/")
            lines.append(f'<li><a href="{relative(self.url(one), url)}">{name}</a></li>')
        return "\n".join([*lines, "</ul>"])

    def show_source(self, path, url):
        try:
            text = (ROOT / path).read_text()
        except UnicodeDecodeError:
            return f"{self.crumbs(path, url)}<p>Not a text.</p>"
        return self.crumbs(path, url) + highlight(text, path=path)

    def make_all(self):
        first = FIRST + [f for f in sorted(self.files) if f.endswith(".md") and f.startswith(
            ("docs/", LESSONS, "benchmarks/"))]
        for path in first:
            self.url(path)
        while self.queue:
            self.take_in(self.queue.pop())
        for path, url in self.urls.items():
            if path not in self.folders or url.startswith("source/"):
                self.make(path, url)
        shutil.copy(self.templates / "style.css", self.out)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("--no-api", action="store_true")
    parser.add_argument("--check", type=pathlib.Path, metavar="FOLDER")
    args = parser.parse_args()
    if bool(args.out) == bool(args.check):
        parser.error("expected --out or --check")
    if args.check and not (args.check / "index.html").is_file():
        parser.error(f"--check: expected index.html in {args.check}")
    if args.out:
        if args.out.exists() and not (args.out / "style.css").is_file():
            parser.error(f"--out: expected a site, or nothing, in {args.out}")
        shutil.rmtree(args.out, ignore_errors=True)
        site = Site(args.out, not args.no_api)
        site.make_all()
        if site.api:
            api.make(site)
    folder = args.out or args.check
    if not check.check(folder):
        sys.exit(1)
    print(f"{folder / 'index.html'}{', without an API reference' * args.no_api}")


if __name__ == "__main__":
    run_main(main)
