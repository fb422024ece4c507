"""Pieces of HTML; every text of a user goes through `escape`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape

from idlc.model import ir
from idlc.model.spelling import spell

#: The pages by interface; a link from one page to another goes up one folder.
Pages = Mapping[ir.TypeName, str]


def page_of(name: ir.TypeName) -> str:
    """Return the path of an interface's page."""
    return f"{name.package}/{name.kind}-{name.name}.html"


def link(name: ir.TypeName, text: str, pages: Pages) -> str:
    """Return a text that leads to an interface's page, if there is one."""
    shown = escape(text)
    if name not in pages:
        return f'<span class="type" title="{escape(str(name))}">{shown}</span>'
    return (
        f'<a class="type" href="../{escape(pages[name])}" title="{escape(str(name))}">{shown}</a>'
    )


def type_(type_: ir.FieldType, package: str, pages: Pages) -> str:
    """Return a type as written, with a link to the message that it names."""
    element = ir.element_of(type_)
    written = spell(type_, package)
    if not isinstance(element, ir.Ref):
        return f'<span class="type">{escape(written)}</span>'
    name = spell(element, package)
    return link(element.target, name, pages) + escape(written.removeprefix(name))


def prose(lines: Sequence[str]) -> str:
    """Return comment lines: paragraphs, and what is indented or drawn as it stands."""
    blocks = re.split(r"\n\s*\n", "\n".join(lines).strip("\n"))
    return "".join(_block(block) for block in blocks if block.strip())


def _block(block: str) -> str:
    drawn = any(line.startswith((" ", "\t")) or "  " in line for line in block.split("\n"))
    tag = "pre" if drawn else "p"
    return f"<{tag}>{escape(block)}</{tag}>\n"


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of cells that are HTML already; empty without rows."""
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>\n" for row in rows)
    if not body:
        return ""
    head = "".join(f"<th>{escape(one)}</th>" for one in heads)
    top = f'<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n'
    return f"{top}<tbody>\n{body}</tbody></table></div>\n"


def document(title: str, root: str, body: str) -> str:
    """Return a whole page; `root` leads to the site's top, such as `../`."""
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{escape(title)}</title>
<link rel="stylesheet" href="{root}style.css">
</head>
<body data-root="{root}">
<header>
<a class="home" href="{root}index.html">interfaces</a>
<label class="search"><span>Search</span>
<input type="search" id="search" placeholder="type, field, constant …" autocomplete="off">
</label>
</header>
<ol id="found" hidden></ol>
<main>
{body}</main>
<script src="{root}index.js"></script>
<script src="{root}search.js"></script>
</body>
</html>
"""
