"""Which packages this Python can import, found without importing them."""

from __future__ import annotations

import sys
from importlib.machinery import PathFinder
from pathlib import Path


def importable(package: str, kind: str, beside: str) -> bool:
    """Whether `package.kind` can be imported, or lies next to the package folder `beside`."""
    if (Path(beside).parent / package / kind / "__init__.py").is_file():
        return True
    spec = PathFinder.find_spec(package, sys.path)
    locations = spec.submodule_search_locations if spec else None
    return any((Path(place) / kind / "__init__.py").is_file() for place in locations or ())
