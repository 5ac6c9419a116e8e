# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""The API reference: Doxygen's pages of the public headers, within the site."""

import pathlib
import re
import shutil
import subprocess
import tempfile

HEADERS = ["runtime/include", "include/piko-c", "include/Piko/Driver"]
# A second definition of the same names, for the compiler alone.
NO_HEADERS = "runtime/include/piko/compiled/"


# Where a call stands, which its writer does not give.
PLACE = re.compile(r",?\s*detail::Place \w+ = detail::Place::current\(\)")


def describe_file(text):
    """A header with its opening comment, which Doxygen does not read, as what the file
    is for. Code in it is what is indented."""
    lines, top = PLACE.sub("", text).splitlines(), []
    while len(top) < len(lines) and lines[len(top)].startswith("//"):
        top.append(lines[len(top)])
    said = [line[3:] for line in top if not re.match(r"//( SPDX|=)", line)]
    said = ["  " + line if line.startswith("  ") else line for line in said]
    comment = "\n".join(["/// \\file", *(f"/// {line}".rstrip() for line in said)])
    return "\n".join([comment, "", *lines[len(top):], ""])


def make(site):
    """Doxygen's pages have the site's header, navigation and style."""
    page = site.fill("api/index.html", None, "@title@", "@body@", "the public headers").replace("@title@", "$title")
    header, footer = page.split("@body@")
    with tempfile.TemporaryDirectory() as name:
        work = pathlib.Path(name)
        (work / "header.html").write_text(header + '<div id="top">')
        (work / "footer.html").write_text(footer)
        for path in sorted(site.files):
            public = path.startswith(tuple(f"{h}/" for h in HEADERS))
            if public and path.endswith((".def", ".h", ".hpp")) and NO_HEADERS not in path:
                copy = work / path
                copy.parent.mkdir(parents=True, exist_ok=True)
                text = (site.root / path).read_text()
                copy.write_text(text if path.endswith(".def") else describe_file(text))
        shutil.copy(site.templates / "api.dox", work)
        config = (site.templates / "Doxyfile").read_text() + f"""
INPUT = {work}
INCLUDE_PATH = {work}/runtime/include
STRIP_FROM_PATH = {work}/runtime/include {work}/include
STRIP_FROM_INC_PATH = {work}/runtime/include {work}/include
OUTPUT_DIRECTORY = {work}
HTML_OUTPUT = {site.out.resolve() / "api"}
HTML_HEADER = {work}/header.html
HTML_FOOTER = {work}/footer.html
HTML_STYLESHEET = {site.templates}/style.css
"""
        subprocess.run(["doxygen", "-"], input=config, text=True, check=True)
    mend(site.out / "api")


LINK = re.compile(r'<a [^>]*href="([^"#]*)#([^"]+)"[^>]*>([^<]*)</a>( &#124;\n)?')


def mend(folder):
    """Without scripts, and without links to what Doxygen 1.9.4 leaves out: private
    classes, and friends that are defaulted."""
    for unused in [*folder.glob("*.js"), folder / "api_8dox.html"]:
        unused.unlink()
    texts = {file.name: file.read_text() for file in folder.glob("*.html")}
    anchors = {name: set(re.findall(r' (?:id|name)="([^"]+)"', text))
               for name, text in texts.items()}
    for name, text in texts.items():

        def replace(link):
            known = anchors.get(link[1] or name)
            if known is None or link[2] in known:
                return link[0]
            return link[3] if link[1] else ""

        (folder / name).write_text(LINK.sub(replace, text))
