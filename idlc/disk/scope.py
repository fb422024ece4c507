"""What every command that looks at interfaces takes besides paths, typed or in pyproject.toml."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from idlc.disk.exclude import Exclusions, exclusion

if TYPE_CHECKING:
    from idlc.disk.pyproject import Config


class Scope(msgspec.Struct, frozen=True):
    """The package's name if it was given, folders with other packages, files that are left out.

    `out` is the folder that [tool.idlc] compiles `paths` into; its name may be the package's.
    """

    package: str | None = None
    include: tuple[str, ...] = ()
    exclude: Exclusions = Exclusions()
    paths: tuple[str, ...] = ()
    out: str | None = None


def scope(
    settings: Config,
    package: str | None = None,
    include: Sequence[str] = (),
    exclude: Sequence[str] = (),
) -> Scope:
    """Return what was typed, with what pyproject.toml says."""
    left_out = [exclusion(exclude, Path.cwd())] if exclude else []
    if settings.exclude and settings.folder is not None:
        left_out.append(exclusion(settings.exclude, settings.folder))
    return Scope(
        package or settings.package,
        (*include, *settings.include),
        Exclusions(tuple(left_out)),
        settings.paths,
        settings.out,
    )
