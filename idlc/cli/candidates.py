"""What a word on the command line may become: names only, nothing is parsed."""

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

    `package/Name` and `package/kind/Name` are both known. A name without package may be `bare`:
    that of any type for `all`, otherwise that of a type of the packages around.
    """
    library = _library(include, distro)
    package, slash, rest = word.partition("/")
    if slash:
        return sorted(_within(package, rest, library, kinds))
    near = list(inputs.near(Root.here()))
    named = {
        one.name
        for name in (library.packages() if bare == "all" else near)
        for one in library.interfaces(name)
        if word and one.kind in kinds and one.name.startswith(word)
    }
    holding = [
        name
        for name in library.packages()
        if name.startswith(word) and any(one.kind in kinds for one in library.interfaces(name))
    ]
    if len(holding) == 1 and not named:
        return sorted(_within(holding[0], "", library, kinds))
    return [*sorted(named), *(f"{name}/" for name in holding)]


def topics(word: str, paths: Sequence[str]) -> list[str]:
    """Return the topics of recordings that a beginning fits."""
    from idlc.recordings.find import divided
    from idlc.recordings.versions import read

    found = (read(path, Report()) for path in divided(paths, Root.here())[0])
    names = {one.topic.name for recording in found if recording for one in recording.topics}
    return sorted(name for name in names if name.startswith(word))


def _within(package: str, rest: str, library: Library, kinds: Sequence[ir.Kind]) -> Iterator[str]:
    """Yield the types of a package that a beginning fits, with their kind if it names one."""
    for one in library.interfaces(package):
        full = f"{one.kind}/{one.name}"
        if one.kind in kinds:
            if one.name.startswith(rest):
                yield f"{package}/{one.name}"
            elif full.startswith(rest):
                yield f"{package}/{full}"


def _library(include: Sequence[str], distro: str | None) -> Library:
    """Return what is there for the distribution that was typed, else for the one that is meant."""
    report, root = Report(), Root.here()
    known = distro if distro in BY_NAME else None
    meant = scope(load_settings(root, report), distro=known).distro
    return Library(include, root, report, own=inputs.near(root), distro=meant)
