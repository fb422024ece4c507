"""Lines of users' files: as long as ament allows, and laid out as formatters do it."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence

from idlc.generate.python.lines import Group, import_from, layout_lines
from idlc.model import ir, python_names

WIDTH = 99
INDENT = 4


def call(function: str, words: Sequence[str], *, depth: int) -> list[str]:
    """Return the lines of a call: one if it fits, else a line for each argument."""
    return _unindented(Group(function, tuple(words)), depth * INDENT)


def collection(head: str, opening: str, items: Sequence[str], closing: str) -> list[str]:
    """Return the lines of a list, set or dictionary: one if it fits, else a line for each item."""
    return _unindented(Group(head, tuple(items), brackets=opening + closing), 0)


def _unindented(group: Group, indent: int) -> list[str]:
    return [line[indent:] for line in layout_lines(group, indent, width=WIDTH)]


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
    entries = [(name.lower(), "", f"import {name}") for name in plain]
    for module, names in modules.items():
        renamed = {name for name in names if " as " in name}
        entries += [(module.lower(), n.lower(), f"from {module} import {n}") for n in renamed]
        ordered = sorted(set(names) - renamed, key=lambda name: (name.lower(), name))
        if not ordered:
            continue
        line = "\n".join(import_from(module, ordered, width=WIDTH))
        entries.append((module.lower(), ordered[0].lower(), line))
    return [line for *_, line in sorted(entries)]


def signature(head: str, parameters: Sequence[str], returns: str, *, depth: int) -> str:
    """Return the lines of a function's head, the first without its indentation."""
    line = f"{head}({', '.join(parameters)}) -> {returns}:"
    margin = " " * (depth * INDENT)
    if len(margin) + len(line) <= WIDTH:
        return line
    inner = f"{margin}    {', '.join(parameters)}"
    if len(inner) <= WIDTH:
        return f"{head}(\n{inner}\n{margin}) -> {returns}:"
    each = "".join(f"{margin}    {parameter},\n" for parameter in parameters)
    return f"{head}(\n{each}{margin}) -> {returns}:"


class ImportList:
    """Names by the modules that they come from."""

    def __init__(self, names: Mapping[str, Iterable[str]]) -> None:
        self._names = {module: set(imported) for module, imported in names.items()}

    def add(self, module: str, *names: str) -> None:
        """Add names from a module."""
        if names:
            self._names.setdefault(module, set()).update(names)

    def add_all(self, names: Mapping[str, Iterable[str]]) -> None:
        """Add names from several modules."""
        for module, imported in names.items():
            self.add(module, *imported)

    def packages(self) -> set[str]:
        """Return the packages that are imported, but for the standard library."""
        return {module.partition(".")[0] for module in self._names} - sys.stdlib_module_names

    def groups(self, plain: Iterable[str]) -> tuple[tuple[str, ...], ...]:
        """Return the lines in groups: the standard library's, then all others.

        `plain` modules are imported as they are.
        """
        modules = {*self._names, *plain}
        library = sys.stdlib_module_names
        standard = {name for name in modules if name.partition(".")[0] in library}
        groups = (
            imports(
                {module: self._names[module] for module in group if module in self._names},
                [module for module in plain if module in group],
            )
            for group in (standard, modules - standard)
        )
        return tuple(tuple(group) for group in groups if group)


#: Fields that are named in one line.
FIELDS = 6
#: The length of the line's start that tests look for.
HEAD = 50


def log_lines(title: str, variable: str, message: ir.Message) -> tuple[str, ...]:
    """Return the lines of a method that log a message, its short fields one by one."""
    return tuple(logged(_parts(title, variable, message), depth=2))


def log_head(title: str, variable: str, message: ir.Message) -> str:
    """Return the start of the line that these lines log."""
    return " ".join(_parts(title, variable, message)).partition("{")[0][:HEAD]


def _parts(title: str, variable: str, message: ir.Message) -> list[str]:
    short = [f for f in message.fields if isinstance(f.type, (ir.Primitive, ir.String))]
    parts = [f"{f.name}={{{variable}.{python_names.field(f.name)}!r}}" for f in short[:FIELDS]]
    if not parts:
        parts = [f"{variable}={{{variable}}}"] if message.fields else [f"{variable} received"]
    return [f"{title}:", *parts]
