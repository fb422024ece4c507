"""Text for terminals and messages: visible characters, widths, suggestions for misspelt names."""

from __future__ import annotations

import re
import shlex
import unicodedata
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from enum import Enum

TAB_STOP = 4
#: Control, format, surrogate, private-use and unassigned characters, line and paragraph ends.
_HIDDEN = frozenset(("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"))
#: Control characters, including bidirectional ones, other than tabs and line feeds.
_CONTROL = re.compile("[\\0-\\x08\\x0b-\\x1f\\x7f-\\x9f\\u2028-\\u202e\\u2066-\\u2069]")


def visible(text: str, column: int = 0) -> str:
    """Return `text` with tabs expanded and every invisible character spelled out.

    `column` is where it starts, which decides how far a tab reaches.
    """
    if text.isascii() and text.isprintable():
        return text
    parts: list[str] = []
    for character in text:
        tab = " " * (TAB_STOP - column % TAB_STOP)
        part = tab if character == "\t" else _spelled(character)
        parts.append(part)
        column += display_width(part)
    return "".join(parts)


def one_line(text: str) -> str:
    """Return `text` made visible, line ends and tabs included."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(_spelled(character) for character in text)


def printable(text: str) -> str:
    """Return text of any number of lines with its control characters spelled out.

    Characters that scripts and emoji need, such as joiners, stay.
    """
    return _CONTROL.sub(lambda match: _spelled(match[0]), text)


def _spelled(character: str) -> str:
    code = ord(character)
    if code < 0x20:
        return chr(0x2400 + code)
    if code == 0x7F:
        return "\u2421"
    if code < 0x7F or unicodedata.category(character) not in _HIDDEN:
        return character
    return f"<U+{code:04X}>"


def display_width(text: str) -> int:
    """Return the terminal columns of visible text: wide characters two, combining ones none."""
    if text.isascii():
        return len(text)
    return sum(_width(character) for character in text)


def _width(character: str) -> int:
    if unicodedata.category(character) in ("Mn", "Me"):
        return 0
    return 2 if unicodedata.east_asian_width(character) in "WF" else 1


def edit_distance(left: str, right: str) -> int:
    """Return how many insertions, removals, changes and swaps turn one text into the other."""
    before: list[int] = []
    row = list(range(len(right) + 1))
    for i, a in enumerate(left, 1):
        last, before, row = before, row, [i]
        for j, b in enumerate(right, 1):
            best = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (a != b))
            if i > 1 and j > 1 and a == right[j - 2] and b == left[i - 2]:
                best = min(best, last[j - 2] + 1)
            row.append(best)
    return row[-1]


#: Ends of package names, which are ignored when two names are compared.
_ENDS = ("_msgs", "_interfaces", "_srvs", "_actions")


def closest(name: str, names: Iterable[str]) -> str | None:
    """Return the known name that is nearest, or `None` if none is near.

    A name of two letters may have one of them wrong, a long one three.
    """
    if len(name) > 100:
        return None
    limit = min(max(1, len(name) // 3), 3) if len(name) > 1 else 0
    distances = (
        (edit_distance(name.lower(), candidate.lower()), candidate)
        for candidate in names
        if abs(len(candidate) - len(name)) <= limit
    )
    near = min((pair for pair in distances if pair[0] <= limit), default=None)
    return near[1] if near else None


def near_pairs(left: Iterable[str], right: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield names of the left that differ in one letter from one of the right, in linear time."""
    variants = {variant: name for name in right for variant in _variants(name)}
    for name in left:
        if other := next(filter(None, map(variants.get, _variants(name))), None):
            yield name, other


def _variants(name: str) -> Iterator[str]:
    """Yield a name, and the name without each of its letters."""
    yield name
    for at in range(len(name)):
        yield name[:at] + name[at + 1 :]


def package_hint(name: str, names: Iterable[str]) -> str:
    """Return the hint for an unknown package."""
    near = closest_package(name, names)
    if near is not None:
        return f"did you mean `{near}`?"
    return (
        f"`{name}` is not built in; {including('DIR')}, where DIR contains its sources, "
        "or source the ROS 2 workspace that contains it"
    )


class Audience(Enum):
    """The reader of a hint, who needs the name of an option, a setting or an argument."""

    COMMAND = "the person who typed a command"
    SETTINGS = "a user of a build or an editor"
    PYTHON = "a caller of the library"


_AUDIENCE: ContextVar[Audience] = ContextVar("audience", default=Audience.PYTHON)


@contextmanager
def addressed_to(audience: Audience) -> Iterator[None]:
    """Let hints be for this audience."""
    before = _AUDIENCE.set(audience)
    try:
        yield
    finally:
        _AUDIENCE.reset(before)


def worded(command: str, python: str) -> str:
    """Return the words for a command line, or those for Python."""
    return python if _AUDIENCE.get() is Audience.PYTHON else command


def including(folder: str) -> str:
    """Return the advice to look for packages in a folder as well."""
    if _AUDIENCE.get() is Audience.SETTINGS:
        return f"add `{folder}` to `include` in [tool.idlc] of pyproject.toml"
    return worded(f"add `-I {shlex.quote(folder)}`", f"add `include=[{folder!r}]`")


def absence() -> str:
    """Return the advice on a folder that should contain packages, and does not exist."""
    if _AUDIENCE.get() is Audience.SETTINGS:
        return (
            "correct `include` in [tool.idlc] of pyproject.toml; source distributions do not "
            "contain it, so build without one: `python -m build --wheel`"
        )
    return worded(
        "correct `-I`, or `include` in [tool.idlc] of pyproject.toml", "correct `include`"
    )


def closest_package(name: str, names: Iterable[str]) -> str | None:
    """Return the package of the nearest name, or `None` if none is near.

    Digits are no slips of the pen: `nav2_msgs` is not `nav_msgs`.
    """
    end = next((end for end in _ENDS if name.endswith(end)), "")
    digits = "".join(filter(str.isdigit, name))
    alike = [other for other in names if "".join(filter(str.isdigit, other)) == digits]
    same_end = {other.removesuffix(end): other for other in alike if other.endswith(end)}
    stem = closest(name.removesuffix(end), same_end)
    if stem is not None:
        return same_end[stem]
    return closest(name, (other for other in alike if not other.endswith(end)))


def did_you_mean(name: str, names: Iterable[str]) -> str | None:
    """Return the hint that names the nearest known name, or `None`."""
    near = closest(name, names)
    return f"did you mean `{near}`?" if near else None
