"""What this machine offers: installed ROS packages and importable Python packages."""

from __future__ import annotations

import os
import sys
from importlib.machinery import PathFinder
from pathlib import Path

#: Where a prefix lists what is installed in it, by kind and name.
INDEX = "share/ament_index/resource_index"


def ament_prefixes() -> tuple[Path, ...]:
    """Return the folders that ROS packages are installed in, in order of precedence."""
    listed = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return tuple(dict.fromkeys(Path(prefix) for prefix in (*listed, sys.prefix) if prefix))


def modules_folder() -> str:
    """Return the folder of a prefix in which the Python of ROS 2 here looks for modules."""
    found = (
        path.parent.relative_to(prefix).as_posix()
        for prefix in ament_prefixes()
        for path in sorted(prefix.glob("lib/python3*/site-packages/rclpy"))
    )
    own = f"lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages"
    return next(found, own)


def runs_nodes() -> bool:
    """Return whether this Python has rclpy; that of pipx, uv or pre-commit has idlc alone."""
    return bool(python_folders("rclpy"))


def python_folders(package: str) -> list[Path]:
    """Return the folders that importing a package would use, without importing it."""
    spec = PathFinder.find_spec(package, sys.path)
    return [Path(place) for place in (spec and spec.submodule_search_locations) or ()]


def machine() -> str:
    """Return the processor that programs here are for, such as `x86_64`; empty if not on Linux."""
    whole = sys.maxsize > 1 << 32  # a 32-bit Python on a 64-bit kernel
    if sys.platform != "linux" or not whole:
        return ""
    import platform  # slow to import, for what few runs ask

    return platform.machine()


def wheel_platform() -> str:
    """Return the platform tag of wheels with libraries for this machine.

    The libraries need none of the system's, so they run wherever the generated code does: the tags
    are those of the oldest systems that have a Python for it.
    """
    import platform

    libc = "manylinux_2_17" if platform.libc_ver()[0] == "glibc" else "musllinux_1_1"
    return f"{libc}_{machine()}"
