"""The names that ROS 2 allows (language 2.2)."""

from __future__ import annotations

import keyword
import re
import sys
from functools import lru_cache
from importlib.machinery import BuiltinImporter, FrozenImporter

_LOWER = re.compile(r"[a-z](_?[a-z0-9])*")
_UPPER = re.compile(r"[A-Z](_?[A-Z0-9])*")
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_MESSAGE = re.compile(r"[A-Z][A-Za-z0-9]*")
_MESSAGE_SUFFIXES = ("_Request", "_Response", "_Goal", "_Result", "_Feedback")

PACKAGE_HINT = "use lower-case letters, digits and single underscores, and begin with a letter"
FIELD_HINT = PACKAGE_HINT
CONSTANT_HINT = "use capitals, digits and single underscores, and begin with a letter"
MESSAGE_HINT = "use letters and digits, and begin with a capital letter"


def is_package_name(name: str) -> bool:
    """Return whether a package may have this name."""
    return _LOWER.fullmatch(name) is not None


def is_field_name(name: str) -> bool:
    """Return whether a field may have this name."""
    return _LOWER.fullmatch(name) is not None


def is_recorded_name(name: str) -> bool:
    """Return whether a recorded field or constant may have this name, as in ROS 1 and in IDL."""
    # Python calls a field `from` `from_`
    is_taken = name.endswith("_") and keyword.iskeyword(name[:-1])
    return _IDENTIFIER.fullmatch(name) is not None and not is_taken


def is_constant_name(name: str) -> bool:
    """Return whether a constant may have this name."""
    return _UPPER.fullmatch(name) is not None


def is_message_name(name: str) -> bool:
    """Return whether a message may have this name; derived suffixes count once, in this order."""
    name = name.removeprefix("Sample_")
    for suffix in _MESSAGE_SUFFIXES:
        name = name.removesuffix(suffix)
    return _MESSAGE.fullmatch(name) is not None


def field_name_like(name: str) -> str:
    """Return the nearest valid field name, for hints; empty if nothing is left."""
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name)
    return re.sub(r"[^a-z0-9]+", "_", spaced.lower()).strip("_").lstrip("0123456789_")


def message_name_like(name: str) -> str:
    """Return the nearest valid message name, for hints; it may still not be valid."""
    return "".join(part[:1].upper() + part[1:] for part in re.split(r"\W|_", name))


@lru_cache(maxsize=4096)
def snake_case(name: str) -> str:
    """Return the module name that rosidl derives from an interface's name (language 7.1)."""
    name = re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", name)
    return re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name).lower()


def is_module_name(name: str) -> bool:
    """Return whether an import statement can name a module, spelled as its file on every system."""
    return name.isidentifier() and name.isascii() and not keyword.iskeyword(name)


#: Modules that a starting Python has loaded, frozen or not, before it looks anywhere else.
_LOADED = frozenset(
    ("abc", "codecs", "encodings", "genericpath", "io", "ntpath", "os", "posixpath", "site", "stat")
)
#: Imports of generated code, nodes and builds beside the standard library.
_NEEDED = frozenset(("idlc", "numpy", "rclpy"))


def why_not_package(name: str) -> str:
    """Return the reason why a package cannot have this name, in words that follow the name."""
    if not is_package_name(name):
        like = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
        suggestion = f"; did you mean `{like}`?" if is_package_name(like) else ""
        return f"is not a package name; {PACKAGE_HINT}{suggestion}"
    if keyword.iskeyword(name):
        return "is a Python keyword and cannot be imported"
    if name in _LOADED or FrozenImporter.find_spec(name) or BuiltinImporter.find_spec(name):
        return "is a standard library module, which Python would import instead"
    if name in sys.stdlib_module_names or name in _NEEDED:
        return "is the name of another module; programs would import this package instead"
    return ""
