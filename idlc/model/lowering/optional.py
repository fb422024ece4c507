"""What is wrong with `@optional`, which is read since Lyrical and has no effect (language 10)."""

from __future__ import annotations

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit, Report
from idlc.diagnostics.source import Source, Span
from idlc.model.distro import Distro
from idlc.syntax import tree


def after_optional(
    line: tree.Line, source: Source, distro: Distro, report: Report, *, is_second: bool
) -> tree.Line:
    """Return what follows `@optional` in a line that begins with it; report what is wrong with it.

    `is_second` is whether the definition to come has one already. Nothing follows another one.
    """
    rest = line.after_optional or line
    report.add(_problem(_span(line, source), distro, is_second=is_second))
    if rest.after_optional is None:
        return rest
    report.add(_problem(_span(rest, source), distro, is_second=True))
    return msgspec.structs.replace(rest, code="")


def _span(line: tree.Line, source: Source) -> Span:
    return Span(source, line.start, line.start + len(tree.OPTIONAL))


def _problem(span: Span, distro: Distro, *, is_second: bool) -> Diagnostic:
    if not distro.reads_optional:
        found = codes.OPTIONAL_NEEDS_LYRICAL.at(
            span,
            f"ROS 2 {distro.title} does not know `@optional`, which came with Lyrical",
            hint="leave it out; where it is known (`--distro lyrical`), it has no effect",
        )
        return msgspec.structs.replace(found, edits=(_removal(span),))
    if is_second:
        message = "a definition can have `@optional` only once"
        return codes.REPEATED_OPTIONAL.at(span, message, hint="leave it out here")
    return codes.OPTIONAL_WITHOUT_EFFECT.at(
        span,
        "`@optional` is accepted and has no effect",
        hint="for a value that may be missing use `T[<=1]`, or a bool field beside it",
    )


def _removal(span: Span) -> Edit:
    """Return the edit that leaves it out, with the blanks after it."""
    rest = span.source.text[span.end :]
    blanks = len(rest) - len(rest.lstrip(" \t"))
    return Edit(Span(span.source, span.start, span.end + blanks), "")
