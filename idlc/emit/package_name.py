"""Which packages Python can import by their name."""

from __future__ import annotations

import keyword
import re
import sys
from importlib.machinery import BuiltinImporter, FrozenImporter

from idlc.model.names import is_package_name

#: Modules that a starting Python has loaded, frozen or not, before it looks anywhere else.
_LOADED = frozenset(
    ("abc", "codecs", "encodings", "genericpath", "io", "ntpath", "os", "posixpath", "site", "stat")
)
#: What generated code, and the nodes and builds that use it, import beside the standard library.
_NEEDED = frozenset(("idlc", "numpy", "rclpy"))


def why_not_package(name: str) -> str:
    """Return why a package cannot be called so and imported, in words that follow its name."""
    if not is_package_name(name):
        like = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
        meant = f"; did you mean `{like}`?" if is_package_name(like) else ""
        return f"is not a package name: lower-case letters, digits and single underscores{meant}"
    if keyword.iskeyword(name):
        return "is a keyword of Python and cannot be imported"
    if name in _LOADED or FrozenImporter.find_spec(name) or BuiltinImporter.find_spec(name):
        return "is a module of Python itself, which would be imported instead"
    if name in sys.stdlib_module_names or name in _NEEDED:
        return "is the name of a module that programs import: they would get this package instead"
    return ""
