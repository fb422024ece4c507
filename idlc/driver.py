"""Each command's pipeline on one screen: from what was typed to values that `cli` prints.

The compiler itself is imported where it is used, so that a run with nothing to do costs little.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

from idlc.disk import inputs, installed
from idlc.disk.find import find
from idlc.disk.fresh import dependencies
from idlc.disk.library import Library
from idlc.disk.plan import Plan
from idlc.disk.target import Target, record
from idlc.model import derive, ir
from idlc.text import codes
from idlc.text.diagnostics import Report

if TYPE_CHECKING:
    from idlc.disk.lock import Lock
    from idlc.model.link import Model
    from idlc.text.source import Source


class InternalError(Exception):
    """Something failed that is idlc's own fault: in which stage, and at what."""

    def __init__(self, stage: str, subject: str) -> None:
        super().__init__(stage, subject)
        self.stage = stage
        self.subject = subject


@contextmanager
def stage(name: str, subject: str) -> Iterator[None]:
    """Turn whatever goes wrong within into an InternalError that says where it did."""
    try:
        yield
    except InternalError:
        raise
    except Exception as error:
        raise InternalError(name, subject) from error


class GenOptions(NamedTuple):
    """What `idlc gen` was asked to do."""

    paths: tuple[str, ...]
    out: str
    package: str | None = None
    include: tuple[str, ...] = ()
    check: bool = False
    vendor_deps: bool = False
    force: bool = False


class Generated(NamedTuple):
    """What a run of `idlc gen` did to one package. `files` counts all that it consists of."""

    package: str
    out: str
    interfaces: int
    files: int
    written: int = 0
    removed: int = 0


class Compiled(NamedTuple):
    """A package ready to be written."""

    target: Target
    plan: Plan
    lock: Lock


def gen(options: GenOptions, report: Report) -> tuple[Generated, ...]:
    """Write, or with `check` compare, a package and what it vendors; empty after an error."""
    files = find(options.paths, report)
    if not files:
        return ()
    given = inputs.one_package(files, options.package, options.out, report)
    library = Library(options.include, report, own=given.own)
    target = Target(options.out, given.package, report, force=options.force)
    if not target.usable():
        return ()
    if not report.had_errors and not options.check and _current(target, given, library, options):
        assert target.lock is not None
        _note_missing(target, target.lock.dependencies, report)
        return tuple(_unchanged(target, target.lock))
    model = _compile(given.package, given.files, library, report, complete=True)
    if report.had_errors:
        return ()
    compiled = _packages(model, given, library, target, options.vendor_deps, report)
    if report.had_errors:
        return ()
    if options.check:
        for one in compiled:
            one.target.drift(one.plan, one.lock)
    elif not all(one.target.apply(one.plan, one.lock) for one in compiled):
        return ()
    _note_missing(target, compiled[-1].lock.dependencies, report)
    return tuple(_generated(one) for one in compiled)
