"""Which warnings a team wants to see: by category, code or path. Errors are always seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Severity

CATEGORIES = ("correctness", "portability", "style", "package")

#: Not asked for unless `select` says so: how much a team writes, what it calls things, and what
#: works as well as its alternative.
OFF_BY_DEFAULT = frozenset(
    code.id
    for code in (
        codes.UNDOCUMENTED_INTERFACE,
        codes.UNDOCUMENTED_FIELD,
        codes.MISSING_UNIT,
        codes.CONSTANT_PREFIX,
        codes.REDUNDANT_SUFFIX,
        codes.CHAR_TYPE,
    )
)

_CATEGORY_OF = {"22": "portability", "40": "style", "42": "portability", "45": "package"}
_CATEGORY_OF |= {"46": "package", "60": "package", "61": "package"}


def category(code: str) -> str:
    """Return the category of a code."""
    return _CATEGORY_OF.get(code[3:5], "correctness")


def is_selector(word: str) -> bool:
    """Tell whether a word means any code: `all`, a category, a code, its beginning or its slug."""
    return any(_means(word, code) for code in codes.CODES)


def _means(word: str, code: str) -> bool:
    found = codes.find(word)
    if found is not None:
        return found.id == code
    return word in ("all", category(code)) or _begins(code, word.upper())


def _begins(code: str, beginning: str) -> bool:
    return beginning.startswith("IDL") and code.startswith(beginning)


class Selection(msgspec.Struct, frozen=True):
    """What is wanted; `select` replaces what is on by default, `ignore` takes away from it.

    `per_path` are pairs of a path, in which `*` and `?` stand for any text, and what to ignore
    there.
    """

    select: tuple[str, ...] | None = None
    ignore: tuple[str, ...] = ()
    per_path: tuple[tuple[str, tuple[str, ...]], ...] = ()

    def has(self, code: str) -> bool:
        """Tell whether a code is switched on."""
        if self.select is None:
            chosen = code not in OFF_BY_DEFAULT
        else:
            chosen = any(_means(word, code) for word in self.select)
        return chosen and not any(_means(word, code) for word in self.ignore)

    def wants(self, found: Diagnostic) -> bool:
        """Tell whether a problem is to be shown."""
        if found.severity is Severity.ERROR or found.code in _ALWAYS:
            return True
        path = found.where[0]
        return self.has(found.code) and not any(
            any(_means(word, found.code) for word in ignored)
            for pattern, ignored in self.per_path
            if fnmatchcase(path, pattern) or fnmatchcase(path, f"*/{pattern}")
        )


_ALWAYS = frozenset({codes.IGNORE_WITHOUT_REASON.id})


def selection(table: Mapping[str, object]) -> Selection:
    """Return the selection that a checked table of settings describes."""
    select = table.get("select")
    per_path = table.get("per-path")
    return Selection(
        _words(select) if select is not None else None,
        _words(table.get("ignore")),
        tuple((path, _words(words)) for path, words in per_path.items())
        if isinstance(per_path, dict)
        else (),
    )


def _words(value: object) -> tuple[str, ...]:
    return tuple(map(str, value)) if isinstance(value, Sequence) else ()
