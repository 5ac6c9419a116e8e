# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
"""Markdown as GitHub reads it, and texts with colours."""

import collections
import re

import markdown_it
import pygments
import pygments.formatters
import pygments.lexer
import pygments.lexers
from markdown_it.token import Token
from pygments import token as kinds
from pygments.util import ClassNotFound


class MLIRLexer(pygments.lexer.RegexLexer):
    """Pygments has none."""

    tokens = {
        "root": [
            (r"//.*", kinds.Comment.Single),
            (r'"(\\.|[^"\\])*"', kinds.String),
            (r"[%^][\w$.#-]+", kinds.Name.Variable),
            (r"@[\w$.-]+", kinds.Name.Function),
            (r"[!#][A-Za-z_][\w.]*", kinds.Keyword.Type),
            (r"\b(?:index|none|[su]?i\d+|b?f\d+)\b", kinds.Keyword.Type),
            (r"\b[a-z_]\w*\.[\w.]+", kinds.Keyword),
            (r"\b(?:0x[0-9A-Fa-f]+|\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)\b", kinds.Number),
            (r"\w+|\s+|.", kinds.Text),
        ]
    }


def find_lexer(name, path=None):
    """By a fence's language, or a file's name; None for plain text."""
    if name == "mlir" or path and path.endswith((".mlir", ".mlir.inc")):
        return MLIRLexer()
    if path and path.endswith((".def", ".inc")):
        name = "cpp"
    try:
        if name:
            return pygments.lexers.get_lexer_by_name(name)
        return pygments.lexers.get_lexer_for_filename(path) if path else None
    except ClassNotFound:
        return None


def highlight(text, name="", path=None):
    """What is in a fence; of a file, lines with numbers."""
    lexer = find_lexer(name, path) or pygments.lexers.TextLexer()
    lexer.stripnl = False
    formatter = pygments.formatters.HtmlFormatter(
        nowrap=not path, linenos="inline", lineanchors="L", wrapcode=True, cssclass="code")
    return pygments.highlight(text, lexer, formatter)


def fence(text, name, _):
    return f'<pre class="code"><code>{highlight(text, name)}</code></pre>'


def plain(inline):
    """A heading's text, without its marks."""
    return "".join(
        part.content
        for part in inline.children or []
        if part.type in ("text", "code_inline")
    )


ATTRIBUTE = re.compile(r'\b(src|href)="([^"]*)"')
PARSER = markdown_it.MarkdownIt("commonmark", {"highlight": fence})
PARSER.enable(["table", "strikethrough"])
# Wide ones scroll by themselves.
PARSER.add_render_rule("table_open", lambda *_: '<div class="wide"><table>\n')
PARSER.add_render_rule("table_close", lambda *_: "</table></div>\n")


class Page:
    def __init__(self, path, text):
        self.path = path
        self.tokens = PARSER.parse(text)
        self.title = ""
        self.sections = []  # headings of the second level: anchor, text
        used = collections.Counter()
        for opening, inline in zip(self.tokens, self.tokens[1:]):
            if opening.type != "heading_open":
                continue
            text = plain(inline)
            name = re.sub(r"[^\w\- ]", "", text.lower().strip()).replace(" ", "-")
            anchor = f"{name}-{used[name]}" if used[name] else name
            used[name] += 1
            opening.attrSet("id", anchor)
            if opening.tag != "h1":
                link = f'<a class="here" href="#{anchor}" aria-label="To this place">#</a>'
                inline.children.append(Token("html_inline", "", 0, content=link))
            if opening.tag == "h1" and not self.title:
                self.title = text
            if opening.tag == "h2":
                self.sections.append((anchor, text))

    def named_links(self):
        """Links whose text is the name of a document: where to, and the text."""
        for block in self.tokens:
            parts = block.children or []
            for link, text in zip(parts, parts[1:]):
                target = link.type == "link_open" and link.attrGet("href") or ""
                if text.content.endswith(".md") and target.endswith(text.content):
                    yield target, text

    def rewrite(self, change):
        """Replaces each link by what `change` makes of it."""
        for block in self.tokens:
            for part in [block, *(block.children or [])]:
                for name in ("href", "src"):
                    if part.attrGet(name):
                        part.attrSet(name, change(part.attrGet(name)))
                if part.type in ("html_block", "html_inline"):
                    part.content = ATTRIBUTE.sub(
                        lambda m: f'{m[1]}="{change(m[2])}"', part.content)

    def render(self):
        return PARSER.renderer.render(self.tokens, PARSER.options, {})
