"""What this machine offers: installed ROS packages and importable Python packages."""

from __future__ import annotations

import os
import sys
from importlib.machinery import PathFinder
from pathlib import Path


def ament_prefixes() -> tuple[Path, ...]:
    """Return the folders that ROS packages are installed in, in order of precedence."""
    listed = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return tuple(dict.fromkeys(Path(prefix) for prefix in (*listed, sys.prefix) if prefix))


def runs_nodes() -> bool:
    """Return whether this Python has rclpy; that of pipx, uv or pre-commit has idlc alone."""
    return bool(python_folders("rclpy"))


def python_folders(package: str) -> list[Path]:
    """Return the folders that importing a package would use, without importing it."""
    spec = PathFinder.find_spec(package, sys.path)
    return [Path(place) for place in (spec and spec.submodule_search_locations) or ()]
