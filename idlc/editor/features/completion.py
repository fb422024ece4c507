"""Completions of a line: types, names, values, units and codes.

Only the line and lists of names are read, so that completions arrive while the user types.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

from idlc.check.style import QUANTITIES, expects_unit
from idlc.diagnostics.codes import CODES
from idlc.diagnostics.report import Severity
from idlc.diagnostics.terminal import counted
from idlc.editor.documents import Document
from idlc.editor.features.hover import code, shortened
from idlc.editor.protocol.capabilities import ADD_DEPENDENCY
from idlc.editor.protocol.parts import Markup, Part, Position, PositionParams, Range, TextEdit
from idlc.editor.protocol.positions import in_lines, lines_of, units
from idlc.editor.state import ServerState
from idlc.editor.workspace import Workspace
from idlc.language import tree
from idlc.language.parse import parse_definition
from idlc.model import ir, names
from idlc.model.lower_types import STRINGS

#: Numbers that people take for bounds.
BOUNDS = ("1", "3", "6", "9", "16", "32", "36", "64", "128", "256", "1024")

#: Elements of the longest array of which a value is offered.
MOST_ELEMENTS = 36


def suggested_field_name(type_: str) -> str:
    """Return the name that is suggested first for a field that holds a message."""
    return names.snake_case(type_.rpartition("/")[2].partition("[")[0])


def suggested_values(type_: str) -> Iterator[str]:
    """Yield values for a type as it is written; none for a message."""
    base, bracket, length = type_.partition("[")
    base = base.partition("<=")[0]
    if bracket:
        size = length.removesuffix("]")
        if base not in ir.PRIMITIVES and base not in STRINGS:
            return
        if not size.isdecimal():
            yield "[]"
        elif len(size) <= len(str(MOST_ELEMENTS)) and 0 < int(size) <= MOST_ELEMENTS:
            yield f"[{', '.join([next(suggested_values(base))] * int(size))}]"
    elif base == "bool":
        yield from ("true", "false")
    elif base in STRINGS:
        yield '""'
    elif base in ir.PRIMITIVES:
        info = ir.PRIMITIVES[base]
        if info.low is None:
            yield from ("0.0", "1.0", "nan", "inf")
        else:
            yield from dict.fromkeys(map(str, (0, 1, info.low, info.high)))


def suggested_constants(lines: list[str], line: int, type_: str) -> Iterator[tuple[str, str]]:
    """Yield name and value of the constants of a type in the section around a line."""
    before = [number for number in range(line) if lines[number].rstrip("\r\n") == "---"]
    start = before[-1] + 1 if before else 0
    for text in lines[start:]:
        if text.rstrip("\r\n") == "---":
            return
        code = text.partition("#")[0].replace("\t", " ").rstrip()
        body = parse_definition(code) if "=" in code else None
        if isinstance(body, tree.Constant) and body.type.whole.text == type_ and body.value.text:
            yield body.name.text, body.value.text


def units_for(name: str) -> tuple[str, ...]:
    """Return units, first the one that a field's name suggests."""
    own = expects_unit(name)
    return tuple(dict.fromkeys((*([own] if own else []), *sorted(set(QUANTITIES.values())))))


def command(uri: str, package: str, state: ServerState) -> dict[str, object] | None:
    """Return the command for a document, if the client can have its files edited."""
    if not state.supports("workspace", "applyEdit"):
        return None
    title = f"Declare {package} in package.xml"
    return {"title": title, "command": ADD_DEPENDENCY, "arguments": [uri, package]}


_KEYWORD, _MODULE, _STRUCT, _VALUE, _UNIT, _FIELD, _SNIPPET = 14, 9, 22, 12, 11, 5, 15
_AGAIN: dict[str, object] = {"title": "types", "command": "editor.action.triggerSuggest"}
#: Types of any package that one word may mean; more letters leave fewer.
MOST = 200


class Item(Part, frozen=True):
    """A completion item."""

    label: str
    kind: int
    text_edit: TextEdit
    detail: str = ""
    sort_text: str = ""
    filter_text: str = ""
    command: dict[str, object] | None = None
    #: Which type `resolve` describes: the document, and the type's package and name.
    data: tuple[str, str, str] | None = None


