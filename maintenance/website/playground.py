"""Links to the playground below the blocks of interfaces in documents."""

from __future__ import annotations

import posixpath
import re
from html import escape
from urllib.parse import quote, urlencode

PLACE = "playground/index.html"
_FENCE = re.compile(r"(?ms)^(`{3,})([^\n`]*)\n(.*?)^\1$\n?")
_INTERFACE = re.compile(
    r"(?:(old|new)/|\S*/)?(msg|srv|action)(?:/([A-Z][A-Za-z0-9]*)\.\2)?(?: .*)?"
)


def with_links(place: str, text: str) -> str:
    """Return a document with a link below each block of an interface.

    A block of a new version opens with the old one to compare with.
    """
    above = posixpath.relpath(PLACE, posixpath.dirname(place))
    old: dict[str, str] = {}

    def linked(block: re.Match[str]) -> str:
        named = _INTERFACE.fullmatch(block[2])
        if named is None:
            return block[0]
        version, kind, name = named[1], named[2], named[3] or "Example"
        if version == "old":
            old[name] = block[3]
            return block[0]
        values = {"text": block[3]}
        if version == "new" and name in old:
            values["before"] = old.pop(name)
        target = f"{above}#{kind}/{name}?{urlencode(values, quote_via=quote)}"
        return f'{block[0]}\n<p class="try"><a href="{escape(target)}">Try it</a></p>\n'

    return _FENCE.sub(linked, text)
