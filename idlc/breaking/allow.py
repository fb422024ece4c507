"""Changes that a team decided to make nevertheless: each with a reason and a day when it ends."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

from idlc.breaking.change import Change
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report


class Allowance(NamedTuple):
    """One entry of the allow-list.

    `at` is a type or an element of one (`pkg/msg/Name.field`), `*` and `?` stand for any text;
    a type covers its elements. `until` is the last day on which it holds, as YYYY-MM-DD. Without
    a `code` it holds for all.
    """

    at: str
    reason: str
    until: str
    code: str | None = None

    def covers(self, change: Change) -> bool:
        """Return whether a change, or the one that it follows from, is meant."""
        if self.code not in (None, change.code.id):
            return False
        names = [change.subject, change.subject.partition(".")[0], change.cause]
        return any(fnmatchcase(name, self.at) for name in names if name)


def without_allowed(
    changes: Sequence[Change],
    allowances: Iterable[Allowance],
    today: str,
    path: str,
    report: Report,
) -> tuple[Change, ...]:
    """Return the changes that nobody allowed.

    Reports entries that have expired, and those that no change needs; `path` is the file that
    holds them, `today` a day as YYYY-MM-DD.
    """
    allowed: set[int] = set()
    for entry in allowances:
        covered = [at for at, change in enumerate(changes) if entry.covers(change)]
        if not covered:
            report.add(
                codes.UNUSED_ALLOWANCE.of(
                    path,
                    f"no change needs the allowance for `{entry.at}`",
                    hint="remove the entry",
                )
            )
        elif entry.until < today:
            report.add(
                codes.EXPIRED_ALLOWANCE.of(
                    path,
                    f"the allowance for `{entry.at}` ended on {entry.until} ({entry.reason})",
                    hint="take the change back, or decide again and set a new day",
                )
            )
        else:
            allowed.update(covered)
    return tuple(change for at, change in enumerate(changes) if at not in allowed)
