"""Pieces of HTML; every text of a user goes through `escape`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape as escape_markup

from idlc.diagnostics.visible import printable
from idlc.model import ir
from idlc.model.spelling import spell

#: The pages by interface; a link from one page to another goes up one folder.
Pages = Mapping[ir.TypeName, str]


#: Blanks that draw something: at the start of a line, or several that no punctuation explains.
_DRAWING = re.compile(r"(?m)^[ \t]|[^\s.,;:!?]([ ]{2,}|\t)\S")


def escape(text: str) -> str:
    """Return text as HTML; control characters are spelled out."""
    return escape_markup(printable(text))


def breakable(text: str) -> str:
    """Return a name as HTML that may break between its words."""
    return re.sub(r"([_/.]|[a-z0-9](?=[A-Z]))", r"\1<wbr>", escape(text))


def page_of(type_name: ir.TypeName) -> str:
    """Return the path of an interface's page."""
    return f"{type_name.package}/{type_name.kind}-{type_name.name}.html"


def link(target: ir.TypeName, text: str, pages: Pages) -> str:
    """Return a text that leads to an interface's page, if there is one."""
    title = f'title="{escape(str(target))}"'
    if target not in pages:
        return f"<span {title}>{breakable(text)}</span>"
    return f'<a href="../{escape(pages[target])}" {title}>{breakable(text)}</a>'


def type_(type_: ir.FieldType, package: str, pages: Pages) -> str:
    """Return a type as written, with a link to the message that it names."""
    element = ir.element_of(type_)
    written = spell(type_, package)
    if not isinstance(element, ir.Ref):
        return breakable(written)
    target = spell(element, package)
    return link(element.target, target, pages) + escape(written.removeprefix(target))


def prose(lines: Sequence[str]) -> str:
    """Return comment lines: paragraphs, and what is indented or drawn as it stands."""
    blocks = re.split(r"\n\s*\n", "\n".join(lines).strip("\n"))
    return "".join(_block(block) for block in blocks if block.strip())


def _block(block: str) -> str:
    tag = "pre" if "\n" in block and _DRAWING.search(block) else "p"
    return f"<{tag}>{escape(block)}</{tag}>\n"


def table(columns: Sequence[tuple[str, str]], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of cells that are HTML already; empty without rows.

    A column is a class and a heading. One that is empty in all rows is left out.
    """
    cells = list(zip(*rows, strict=True))
    used = [(*column, one) for column, one in zip(columns, cells, strict=False) if any(one)]
    if not used:
        return ""
    head = "".join(f'<th class="{kind}">{escape(title)}</th>' for kind, title, _ in used)
    body = "".join(
        f"<tr>{''.join(map(_cell, used, row))}</tr>\n"
        for row in zip(*(one for _, _, one in used), strict=True)
    )
    return f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table>\n"


def _cell(column: tuple[str, str, object], content: str) -> str:
    """Return a cell that knows its heading, for windows where it stands below others."""
    return f'<td class="{column[0]}" data-head="{escape(column[1])}">{content}</td>'


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
<div role="status">
<ol id="found" hidden></ol>
</div>
<main>
{body}</main>
<script src="{root}index.js"></script>
<script src="{root}search.js"></script>
</body>
</html>
"""
