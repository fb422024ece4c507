"""What every command that looks at interfaces takes besides paths, typed or in pyproject.toml."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from idlc.model.distros import BY_NAME, DEFAULT, Distro, listed
from idlc.project.files import NOTHING_OPEN, Unsaved
from idlc.project.find import Exclusions, exclusion
from idlc.project.prefixes import distribution

if TYPE_CHECKING:
    from idlc.project.settings import Config


class Scope(msgspec.Struct, frozen=True):
    """The package's name if it was given, folders with other packages, files that are left out.

    `out` is the folder that [tool.idlc] compiles `paths` into; its name may be the package's.
    `distros` are the distributions of ROS 2 that files are read for, one except for `check`;
    none means the one that is installed. `unsaved` counts instead of what files hold.
    """

    package: str | None = None
    include: tuple[str, ...] = ()
    exclude: Exclusions = Exclusions()
    paths: tuple[str, ...] = ()
    out: str | None = None
    distros: tuple[Distro, ...] = msgspec.field(default_factory=lambda: _distros(()))
    unsaved: Unsaved = NOTHING_OPEN

    @property
    def distro(self) -> Distro:
        """The distribution that files are read for where that is one."""
        return self.distros[0] if self.distros else _installed()


def scope(
    settings: Config,
    package: str | None = None,
    include: Sequence[str] = (),
    exclude: Sequence[str] = (),
    distro: str | None = None,
) -> Scope:
    """Return what was typed, with what pyproject.toml says; `distro` is a list with commas."""
    left_out = [exclusion(exclude, Path.cwd())] if exclude else []
    if settings.exclude and settings.folder is not None:
        left_out.append(exclusion(settings.exclude, settings.folder))
    return Scope(
        package or settings.package,
        (*include, *settings.include),
        Exclusions(tuple(left_out)),
        settings.paths,
        settings.out,
        _distros(listed(distro) if distro else settings.distro),
    )


def _distros(names: Sequence[str]) -> tuple[Distro, ...]:
    """Return the distributions with these names, each once."""
    return tuple(dict.fromkeys(BY_NAME[name] for name in names))


def _installed() -> Distro:
    """Return the distribution that is installed here, or the default for an unknown one."""
    return BY_NAME.get(distribution().name, DEFAULT)


@contextmanager
def working_in(folder: Path) -> Iterator[None]:
    """Work in a folder, as after `cd`; one that is gone raises OSError.

    If the folder from before is gone, which a server may outlive, the process stays in this one.
    """
    before = folder
    with contextlib.suppress(OSError):
        before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            os.chdir(before)
