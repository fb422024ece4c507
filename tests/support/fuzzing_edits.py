"""Targets that edit the user's own files: what comes out is sound and holds all that went in."""

from __future__ import annotations

import ast
import io
import tokenize
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

from idlc.packaging import dependencies, entry_points, launch_py
from idlc.packaging.entry_points import ConsoleScript
from idlc.packaging.files import Edited, Outcome

TALKER = ConsoleScript("talker", "demo.talker:main")


def edited(data: bytes, edit: Callable[[str], Outcome]) -> tuple[str, str] | None:
    """Return a text before and after an edit, which must change nothing when it is made again."""
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        return None
    outcome = edit(text)
    if not isinstance(outcome, Edited):
        assert outcome.why
        return None
    assert edit(outcome.text) == outcome
    return text, outcome.text


def words(text: str) -> Counter[str]:
    """Return what a Python file says: its tokens, without layout."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return Counter(token.string for token in tokens if token.string.strip() not in ("", ","))


def python(data: bytes, edit: Callable[[str], Outcome]) -> None:
    """Valid Python stays that, with every word and comment that it had."""
    found = edited(data, edit)
    if found:
        before, after = (text.removeprefix("\ufeff") for text in found)
        ast.parse(after)
        lost = words(before) - words(after)
        # a text of several lines may have become a longer one
        assert not [word for word in lost if word[-1] not in "'\""], lost


def setup_file(data: bytes, _: Path) -> None:
    """A setup.py gets a console script."""
    python(data, lambda text: entry_points.add_to_setup(text, TALKER))


def launch_file(data: bytes, _: Path) -> None:
    """A launch file gets a node."""
    python(data, lambda text: launch_py.add_node(text, launch_py.Started("demo", "talker")))


def setup_cfg(data: bytes, _: Path) -> None:
    """A setup.cfg gets a console script: a line or two more, the others as they were."""
    found = edited(data, lambda text: entry_points.add_to_cfg(text, TALKER))
    if found:
        before, after = (Counter(text.splitlines()) for text in found)
        assert sum((before - after).values()) <= 1
        assert found[0] == found[1] or any("demo.talker:main" in line for line in after)


def manifest(data: bytes, _: Path) -> None:
    """A package.xml gets dependencies, and keeps every element and every other character."""

    def edit(text: str) -> Outcome:
        return dependencies.add_dependencies(
            text, depends=("rclpy", "b&c"), tests=("pytest",), group=True
        )

    found = edited(data, edit)
    if found:
        before, after = found
        rest = iter(after)
        assert all(character in rest for character in before)
        elements = [Counter(map(ElementTree.tostring, children(text))) for text in found]
        assert not elements[0] - elements[1]
        assert "rclpy" in {child.text and child.text.strip() for child in children(after)}


def children(text: str) -> list[ElementTree.Element]:
    parser = ElementTree.XMLParser(encoding="utf-8")  # noqa: S314 - expat bounds entities
    root = ElementTree.fromstring(text.encode("utf-8"), parser)  # noqa: S314
    for child in root:
        child.tail = None
    return list(root)
