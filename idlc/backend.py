"""Builds a folder of interfaces as a wheel: `build-backend = "idlc.backend"` in pyproject.toml.

The hooks of PEP 517 and PEP 660. The archives are written by hatchling, which frontends install
because `get_requires_for_build_...` names it. What is compiled goes into a temporary folder and
from there into the wheel; nothing is written into the source folder.

An editable wheel is like any other: the source folder has no Python code to which it could lead,
and what Python, recorders and C++ tools read of a package must change together.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

#: Licences as expressions are known to hatchling since 1.27.
BUILDER = "hatchling>=1.27,<2"
ConfigSettings = Mapping[str, Any] | None


def get_requires_for_build_wheel(config_settings: ConfigSettings = None) -> list[str]:  # noqa: ARG001
    """Return what must be installed besides idlc."""
    return [BUILDER]


get_requires_for_build_sdist = get_requires_for_build_wheel
get_requires_for_build_editable = get_requires_for_build_wheel


def build_sdist(sdist_directory: str, config_settings: ConfigSettings = None) -> str:
    """Write the archive of the source folder, and return its name."""
    from idlc.build.hooks import archive, sdist

    settings = dict(config_settings or {})
    return archive(lambda report: sdist(sdist_directory, settings, report))


def build_wheel(
    wheel_directory: str,
    config_settings: ConfigSettings = None,
    metadata_directory: str | None = None,  # noqa: ARG001
) -> str:
    """Compile the package in the working folder into a wheel, and return its name.

    The setting `distro` names the distribution of ROS 2 that the package is for, and whose C++
    tools are to know it; without it that is the one that is installed here. `libraries=no` makes
    a wheel for every machine, without libraries for these tools.
    """
    from idlc.build.hooks import archive, wheel

    settings = dict(config_settings or {})
    return archive(lambda report: wheel(wheel_directory, settings, report))


build_editable = build_wheel