class Items(Part, frozen=True, omit_defaults=False):
    """All completions at a position; more letters may show others."""

    is_incomplete: bool
    items: tuple[Item, ...]


class TypedLine(NamedTuple):
    """The beginning of a line, and its place.

    `undeclared` is whether package.xml lacks each of the packages that were looked up so far.
    """

    document: Document
    path: Path
    workspace: Workspace
    line: int
    before: str
    encoding: str
    undeclared: dict[str, bool]

    def lacks(self, package: str) -> bool:
        """Return whether package.xml could declare a package, and does not."""
        if package not in self.undeclared:
            edit = self.workspace.dependency(self.path, package)
            self.undeclared[package] = edit is not None
        return self.undeclared[package]

    def after(self, start: int) -> str:
        """Return the text that was typed after a position in the line."""
        places = accumulate(
            (units(character, self.encoding) for character in self.before), initial=0
        )
        return self.before[list(places).index(start) :]

    def replacing(self, length: int, text: str) -> TextEdit:
        """Return the edit that puts a text in the place of the last characters."""
        end = units(self.before, self.encoding)
        start = end - units(self.before[len(self.before) - length :], self.encoding)
        return TextEdit(Range(Position(self.line, start), Position(self.line, end)), text)


def complete(state: ServerState, params: PositionParams) -> Items:
    """Return the completions at a position."""
    document = state.documents.get(params.text_document.uri)
    path = document.path if document else None
    workspace = state.workspace_of(path) if path else None
    if document is None or path is None or workspace is None:
        return Items(False, ())
    lines = lines_of(document.text)
    line, at = in_lines(lines, params.position, state.encoding)
    typed = TypedLine(document, path, workspace, line, lines[line][:at], state.encoding, {})
    items = tuple(_items(typed, state))
    starts = {item.text_edit.range.start.character for item in items}
    words = {start: typed.after(start).lower() for start in starts}
    return Items(len(items) >= MOST, tuple(item for item in items if _fits(item, words)))


def resolve(state: ServerState, item: dict[str, object]) -> dict[str, object]:
    """Return an item with the text of its type as documentation, if it completes a type."""
    match item.get("data"):
        case [str(uri), str(package), str(name)] if context := state.context(uri):
            source = context.snapshot.source(ir.TypeName(package, "msg", name))
            lines = source.text.splitlines() if source else []
            return {**item, "documentation": Markup(code(shortened(lines)))} if lines else item
        case _:
            return item


def _fits(item: Item, words: Mapping[int, str]) -> bool:
    """Return whether an item has the letters of the text that it replaces, in their order.

    Not all editors filter items themselves.
    """
    letters = iter((item.filter_text or item.label).lower())
    return all(letter in letters for letter in words[item.text_edit.range.start.character])


def _items(typed: TypedLine, state: ServerState) -> Iterator[Item]:
    code, sign, comment = typed.before.partition("#")
    words = code.removeprefix("@optional").lstrip().split(maxsplit=2)
    if sign:
        yield from _in_comment(typed, comment, words)
    elif not words or (len(words) == 1 and not code.endswith((" ", "\t"))):
        yield from _types(typed, words[0] if words else "", state)
    elif "=" in code and re.fullmatch(r"\S+\s+[A-Z]\w*\s*=.*", code.lstrip()):
        word = code.partition("=")[2].lstrip()
        if "[" not in words[0] and ("<=" not in words[0] or "=" in words[-1]):
            yield from _values(typed, words[0], word, "")
    elif len(words) == 1 or (len(words) == 2 and not code.endswith((" ", "\t"))):
        yield from _names(typed, words[0], words[1] if len(words) == 2 else "")
    else:
        yield from _values(typed, words[0], words[2] if len(words) == 3 else "", words[1])


