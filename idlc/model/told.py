"""What a running program tells of a type → a model: by its sources, or by its description."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.model import ir
from idlc.model.describe import DescriptionDict
from idlc.model.described import described
from idlc.model.link import Model, link
from idlc.model.lowering.file import lower
from idlc.model.pool import Pool
from idlc.syntax.parse import parse

#: Characters of all sources together; more are left alone.
MAX_TEXT = 1 << 20


def told(
    description: DescriptionDict, sources: Mapping[str, str], name: str, type_hash: str, who: str
) -> Model:
    """Return what a type of this name and hash is; raises NotBelievedError.

    The sources have constants, units and comments, so they count if they have that hash. A
    program need not tell them, and tells none of what services and actions imply.
    """
    compiled = _compiled(sources, name, who)
    if compiled is not None and compiled.describer.hash(name) == type_hash:
        return compiled
    return described(description, name, type_hash, who)


def _compiled(sources: Mapping[str, str], name: str, who: str) -> Model | None:
    """Return the model of a message and of all that it holds, if the sources have it."""
    library = _Library(sources, who)
    report = Report()
    try:
        top = ir.TypeName.parse(name)
    except ValueError:
        return None
    source = library.source(top)
    if top.kind != "msg" or source is None or sum(map(len, sources.values())) > MAX_TEXT:
        return None
    pool = Pool(library)
    own = lower(parse(source), top, report)
    pool.add(own, report)
    model = link(top.package, [own], library, report, pool)
    return None if report.had_errors else model.only({top})


class _Library:
    """The sources of one program, as `link.Library`."""

    def __init__(self, sources: Mapping[str, str], who: str) -> None:
        self._sources = sources
        self._who = who

    def source(self, name: ir.TypeName) -> Source | None:
        """Return the text of an interface, or `None` if there is none of that name."""
        text = self._sources.get(str(name))
        return Source(f"{name} ({self._who})", text) if text is not None else None

    def names(self, _package: str) -> Iterable[str]:
        """Return nothing: hints at other names are for people who write files."""
        return ()

    def packages(self) -> Iterable[str]:
        """Return nothing, for the same reason."""
        return ()

    def nearby(self, _package: str) -> str | None:
        """Return nothing, for the same reason."""
        return None
