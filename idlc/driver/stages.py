"""The compiler's passes in order, from texts to a checked model.

The passes are imported where they are used, so that a run with nothing to do costs little.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from idlc.disk import inputs
from idlc.disk.library import Library
from idlc.model import derive, ir
from idlc.text.diagnostics import Report
from idlc.text.source import Source

if TYPE_CHECKING:
    from idlc.model.link import Model


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


def compile_package(
    package: str,
    sources: Iterable[tuple[ir.TypeName, Source]],
    library: Library,
    report: Report,
) -> Model:
    """Return the linked and checked model of a package's files; every problem is reported."""
    from idlc.checks import check as run_checks
    from idlc.model.link import link
    from idlc.model.lower import lower
    from idlc.syntax.parse import parse

    own = []
    for name, source in sources:
        with stage("parse", source.path):
            tree = parse(source)
        with stage("lower", source.path):
            own.append(lower(tree, name, report))
    with stage("link", package):
        model = link(package, own, library, report)
    with stage("check", package):
        run_checks(model, report)
    return model


def sources_of(given: inputs.Inputs, report: Report) -> Iterator[tuple[ir.TypeName, Source]]:
    """Yield the texts of a package's files; those that are not text are reported."""
    for one in given.files:
        source = one.source(report)
        if source is not None:
            yield ir.TypeName(given.package, one.file.kind, one.file.name), source


def models_of(
    packages: Sequence[inputs.Inputs], include: Sequence[str], report: Report
) -> Iterator[tuple[Model, list[str]]]:
    """Yield each package's model and the names of what its files define, derived ones included."""
    own = {given.package: given.folders for given in packages}
    library = Library(include, report, own=own)
    for given in packages:
        sources = list(sources_of(given, report))
        model = compile_package(given.package, sources, library, report)
        names = {name for name, _ in sources}
        yield model, [n for own in model.own if own.name in names for n in derived_names(own)]


def derived_names(interface: ir.Interface) -> list[str]:
    """Return the names of an interface and of all structures derived from it, sorted."""
    parts = (*derive.messages(interface), *derive.pseudo_structures(interface))
    return sorted({str(part.name) for part in parts})
