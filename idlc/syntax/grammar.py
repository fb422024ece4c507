"""The text of the grammar, and the patterns in it."""

from __future__ import annotations

import re
from functools import cache, lru_cache
from pkgutil import get_data  # importlib.resources takes three times as long to import

#: The characters that end a line, as `str.splitlines` has it (spec 1.1).
LINE_ENDS = "\n\r\x0b\x0c\x1c\x1d\x1e\x85\u2028\u2029"


@lru_cache(maxsize=1)
def grammar() -> str:
    """Return the content of grammar.lark."""
    data = get_data("idlc.syntax", "grammar.lark")
    assert data is not None, "the package is not whole"
    return data.decode("utf-8")


@cache
def terminal(name: str) -> str:
    """Return the regular expression of one of the grammar's terminals."""
    found = re.search(rf"(?m)^{name}(?:\.\d+)?: /(.*)/([a-z]*)$", grammar())
    if found is None:
        raise KeyError(name)
    pattern, flags = found.groups()
    return f"(?{flags}:{pattern})" if flags else pattern
