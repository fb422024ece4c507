"""The text of the grammar, and the patterns in it."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

#: The characters that end a line, as `str.splitlines` has it (language 1.1).
LINE_ENDS = "\n\r\x0b\x0c\x1c\x1d\x1e\x85\u2028\u2029"


@lru_cache(maxsize=1)
def grammar() -> str:
    """Return the content of grammar.lark."""
    return Path(__file__).with_name("grammar.lark").read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def terminals() -> dict[str, str]:
    """Return the regular expressions of the grammar's terminals by their names."""
    definitions = re.findall(r"(?m)^(\w+)(?:\.\d+)?: /(.*)/([a-z]*)$", grammar())
    return {
        name: f"(?{flags}:{pattern})" if flags else pattern for name, pattern, flags in definitions
    }
