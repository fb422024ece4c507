"""Which distribution of ROS 2 an environment has, by what is installed in it."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from idlc.disk.machine import environment
from idlc.disk.packages.enclosing import declared_version
from idlc.model import distro

#: What is taken where nothing of ROS 2 is installed.
DEFAULT = distro.DEFAULT.name
#: The distribution of each release of rosidl, which is in every installation of ROS 2.
_BY_VERSION = {
    "3.1": "humble",
    "4.0": "iron",
    "4.6": "jazzy",
    "4.9": "kilted",
    "5.2": "lyrical",
    "5.3": "rolling",
}
_TELLING = "share/rosidl_runtime_c/package.xml"


class Distribution(NamedTuple):
    """A distribution, by the name that ROS_DISTRO has for it; `why` says by what it is known.

    One that this idlc does not know has an empty name.
    """

    name: str
    why: str


def distribution(prefixes: Iterable[Path] | None = None) -> Distribution:
    """Return the distribution that is installed in prefixes, by default in those of ROS 2.

    The first that tells is right, or the one that ROS_DISTRO names if there are several. Where
    nothing is installed, ROS_DISTRO alone counts: it is often set wrongly.
    """
    places = environment.ament_prefixes() if prefixes is None else prefixes
    found = list(filter(None, map(installed, places)))
    wanted = os.environ.get("ROS_DISTRO", "")
    if not found and wanted:
        return Distribution(
            wanted if wanted in _BY_VERSION.values() else "", f"ROS_DISTRO={wanted}"
        )
    chosen = [one for one in found if one.name == wanted] or found
    return chosen[0] if chosen else Distribution(DEFAULT, "no ROS 2 is installed here")


def installed(prefix: Path) -> Distribution | None:
    """Return the distribution that a prefix itself holds; `None` for one that does not tell."""
    version = declared_version(prefix / _TELLING)
    if not version:
        return None
    name = _BY_VERSION.get(".".join(version.split(".")[:2]), "")
    return Distribution(name, f"rosidl {version} in {prefix.as_posix()}")
