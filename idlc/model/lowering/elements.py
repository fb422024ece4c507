"""The inside of an array's brackets → the texts of its elements, each with its offset."""

from __future__ import annotations

import re

from idlc.diagnostics import codes
from idlc.model.lowering.fault import Fault

QUOTES = ('"', "'")
#: Elements that a default may have; each takes about a kilobyte on its way.
MAX_ELEMENTS = 200_000


def elements(inside: str) -> list[tuple[str, int]] | Fault:
    """Split at commas; each element with its offset."""
    found: list[tuple[str, int]] = []
    at = 0
    for part in inside.split(",") if inside else []:
        stripped = part.strip()
        found.append((stripped, at + len(part) - len(part.lstrip())))
        if not stripped:
            end = at + max(len(part), 1)
            return Fault(codes.ARRAY_VALUE, "an element is missing", at, end, "remove the comma")
        at += len(part) + 1
    return found


def string_elements(inside: str) -> list[tuple[str, int]] | Fault:
    """Split as rosidl's scanner does, wrong turns included (language 4)."""
    found: list[tuple[str, int]] = []
    ends = {quote: _Ends(inside, quote) for quote in QUOTES}
    at = 0
    while at < len(inside) and len(found) <= MAX_ELEMENTS:
        at = _after_blanks(inside, at)
        if at == len(inside) or inside[at] == ",":
            return Fault(codes.ARRAY_VALUE, "an element is missing", at, at + 1, "remove the comma")
        quoted = False
        for quote in QUOTES:
            if inside.startswith(quote, at):
                quoted = True
                end = ends[quote].after(at)
                if end == -1:
                    message = f"no {quote} that ends this element"
                    hint = (
                        "an element cannot end with an escaped quote; use the other kind of quote"
                    )
                    return Fault(codes.BAD_VALUE, message, at, len(inside), hint)
                element = inside[at + 1 : at + end + 1].replace(f"\\{quote}", quote)
                # upstream strips every element, also what stood in quotes
                found.append((element.strip(), at))
                at += end + 2
        if not quoted:
            comma = inside.find(",", at)
            end = len(inside) if comma < 0 else comma
            found.append((inside[at:end].strip(), at))
            at = end
        at = _after_blanks(inside, at)
        at += inside.startswith(",", at)
    return found


def _after_blanks(text: str, at: int) -> int:
    """Return the first place from `at` on where no blank stands."""
    found = re.compile("[^ ]").search(text, at)  # compiled once, by re
    return found.start() if found else len(text)


class _Ends:
    """rosidl's idea of where quoted texts end, without its quadratic search.

    Upstream goes from one escaped quote to the next, and counts from the last of them instead of
    from the start, so that what follows may be looked at again and again.
    """

    def __init__(self, text: str, quote: str) -> None:
        self._text = text
        self._quote = quote
        #: place -> the closing quote, the place after the last escaped one, the place before that
        self._known: dict[int, tuple[int, int, int]] = {}

    def after(self, start: int) -> int:
        """Return the length of the text quoted at `start`; -1 if nothing ends it."""
        path = [start]
        while path[-1] not in self._known:
            here = path[-1]
            at = self._text.find(self._quote, here + 1)
            if at < 0 or self._text[at - 1] != "\\":
                self._known[here] = (at, here, here)
            else:
                path.append(at + 1)
        following = path.pop()
        for here in reversed(path):
            end, last, before = self._known[following]
            self._known[here] = (end, last, here if last == following else before)
            following = here
        end, last, before = self._known[start]
        return -1 if end < 0 else end - 1 - before
