"""`idlc.load`: classes without generated files, also of the types that a robot uses."""

from __future__ import annotations

from collections.abc import Iterable

from idlc.api.sources import read_source
from idlc.recordings.load import LoadedPackages, loaded


def load(what: str, *, include: Iterable[str] = (), distro: str | None = None) -> LoadedPackages:
    """Compile interfaces, and return their classes.

    `what` is a recording, a .msg, .srv or .action file, a folder of them, or the name of a type or
    package that is known here. `include` are folders in which other packages are looked for first.
    The classes can be pickled, and read wherever idlc is installed; type checkers do not know them,
    so programs are better off with `idlc gen`.
    """
    return loaded(what, include=include, distro=distro, read=read_source)
