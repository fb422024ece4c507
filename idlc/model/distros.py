"""The distributions of ROS 2, and their differences in handling interface files."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from idlc.diagnostics.text import did_you_mean


class Distro(msgspec.Struct, frozen=True):
    """A distribution, by the name that ROS 2 has for it in paths.

    `has_hashes`: it has type hashes and descriptions. `reads_optional`: `@optional` is no error.
    `has_wheels`: pip can install its packages. `converts_values`: its message classes accept
    `None` for the default of any field, and any iterable for a list.
    """

    name: str
    has_hashes: bool = True
    reads_optional: bool = False
    has_wheels: bool = False
    converts_values: bool = False

    @property
    def title(self) -> str:
        """Its name as people write it."""
        return self.name.capitalize()

    def installing(self, packages: Iterable[str]) -> str:
        """Return the advice to install packages, for a hint."""
        wheels = " ".join(f"ros-{self.name}-{name.replace('_', '-')}" for name in packages)
        return "install it with ROS 2" + (f" or `pip install {wheels}`" if self.has_wheels else "")


#: Every distribution that idlc knows, the oldest first.
DISTROS = (
    Distro("humble", has_hashes=False),
    Distro("iron"),
    Distro("jazzy", has_wheels=True),
    Distro("kilted", has_wheels=True),
    Distro("lyrical", reads_optional=True, converts_values=True),
    Distro("rolling", reads_optional=True, converts_values=True),
)
BY_NAME = {distro.name: distro for distro in DISTROS}
#: The distribution of a run without `--distro` or a setting.
DEFAULT = BY_NAME["jazzy"]
#: The one that accepts whatever another accepts.
NEWEST = DISTROS[-1]


def split_names(text: str) -> list[str]:
    """Return the names in a list with commas."""
    return [name.strip() for name in text.split(",")]


def later(distro: Distro) -> tuple[Distro, ...]:
    """Return the distributions after another."""
    return DISTROS[DISTROS.index(distro) + 1 :]


def titles(distros: tuple[Distro, ...]) -> str:
    """Return the names of distributions for a sentence, such as `Humble, Iron and Jazzy`."""
    *first, last = (distro.title for distro in distros)
    return f"{', '.join(first)} and {last}" if first else last


def unknown_distro(name: str) -> str:
    """Return the hint for a name that no distribution has."""
    return did_you_mean(name, BY_NAME) or f"idlc supports {', '.join(BY_NAME)}"
