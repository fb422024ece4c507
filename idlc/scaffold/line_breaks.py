"""Lines of users' files: as long as ament allows, and laid out as formatters do it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from idlc.emit.python_lines import Group, import_from, lines

WIDTH = 99
INDENT = 4


def call(function: str, words: Sequence[str], *, depth: int) -> list[str]:
    """Return the lines of a call: one if it fits, else a line for each argument."""
    return _unindented(Group(function, tuple(words)), depth * INDENT)


def collection(head: str, opening: str, items: Sequence[str], closing: str) -> list[str]:
    """Return the lines of a list, set or dictionary: one if it fits, else a line for each item."""
    return _unindented(Group(head, tuple(items), brackets=opening + closing), 0)


def _unindented(group: Group, indent: int) -> list[str]:
    return [line[indent:] for line in lines(group, indent, width=WIDTH)]


def logged(parts: Sequence[str], *, depth: int) -> list[str]:
    """Return the lines that log an f-string, whose parts are joined by single spaces.

    Where the text is too long for a line, each part has a line of its own.
    """
    function = "self.get_logger().info"
    line = f"{function}({_literal(' '.join(parts))})"
    if depth * INDENT + len(line) <= WIDTH:
        return [line]
    whole = f"    {_literal(' '.join(parts))}"
    if depth * INDENT + len(whole) <= WIDTH:
        return [f"{function}(", whole, ")"]
    first, *rest = parts
    texts = [_literal(first), *(_literal(f" {part}") for part in rest)]
    return [f"{function}(", *(f"    {text}" for text in texts), ")"]


def _literal(text: str) -> str:
    return f"f'{text}'" if "{" in text else f"'{text}'"


def imports(modules: Mapping[str, Iterable[str]], plain: Iterable[str]) -> list[str]:
    """Return import lines, sorted by module: `modules` with names, `plain` as they are."""
    found = [(name.lower(), "", f"import {name}") for name in plain]
    for module, names in modules.items():
        renamed = {name for name in names if " as " in name}
        found += [(module.lower(), n.lower(), f"from {module} import {n}") for n in renamed]
        ordered = sorted(set(names) - renamed, key=lambda name: (name.lower(), name))
        if not ordered:
            continue
        line = "\n".join(import_from(module, ordered, width=WIDTH))
        found.append((module.lower(), ordered[0].lower(), line))
    return [line for *_, line in sorted(found)]


def signature(head: str, parameters: Sequence[str], returns: str, *, depth: int) -> str:
    """Return the lines of a function's head, the first without its indentation."""
    line = f"{head}({', '.join(parameters)}) -> {returns}:"
    margin = " " * (depth * INDENT)
    if len(margin) + len(line) <= WIDTH:
        return line
    inner = f"{margin}    {', '.join(parameters)}"
    if len(inner) <= WIDTH:
        return f"{head}(\n{inner}\n{margin}) -> {returns}:"
    each = "".join(f"{margin}    {one},\n" for one in parameters)
    return f"{head}(\n{each}{margin}) -> {returns}:"
