"""Completions of a word on the command line: names only, nothing is parsed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from idlc.diagnostics.report import Report
from idlc.model import ir
from idlc.model.distros import BY_NAME
from idlc.project import inputs
from idlc.project.library import Library
from idlc.project.root import Root
from idlc.project.settings import load_settings, scope


def packages(word: str, include: Sequence[str], distro: str | None = None) -> list[str]:
    """Return the packages whose names begin with a word."""
    return [name for name in _library(include, distro).packages() if name.startswith(word)]


def types(
    word: str,
    include: Sequence[str],
    kinds: Sequence[ir.Kind] = ir.KINDS,
    *,
    bare: str = "all",
    distro: str | None = None,
) -> list[str]:
    """Return the types that a word begins, written as it is.

    `package/Name` and `package/kind/Name` are both known. Names without a package are of any
    type if `bare` is `all`, otherwise of types in the workspace.
    """
    library = _library(include, distro)
    package, slash, rest = word.partition("/")
    if slash:
        return sorted(_within(package, rest, library, kinds))
    near = list(inputs.nearby_packages(Root.here()))
    named = {
        interface.name
        for name in (library.packages() if bare == "all" else near)
        for interface in library.interfaces(name)
        if word and interface.kind in kinds and interface.name.startswith(word)
    }
    packages = (name for name in library.packages() if name.startswith(word))
    holding = [
        name
        for name in packages
        if any(interface.kind in kinds for interface in library.interfaces(name))
    ]
    if len(holding) == 1 and not named:
        return sorted(_within(holding[0], "", library, kinds))
    return [*sorted(named), *(f"{name}/" for name in holding)]


def topics(word: str, paths: Sequence[str]) -> list[str]:
    """Return the topics of recordings that begin with a word."""
    from idlc.recordings.find import split_recordings
    from idlc.recordings.types import read_topics

    root = Root.here()
    words = split_recordings(paths, root)[0]
    recordings = filter(None, (read_topics(path, root, Report()) for path in words))
    names = {topic.topic.name for recording in recordings for topic in recording.topics}
    return sorted(name for name in names if name.startswith(word))


def _within(package: str, rest: str, library: Library, kinds: Sequence[ir.Kind]) -> Iterator[str]:
    """Yield the types of a package that begin with `rest`, with their kind if it names one."""
    for interface in library.interfaces(package):
        full = f"{interface.kind}/{interface.name}"
        if interface.kind in kinds:
            if interface.name.startswith(rest):
                yield f"{package}/{interface.name}"
            elif full.startswith(rest):
                yield f"{package}/{full}"


def _library(include: Sequence[str], distro: str | None) -> Library:
    """Return the library for a distribution, by default for the one in the settings."""
    report, root = Report(), Root.here()
    name = distro if distro in BY_NAME else None
    selected = scope(load_settings(root, report), distro=name).distro
    return Library(include, root, report, own=inputs.nearby_packages(root), distro=selected)
