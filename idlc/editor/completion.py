"""Completions of a line: types, names, values, units and codes.

Only the line and lists of names are read, so that completions arrive while the user types.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from idlc.check.manifest import dependency
from idlc.check.style import QUANTITIES, expects_unit
from idlc.diagnostics.codes import CODES
from idlc.diagnostics.report import Severity
from idlc.diagnostics.terminal import counted
from idlc.editor.descriptions import code, markdown
from idlc.editor.documents import Document, characters, in_lines, lines_of, units
from idlc.editor.elements import has_letters
from idlc.editor.parts import Position, PositionParams, ProtocolStruct, Range, TextEdit
from idlc.editor.protocol import ADD_DEPENDENCY
from idlc.editor.state import ServerState
from idlc.editor.workspace import Workspace
from idlc.language import tree
from idlc.language.definition import parse_definition
from idlc.model import ir, names
from idlc.model.comments import deprecation
from idlc.model.lowering.lower_types import STRINGS

#: Numbers that people take for bounds.
BOUNDS = ("1", "3", "6", "9", "16", "32", "36", "64", "128", "256", "1024")

#: Elements of the longest array of which a value is offered.
MOST_ELEMENTS = 36


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


def suggested_constants(lines: list[str], line: int, type_: str) -> Iterator[tuple[str, str, bool]]:
    """Yield the constants of a type in the section around a line.

    Each has its name and value, and is deprecated or not by the comment beside it.
    """
    ends = [number for number in range(line) if lines[number].rstrip("\r\n") == "---"]
    start = ends[-1] + 1 if ends else 0
    for text in lines[start:]:
        if text.rstrip("\r\n") == "---":
            return
        before, _, comment = text.partition("#")
        code = before.replace("\t", " ").rstrip()
        body = parse_definition(code) if "=" in code else None
        if isinstance(body, tree.Constant) and body.type.whole.text == type_ and body.value.text:
            is_deprecated = deprecation([comment]) is not None
            yield body.name.text, body.value.text, is_deprecated


_KEYWORD, _MODULE, _STRUCT, _VALUE, _UNIT, _FIELD, _SNIPPET = 14, 9, 22, 12, 11, 5, 15
_DEPRECATED = (1,)
_AGAIN: dict[str, object] = {"title": "types", "command": "editor.action.triggerSuggest"}
#: Types of any package that one word may mean; more letters leave fewer.
MOST = 200


class CompletionEntry(ProtocolStruct, frozen=True):
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
    tags: tuple[int, ...] = ()


class TypedLine(NamedTuple):
    """The beginning of a line, and its place.

    `undeclared` is whether package.xml lacks each of the packages that were looked up so far.
    """

    state: ServerState
    document: Document
    path: Path
    workspace: Workspace
    lines: list[str]
    line: int
    before: str
    undeclared: dict[str, bool]

    def lacks(self, package: str) -> bool:
        """Return whether package.xml could declare a package, and does not."""
        if package not in self.undeclared:
            facts = self.workspace.facts(self.path)
            edit = dependency(facts, package) if facts else None
            self.undeclared[package] = edit is not None
        return self.undeclared[package]

    def replacing(self, length: int, text: str) -> TextEdit:
        """Return the edit that puts a text in the place of the last characters."""
        encoding = self.state.encoding
        start = units(self.before[: len(self.before) - length], encoding)
        end = units(self.before, encoding)
        return TextEdit(Range(Position(self.line, start), Position(self.line, end)), text)


def complete(state: ServerState, params: PositionParams) -> dict[str, object]:
    """Return the completions at a position; more letters may show others."""
    document = state.documents.get(params.text_document.uri)
    path = document.path if document else None
    workspace = state.workspace_of(path) if path else None
    if document is None or path is None or workspace is None:
        return {"isIncomplete": False, "items": ()}
    lines = lines_of(document.text)
    line, at = in_lines(lines, params.position, state.encoding)
    typed = TypedLine(state, document, path, workspace, lines, line, lines[line][:at], {})
    items = list(_items(typed))
    # not all editors filter; all items replace the same word
    start = items[0].text_edit.range.start.character if items else 0
    word = typed.before[characters(typed.before, start, state.encoding) :]
    fitting = [item for item in items if has_letters(item.filter_text or item.label, word)]
    return {"isIncomplete": len(items) >= MOST, "items": fitting}


def resolve(state: ServerState, item: dict[str, object]) -> dict[str, object]:
    """Return an item with the text of its type as documentation, if it completes a type."""
    match item.get("data"):
        case [str(uri), str(package), str(name)] if context := state.context(uri):
            source = context.snapshot.source(ir.TypeName(package, "msg", name))
            if source and (lines := source.text.splitlines()):
                return {**item, "documentation": markdown([code(lines)])}
    return item


def _items(typed: TypedLine) -> Iterator[CompletionEntry]:
    code, sign, comment = typed.before.partition("#")
    words = code.removeprefix("@optional").lstrip().split(maxsplit=2)
    if sign:
        yield from _in_comment(typed, comment, words)
    elif not words or (len(words) == 1 and not code.endswith((" ", "\t"))):
        yield from _types(typed, words[0] if words else "")
    elif "=" in code and re.fullmatch(r"\S+\s+[A-Z]\w*\s*=.*", code.lstrip()):
        word = code.partition("=")[2].lstrip()
        if "[" not in words[0] and ("<=" not in words[0] or "=" in words[-1]):
            yield from _values(typed, words[0], word, "")
    elif len(words) == 1 or (len(words) == 2 and not code.endswith((" ", "\t"))):
        if "/" in words[0] or words[0][:1].isupper():  # the usual name for a field of it
            name = names.snake_case(words[0].rpartition("/")[2].partition("[")[0])
            word = words[1] if len(words) == 2 else ""
            yield CompletionEntry(name, _FIELD, typed.replacing(len(word), name))
    else:
        yield from _values(typed, words[0], words[2] if len(words) == 3 else "", words[1])


def _types(typed: TypedLine, word: str) -> Iterator[CompletionEntry]:
    """Yield completions of the first word of a line."""
    if bound := re.fullmatch(r"\S*(?:<=|\[)(\d*)", word):
        for size in BOUNDS:
            yield CompletionEntry(size, _VALUE, typed.replacing(len(bound[1]), size))
        return
    if word and not (word[0].isalpha() and word.isascii()):
        return
    package, slash, _ = word.partition("/")
    library = typed.workspace.library
    if slash:
        for message in library.names(package):
            yield _type(typed, word, f"{package}/{message}", package, "0")
        return
    inputs, file = typed.workspace.inputs(typed.path)
    own = inputs.package
    for type_ in (*ir.PRIMITIVES, *STRINGS):
        size = counted(ir.PRIMITIVES[type_].size, "byte") if type_ in ir.PRIMITIVES else "text"
        yield CompletionEntry(type_, _KEYWORD, typed.replacing(len(word), type_), size, f"1{type_}")
    for message in library.names(own):
        if (file.kind, file.name) != ("msg", message):
            yield _type(typed, word, message, own, "0")
    for other in filter(library.names, library.packages()):
        edit = typed.replacing(len(word), f"{other}/")
        yield CompletionEntry(f"{other}/", _MODULE, edit, sort_text=f"3{other}", command=_AGAIN)
    if word:
        yield from _elsewhere(typed, word, own)
    if not typed.before and file.kind != "msg":
        yield CompletionEntry(
            "---", _SNIPPET, typed.replacing(len(word), "---\n"), "the next section", "4"
        )


def _elsewhere(typed: TypedLine, word: str, own: str) -> Iterator[CompletionEntry]:
    """Yield messages of other packages by their names alone."""
    count = 0
    library = typed.workspace.library
    for package in library.packages():
        for name in library.names(package) if package != own else ():
            if name.lower().startswith(word.lower()):
                yield _type(typed, word, f"{package}/{name}", package, "2", name)
                count += 1
        if count >= MOST:
            return


def _type(
    typed: TypedLine, word: str, text: str, package: str, rank: str, looked_for: str = ""
) -> CompletionEntry:
    """Return a message; if its package is not declared yet, package.xml is edited afterwards."""
    uri = typed.document.uri
    command: dict[str, object] | None = None
    if typed.state.supports("workspace", "applyEdit") and typed.lacks(package):
        title = f"Declare {package} in package.xml"
        command = {"title": title, "command": ADD_DEPENDENCY, "arguments": [uri, package]}
    return CompletionEntry(
        text,
        _STRUCT,
        typed.replacing(len(word), text),
        sort_text=rank + text,
        filter_text=looked_for,
        detail=package,
        command=command,
        data=(uri, package, text.rpartition("/")[2]),
    )


def _values(typed: TypedLine, type_: str, word: str, name: str) -> Iterator[CompletionEntry]:
    """Yield values that fit a type, the constants of the section for a field first."""
    constants = suggested_constants(typed.lines, typed.line, type_) if name else ()
    for constant, value, is_deprecated in constants:
        edit, tags = typed.replacing(len(word), value), _DEPRECATED if is_deprecated else ()
        sort, filtered = f"0{constant}", f"{value} {constant}"
        yield CompletionEntry(constant, _VALUE, edit, value, sort, filtered, tags=tags)
    for number, value in enumerate(suggested_values(type_)):
        yield CompletionEntry(
            value, _VALUE, typed.replacing(len(word), value), sort_text=f"1{number}"
        )


def _in_comment(typed: TypedLine, comment: str, words: list[str]) -> Iterator[CompletionEntry]:
    if ignored := re.search(r"idlc:\s*ignore[\[(]\s*([\w, ]*)$", comment):
        word = ignored[1].rpartition(",")[2].strip()
        for code in CODES.values():
            if code.severity is Severity.WARNING:
                yield CompletionEntry(
                    code.id, _VALUE, typed.replacing(len(word), code.id), code.slug
                )
    elif bracket := re.search(r"\[([^\[\]]*)$", comment):
        name = words[1] if len(words) > 1 else ""
        own = expects_unit(name)  # comes first
        others = sorted(set(QUANTITIES.values()))
        for number, unit in enumerate(dict.fromkeys((*([own] if own else []), *others))):
            edit = typed.replacing(len(bracket[1]), unit)
            yield CompletionEntry(unit, _UNIT, edit, sort_text=f"{number:03}")