def _types(typed: TypedLine, word: str, state: ServerState) -> Iterator[Item]:
    """Yield completions of the first word of a line."""
    if bound := re.fullmatch(r"\S*(?:<=|\[)(\d*)", word):
        for size in BOUNDS:
            yield Item(size, _VALUE, typed.replacing(len(bound[1]), size))
        return
    if word and not (word[0].isalpha() and word.isascii()):
        return
    package, slash, _ = word.partition("/")
    workspace = typed.workspace
    if slash:
        for message in workspace.names(package):
            yield _type(typed, word, f"{package}/{message}", package, "0", state)
        return
    name = workspace.name_of(typed.path)
    own = name.package
    for type_ in (*ir.PRIMITIVES, *STRINGS):
        size = counted(ir.PRIMITIVES[type_].size, "byte") if type_ in ir.PRIMITIVES else "text"
        yield Item(type_, _KEYWORD, typed.replacing(len(word), type_), size, f"1{type_}")
    for message in workspace.names(own):
        if name != (own, "msg", message):
            yield _type(typed, word, message, own, "0", state)
    for other in workspace.packages():
        edit = typed.replacing(len(word), f"{other}/")
        yield Item(f"{other}/", _MODULE, edit, sort_text=f"3{other}", command=_AGAIN)
    if word:
        yield from _elsewhere(typed, word, own, state)
    if not typed.before and name.kind != "msg":
        yield Item("---", _SNIPPET, typed.replacing(len(word), "---\n"), "the next section", "4")


def _elsewhere(typed: TypedLine, word: str, own: str, state: ServerState) -> Iterator[Item]:
    """Yield messages of other packages by their names alone."""
    count = 0
    for package in typed.workspace.packages():
        for name in typed.workspace.names(package) if package != own else ():
            if name.lower().startswith(word.lower()):
                yield _type(typed, word, f"{package}/{name}", package, "2", state, name)
                count += 1
        if count >= MOST:
            return


def _type(
    typed: TypedLine,
    word: str,
    text: str,
    package: str,
    rank: str,
    state: ServerState,
    looked_for: str = "",
) -> Item:
    """Return a message; if its package is not declared yet, package.xml is edited afterwards."""
    missing = state.supports("workspace", "applyEdit") and typed.lacks(package)
    return Item(
        text,
        _STRUCT,
        typed.replacing(len(word), text),
        sort_text=rank + text,
        filter_text=looked_for,
        detail=package,
        command=command(typed.document.uri, package, state) if missing else None,
        data=(typed.document.uri, package, text.rpartition("/")[2]),
    )


def _names(typed: TypedLine, type_: str, word: str) -> Iterator[Item]:
    """Yield usual names for a field of a type."""
    if "/" in type_ or type_[:1].isupper():
        name = suggested_field_name(type_)
        yield Item(name, _FIELD, typed.replacing(len(word), name))


def _values(typed: TypedLine, type_: str, word: str, name: str) -> Iterator[Item]:
    """Yield values that fit a type, the constants of the section for a field first."""
    lines = lines_of(typed.document.text)
    constants = suggested_constants(lines, typed.line, type_) if name else ()
    for constant, value in constants:
        edit = typed.replacing(len(word), value)
        yield Item(constant, _VALUE, edit, value, f"0{constant}", f"{value} {constant}")
    for number, value in enumerate(suggested_values(type_)):
        yield Item(value, _VALUE, typed.replacing(len(word), value), sort_text=f"1{number}")


def _in_comment(typed: TypedLine, comment: str, words: list[str]) -> Iterator[Item]:
    if ignored := re.search(r"idlc:\s*ignore[\[(]\s*([\w, ]*)$", comment):
        word = ignored[1].rpartition(",")[2].strip()
        for code in CODES.values():
            if code.severity is Severity.WARNING:
                yield Item(code.id, _VALUE, typed.replacing(len(word), code.id), code.slug)
    elif bracket := re.search(r"\[([^\[\]]*)$", comment):
        name = words[1] if len(words) > 1 else ""
        for number, unit in enumerate(units_for(name)):
            edit = typed.replacing(len(bracket[1]), unit)
            yield Item(unit, _UNIT, edit, sort_text=f"{number:03}")
