"""The arguments of setup() in a setup.py, as far as its syntax shows; nothing is imported or run.

A value is known only if all of it is: literals, names that are assigned once, sums, f-strings
and plain `%s` and `{}`. Lists may grow by `append`, `extend` and `+=`. Nothing else is guessed.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from functools import cached_property, lru_cache
from typing import NamedTuple

from idlc.diagnostics.source import Source, Span

BOM = "\ufeff"


@lru_cache(maxsize=256)
def parse(text: str) -> ast.Module | None:
    """Return the syntax of a file; `None` if it is not Python."""
    try:
        return ast.parse(text.removeprefix(BOM))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


@lru_cache(maxsize=16)
def _lines(text: str) -> tuple[list[int], list[bytes]]:
    """Return the offsets of Python's lines, and these lines as bytes, which ast counts."""
    starts = [0, *(line_end.end() for line_end in re.finditer(r"\r\n?|\n", text))]
    ends = [*starts[1:], len(text)]
    ranges = zip(starts, ends, strict=True)
    return starts, [text[start:end].encode("utf-8", "replace") for start, end in ranges]


def range_of(source: Source, node: ast.AST) -> tuple[int, int]:
    """Return the range of a node, in characters."""
    starts, lines = _lines(source.text)

    def offset(line: int, column: int) -> int:
        at = min(line, len(starts)) - 1
        mark = len(BOM) if at == 0 and source.text.startswith(BOM) else 0
        if lines[at].isascii():
            return starts[at] + column
        before = lines[at][: column + mark * len(BOM.encode())].decode("utf-8", "ignore")
        return starts[at] + len(before)

    line, column = getattr(node, "lineno", 1), getattr(node, "col_offset", 0)
    end_line, end = getattr(node, "end_lineno", None), getattr(node, "end_col_offset", None)
    return offset(line, column), offset(end_line or line, end or column)


def start_of(source: Source, node: ast.AST) -> int:
    """Return the start of a node, in characters."""
    return range_of(source, node)[0]


def span_of(source: Source, node: ast.AST) -> Span:
    """Return the range of a node, to the end of its first line at most."""
    start, end = range_of(source, node)
    first = re.match(r"[^\r\n]*", source.text[start:end])
    return Span(source, start, start + max(first.end() if first else 0, 1))


def imported_modules(source: Source) -> Iterator[tuple[str, ast.AST]]:
    """Yield the module of each absolute import, with its node."""
    tree = parse(source.text)
    for node in ast.walk(tree) if tree else ():
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, alias
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            yield node.module, node


def defines(source: Source, name: str) -> bool:
    """Return whether a file may define a name at its top level."""
    tree = parse(source.text)
    if tree is None:
        return True
    for node in tree.body:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            names = [node.name]
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            names = [alias.asname or alias.name for alias in node.names]
        elif isinstance(node, (ast.If, ast.Try, ast.With)):
            return True
        else:
            names = [part.id for part in ast.walk(node) if isinstance(part, ast.Name)]
        if name in names or "*" in names:
            return True
    return False


#: No text or list of a setup.py is longer than this; sums of names could double at each line.
_MOST = 2000
#: Sums and names are followed to this depth.
_DEPTH = 50
_GROWING = frozenset({"append", "extend", "insert"})


class ListPart(NamedTuple):
    """A part of a list: an element, or an expression for any number of elements."""

    node: ast.expr
    is_element: bool


class DataFiles(NamedTuple):
    """An entry of data_files: its folder in the prefix, and its files or patterns.

    Computed values are `None`.
    """

    node: ast.expr
    folder: str | None
    files: tuple[str, ...] | None


