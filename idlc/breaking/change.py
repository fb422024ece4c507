"""One difference between two versions, and what it breaks."""

from __future__ import annotations

from typing import Literal, NamedTuple, TypeAlias

from idlc.diagnostics.codes import Code
from idlc.diagnostics.report import Diagnostic, Label
from idlc.diagnostics.source import Span

Level: TypeAlias = Literal["wire", "hash", "source", "behaviour"]

#: What a change can break, the worst first: bytes written before are read wrongly or not at all;
#: RIHS01 differs, so a middleware may not deliver messages between the two versions; Python or C++
#: code that used it fails; the same code does something else.
LEVELS: tuple[Level, ...] = ("wire", "hash", "source", "behaviour")


class Change(NamedTuple):
    """A difference that breaks something, with its place in the new version and in the old.

    `subject` is what changed, such as `pkg/msg/Name.field`; `cause` is the other type whose change
    it follows from. A change without a `span` has the `path` of its file; `place` is where that
    would be, if it is not there.
    `detail` is text of several lines.
    """

    code: Code
    subject: str
    message: str
    levels: frozenset[Level]
    span: Span | None = None
    old: Span | None = None
    path: str = ""
    hint: str | None = None
    cause: str = ""
    detail: str = ""
    place: str = ""

    def without(self, level: Level) -> Change:
        """Return the change with a level that turned out not to be true."""
        return self._replace(levels=self.levels - {level})

    @property
    def diagnostic(self) -> Diagnostic:
        """The change as a problem to show."""
        label = (Label(self.old, "this is what it was"),) if self.old and self.span else ()
        return Diagnostic(
            code=self.code.id,
            severity=self.code.severity,
            message=self.message,
            span=self.span,
            path=self.path,
            labels=label,
            hint=self.hint,
            detail=self.detail,
            place=self.place,
            levels=tuple(level for level in LEVELS if level in self.levels),
        )
