"""Which warnings a team wants to see: by category, code or path. Errors are always seen."""

from __future__ import annotations

from fnmatch import fnmatchcase

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Severity


def is_selector(word: str) -> bool:
    """Return whether a word means any code: `all`, a category, an id, its start or a slug."""
    return any(_means(word, code) for code in codes.CODES.values())


def _means(word: str, code: codes.Code) -> bool:
    named = codes.find(word)
    if named is not None:
        return named is code
    beginning = word.upper()
    begins = beginning.startswith("IDL") and code.id.startswith(beginning)
    return begins or word in ("all", code.category)


class Selection(msgspec.Struct, frozen=True):
    """What is wanted; `select` replaces what is on by default, `ignore` takes away from it.

    `per_path` are pairs of a path, in which `*` and `?` stand for any text, and what to ignore
    there.
    """

    select: tuple[str, ...] | None = None
    ignore: tuple[str, ...] = ()
    per_path: tuple[tuple[str, tuple[str, ...]], ...] = ()

    def with_lists(self, select: str | None, ignore: str | None) -> Selection:
        """Return what lists of rules with commas change of it: typed ones come after a file's."""
        chosen = tuple(select.split(",")) if select else self.select
        ignored = (*self.ignore, *(ignore.split(",") if ignore else ()))
        return Selection(chosen, ignored, self.per_path)

    def has(self, code: codes.Code) -> bool:
        """Return whether a code is switched on."""
        if self.select is None:
            chosen = code.default
        else:
            chosen = any(_means(word, code) for word in self.select)
        return chosen and not any(_means(word, code) for word in self.ignore)

    def wants(self, found: Diagnostic) -> bool:
        """Return whether a problem is to be shown."""
        code = codes.CODES[found.code]
        if found.severity is Severity.ERROR or code is codes.IGNORE_WITHOUT_REASON:
            return True
        path = found.where[0]
        return self.has(code) and not any(
            any(_means(word, code) for word in ignored)
            for pattern, ignored in self.per_path
            if fnmatchcase(path, pattern) or fnmatchcase(path, f"*/{pattern}")
        )
