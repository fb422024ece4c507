"""Every code that idlc can report: stable, never renumbered, never reused.

1xx syntax, 2xx names and references, 3xx types, bounds and values, 4xx style, 5xx breaking
changes, 6xx files and projects, 9xx idlc itself. `explain/<id>.md` holds each one's page.
"""

from __future__ import annotations

from typing import NamedTuple

from idlc.text.diagnostics import Diagnostic, Label, Severity
from idlc.text.source import Span

ERROR = Severity.ERROR
WARNING = Severity.WARNING


class Code(NamedTuple):
    """A kind of problem: its stable id, its short name and how bad it is."""

    id: str
    slug: str
    severity: Severity

    def at(
        self, span: Span, message: str, *, hint: str | None = None, labels: tuple[Label, ...] = ()
    ) -> Diagnostic:
        """Return a problem of this kind at a place in a file."""
        return Diagnostic(
            code=self.id,
            severity=self.severity,
            message=message,
            span=span,
            hint=hint,
            labels=labels,
        )

    def of(self, path: str, message: str, *, hint: str | None = None) -> Diagnostic:
        """Return a problem of this kind with a whole file or folder."""
        return Diagnostic(
            code=self.id, severity=self.severity, message=message, path=path, hint=hint
        )


# files and projects
UNREADABLE = Code("IDL601", "unreadable", ERROR)

# idlc itself
INTERNAL = Code("IDL901", "internal-error", ERROR)

#: All codes by id.
CODES: dict[str, Code] = {
    code.id: code for code in tuple(globals().values()) if isinstance(code, Code)
}