class Setup:
    """The call of setup() in a file and the values of its arguments.

    `arguments` are empty without exactly one such call; `whole`: there are no unseen arguments.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.tree = parse(source.text) or ast.Module([], [])
        self.nodes = list(ast.walk(self.tree))
        self.calls = [*self.calls_of("setup")]
        self.call = self.calls[0] if len(self.calls) == 1 else None
        self.arguments: dict[str, ast.expr] = {}
        self._texts: dict[str, str | None] = {}
        self._lists: dict[str, list[ListPart]] = {}
        self.whole = self.call is not None and not self.call.args
        for keyword in self.call.keywords if self.call else ():
            if keyword.arg:
                self.arguments[keyword.arg] = keyword.value
            else:
                items = self.pairs(keyword.value)
                self.whole &= items is not None
                self.arguments |= items or {}

    def calls_of(self, function: str) -> Iterator[ast.Call]:
        """Yield the calls of a function, by any name that it is imported as."""
        aliases = (node for node in self.nodes if isinstance(node, ast.alias))
        names = {function, *(node.asname for node in aliases if node.name == function)}
        for node in self.nodes:
            if isinstance(node, ast.Call) and name_of_call(node) in names:
                yield node

    @cached_property
    def _parents(self) -> dict[int, ast.AST]:
        return {id(child): node for node in self.nodes for child in ast.iter_child_nodes(node)}

    @cached_property
    def _bound(self) -> dict[str, list[ast.expr | None]]:
        """The values that are assigned to each name; `None` for any other definition."""
        bound: dict[str, list[ast.expr | None]] = {}
        plain: dict[int, ast.expr] = {}
        added: set[int] = set()
        for node in self.nodes:
            match node:
                case ast.AnnAssign(target=target, value=ast.expr() as value):
                    plain[id(target)] = value
                case ast.Assign(targets=targets, value=value):
                    plain |= {id(target): value for target in targets}
                case ast.AugAssign(target=target):
                    added.add(id(target))
                case ast.Name(ctx=ast.Store() | ast.Del()) if id(node) not in added:
                    bound.setdefault(node.id, []).append(plain.get(id(node)))
            for name in _names_bound(node):
                bound.setdefault(name, []).append(None)
        return bound

    @cached_property
    def _grown(self) -> dict[str, list[ListPart]]:
        """The items that are added to a name's list after its assignment."""
        grown: dict[str, list[ListPart]] = {}
        for node in self.nodes:
            if isinstance(node, ast.Call) and (name := _grows(node)):
                is_element = getattr(node.func, "attr", "") != "extend"
                grown.setdefault(name, []).extend(
                    ListPart(arg, is_element) for arg in node.args[-1:]
                )
            elif isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
                grown.setdefault(node.target.id, []).append(ListPart(node.value, False))
        return grown

    @cached_property
    def _shared(self) -> set[str]:
        """The names of lists and dictionaries that other code may change."""
        names = (node for node in self.nodes if isinstance(node, ast.Name))
        reads = (name for name in names if isinstance(name.ctx, ast.Load))
        return {name.id for name in reads if not self._is_harmless(name)}

    def _is_harmless(self, node: ast.Name) -> bool:
        """Return whether a use of a name only reads it, or adds to it in a known way."""
        parent = self._parents.get(id(node))
        if isinstance(parent, ast.Attribute):
            call = self._parents.get(id(parent))
            return isinstance(call, ast.Call) and _grows(call) == node.id
        if isinstance(parent, ast.Call):
            return name_of_call(parent) in ("glob", "join", "len", "sorted", "find_packages")
        operations = (ast.BinOp, ast.Compare, ast.AugAssign, ast.FormattedValue, ast.For)
        displays = (ast.List, ast.Tuple, ast.Dict, ast.Starred, ast.keyword)
        return isinstance(parent, (*operations, *displays))

    def value(self, node: ast.expr | None) -> ast.expr | None:
        """Return the value of a name that is assigned once; any other expression unchanged."""
        for _ in range(_DEPTH):
            if not isinstance(node, ast.Name):
                return node
            values = self._bound.get(node.id, [])
            node = values[0] if len(values) == 1 else None
        return None

    def text(self, node: ast.expr | None, depth: int = 0) -> str | None:
        """Return the text of an expression, `None` if it is computed."""
        if depth > _DEPTH:
            return None
        text: str | None = None
        if isinstance(node, ast.Name):
            if node.id not in self._texts:
                self._texts[node.id] = None  # for one that is defined by itself
                value = node.id not in self._grown and self.value(node)
                self._texts[node.id] = self.text(value, depth + 1) if value else None
            return self._texts[node.id]
        match node:
            case ast.Constant(value=str(literal)):
                text = literal
            case ast.BinOp(op=ast.Add()):
                text = self._joined("", (node.left, node.right), depth)
            case ast.BinOp(op=ast.Mod(), right=ast.Tuple(elts=values)):
                text = self._filled("%s", node.left, values, depth)
            case ast.BinOp(op=ast.Mod()):
                text = self._filled("%s", node.left, (node.right,), depth)
            case ast.JoinedStr():
                text = self._joined("", node.values, depth)
            case ast.FormattedValue(conversion=-1, format_spec=None):
                text = self.text(node.value, depth + 1)
            case ast.Call(func=ast.Attribute(pattern, "format"), args=values, keywords=[]):
                text = self._filled("{}", pattern, values, depth)
            case ast.Call(keywords=[]) if name_of_call(node) == "join" and _is_of_paths(node.func):
                text = self._joined("/", node.args, depth)
        return text if text is not None and len(text) <= _MOST else None

    def _joined(self, between: str, nodes: Iterable[ast.expr], depth: int) -> str | None:
        texts = [self.text(node, depth + 1) for node in nodes]
        return None if None in texts else between.join(text for text in texts if text is not None)

    def _filled(
        self, mark: str, node: ast.expr, values: Iterable[ast.expr], depth: int
    ) -> str | None:
        """Return a text with values at its marks, `%s` or `{}`, if it has no other marks."""
        parts = (self.text(node, depth + 1) or mark[0]).split(mark)
        texts = [self.text(value, depth + 1) for value in values]
        if None in texts or len(texts) != len(parts) - 1 or mark[0] in "".join(parts):
            return None
        pairs = zip(texts, parts[1:], strict=True)
        return parts[0] + "".join((text or "") + part for text, part in pairs)

    def items(self, node: ast.expr | None, depth: int = 0) -> list[ListPart]:
        """Return the parts of a list; parts that cannot be taken apart are no elements."""
        if node is None:
            return []
        if isinstance(node, ast.Name) and depth <= _DEPTH:
            if node.id not in self._lists:
                self._lists[node.id] = [ListPart(node, False)]
                self._lists[node.id] = self._named_items(node, depth + 1)
            return self._lists[node.id]
        items: list[ListPart] = []
        if isinstance(node, (ast.List, ast.Tuple)) and depth <= _DEPTH:
            for element in node.elts:
                if isinstance(element, ast.Starred):
                    items += self.items(element.value, depth + 1)
                else:
                    items.append(ListPart(element, True))
                if len(items) > _MOST:
                    break
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add) and depth <= _DEPTH:
            items = self.items(node.left, depth + 1) + self.items(node.right, depth + 1)
        else:
            items = [ListPart(node, False)]
        return items if len(items) <= _MOST else [ListPart(node, False)]

    def _named_items(self, node: ast.Name, depth: int) -> list[ListPart]:
        value = self.value(node)
        if value is None or node.id in self._shared:
            return [ListPart(node, False)]
        items = list(self.items(value, depth))
        for item in self._grown.get(node.id, ()):
            items += [item] if item.is_element else self.items(item.node, depth)
            if len(items) > _MOST:
                break
        return items if len(items) <= _MOST else [ListPart(node, False)]

    def texts(self, node: ast.expr | None) -> list[str | None]:
        """Return the texts in a list, `None` for each part that is computed."""
        return [self.text(item.node) if item.is_element else None for item in self.items(node)]

    def pairs(self, node: ast.expr | None) -> dict[str, ast.expr] | None:
        """Return the values of a dictionary by key, `None` if any of it is computed."""
        shared = isinstance(node, ast.Name) and node.id in self._shared
        value = self.value(node)
        if isinstance(value, ast.Call) and name_of_call(value) == "dict" and not value.args:
            values = {keyword.arg: keyword.value for keyword in value.keywords}
        elif isinstance(value, ast.Dict):
            keys = [self.text(key) for key in value.keys]
            values = dict(zip(keys, value.values, strict=True))
        else:
            return None
        named = {key: item for key, item in values.items() if key is not None}
        return None if shared or len(named) < len(values) else named

    def list_of(self, argument: str) -> ast.List | None:
        """Return the list to which an argument's elements can be added."""
        node = self.arguments.get(argument)
        if isinstance(node, ast.Name) and node.id in self._shared:
            return None
        value = self.value(node)
        while isinstance(value, ast.BinOp) and isinstance(value.op, ast.Add):
            value = self.value(value.left)
        return value if isinstance(value, ast.List) else None

    def place(self, argument: str) -> Span:
        """Return the range of an argument of setup(), or of the call."""
        node: ast.AST | None = self.arguments.get(argument, self.call)
        listed = self.list_of(argument)
        if listed is not None and listed.elts:
            node = listed.elts[0]
        return span_of(self.source, node) if node else Span(self.source, 0, 0)

    @cached_property
    def data_files(self) -> tuple[DataFiles, ...] | None:
        """The entries of data_files; `None` if they are computed."""
        if "data_files" not in self.arguments:
            # setup.cfg or pyproject.toml may have them instead of setup()
            return () if self.whole and "packages" in self.arguments else None
        items = self.items(self.arguments["data_files"])
        if not all(item.is_element for item in items):
            return None
        entries = []
        for item in items:
            match self.value(item.node):
                case ast.Tuple(elts=[folder, files]) | ast.List(elts=[folder, files]):
                    entries.append(DataFiles(folder, self.text(folder), self._files(files)))
                case _:
                    is_file = self.text(item.node) is not None
                    entries.append(DataFiles(item.node, "" if is_file else None, None))
        return tuple(entries)

    def _files(self, node: ast.expr) -> tuple[str, ...] | None:
        """Return the files and patterns in a list of data_files; `None` if some are computed."""
        files: list[str] = []
        for item in self.items(node):
            call = self.value(item.node)
            text, inner = None, None
            if item.is_element:
                text = self.text(item.node)
            elif isinstance(call, ast.Call) and call.args:
                if name_of_call(call) in ("sorted", "list"):
                    inner = self._files(call.args[0])
                elif name_of_call(call) in ("glob", "iglob"):
                    text = self.text(call.args[0])
            inner = inner if text is None else (text,)
            if inner is None:
                return None
            files += inner
        return tuple(files)

    @property
    def scripts(self) -> Iterator[tuple[str, ast.expr]]:
        """The console scripts that are not computed, with their expressions."""
        groups = self.pairs(self.arguments.get("entry_points")) or {}
        for item in self.items(groups.get("console_scripts")):
            text = self.text(item.node) if item.is_element else None
            if text is not None:
                yield text, item.node


def name_of_call(node: ast.AST | None) -> str:
    """Return the last part of the name of a called function; empty for any other node."""
    function = node.func if isinstance(node, ast.Call) else None
    return function.id if isinstance(function, ast.Name) else getattr(function, "attr", "")


def _is_of_paths(function: ast.expr) -> bool:
    """Return whether a `join` is os.path's, and not the method of a text."""
    of = getattr(function, "value", None)
    names = (getattr(of, "id", ""), getattr(of, "attr", ""))
    return isinstance(function, ast.Name) or "path" in names


def _grows(node: ast.Call) -> str:
    """Return the name of the list to which a call adds; empty if it does something else."""
    function = node.func
    if isinstance(function, ast.Attribute) and isinstance(function.value, ast.Name):
        return function.value.id if function.attr in _GROWING else ""
    return ""


def _names_bound(node: ast.AST) -> Iterator[str]:
    """Yield the names that a definition, an import or a parameter binds."""
    match node:
        case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
            yield node.name
        case ast.alias():
            yield node.asname or node.name.partition(".")[0]
        case ast.arg():
            yield node.arg
        case ast.Global() | ast.Nonlocal():
            yield from node.names
        case ast.ExceptHandler(name=str(name)):
            yield name
