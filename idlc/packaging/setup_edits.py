"""Edits of a setup.py: elements for a list, an argument for setup(), an import.

Everything added follows the style of its neighbours: quotes, indentation, line ends.
"""

from __future__ import annotations

import ast
import re
import sys
import tokenize
from collections.abc import Iterator, Sequence
from itertools import accumulate, takewhile
from typing import TypeAlias

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit
from idlc.diagnostics.source import Source, Span
from idlc.packaging.setup_py import BOM, Setup, parse, range_of, span_of, start_of
from idlc.project.lock import BUILD_STEP

#: The widest line that the linters of ROS 2 accept, and that ruff's formatter leaves as it is.
WIDTH, _WIDTH_OF_RUFF = 99, 88


def insertion(source: Source, at: int, text: str) -> Edit:
    """Return the edit that inserts a text, with the line ends of the file."""
    return Edit(Span(source, at, at), text.replace("\n", line_end(source)))


def line_end(source: Source) -> str:
    """Return the line end of a file."""
    match = re.search(r"\r\n?|\n", source.text)
    return match[0] if match else "\n"


def indent_of(source: Source, at: int) -> str:
    """Return the whitespace before the first word of a line."""
    start = max(source.text.rfind("\n", 0, at), source.text.rfind("\r", 0, at)) + 1
    match = re.compile(r"[ \t]*").match(source.text, start)
    return match[0] if match else ""


def step_of(source: Source) -> str:
    """Return one step of indentation: a tab where lines begin with tabs."""
    return "\t" if re.search(r"^\t", source.text, re.MULTILINE) else "    "


def quote_of(source: Source, node: ast.AST) -> str:
    """Return the quote of the first literal in an expression."""
    start, end = range_of(source, node)
    match = re.search("['\"]", source.text[start:end])
    return match[0] if match else "'"


Brackets: TypeAlias = ast.List | ast.Tuple | ast.Dict | ast.Call


def append_elements(source: Source, node: Brackets, elements: Sequence[str]) -> tuple[Edit, ...]:
    """Return the edits that give brackets more elements, written with single quotes."""
    begin, end = _range(source, node)
    quote = quote_of(source, node)
    new = [element.replace("'", quote) for element in elements]
    ranges = [range_of(source, element) for element in elements_of(node)]
    last = ranges[-1][1] if ranges else begin + 1
    after, comma = _behind(source.text[last : end - 1])
    last += after
    margin = margin_of(source, node)
    tail = re.search(r"(?:\r\n?|\n)[ \t]*\Z", source.text[last : end - 1])
    if tail is None:
        hangs = any(_begins_line(source, start) for start, _ in ranges)
        between = f",\n{margin}" if hangs else ", "
        before, behind = between, ""
        if comma:
            before, behind = between[1:], ","
        elif not ranges:
            before, behind = "", ", "
        return (insertion(source, last, before + between.join(new) + behind),)
    lines = "".join(f"\n{margin}{element}," for element in new)
    edits = () if comma or not ranges else (insertion(source, last, ","),)
    return (*edits, insertion(source, last + tail.start(), lines))


def append_element(source: Source, node: Brackets, element: str) -> tuple[Edit, ...]:
    """Return the edits that give brackets one element more, and no other edit adds one."""
    if elements_of(node) or is_spread(source, node):
        return append_elements(source, node, [element])
    comma = "," * isinstance(node, ast.Tuple)
    return (insertion(source, range_of(source, node)[1] - 1, element + comma),)


def elements_of(node: Brackets) -> list[ast.expr | ast.keyword]:
    """Return what is in brackets, in order: of a dictionary its values."""
    if isinstance(node, ast.Dict):
        return [*node.values]
    if isinstance(node, ast.Call):
        arguments: list[ast.expr | ast.keyword] = [*node.args, *node.keywords]
        return sorted(arguments, key=lambda passed: (passed.lineno, passed.col_offset))
    return [*node.elts]


def margin_of(source: Source, node: Brackets) -> str:
    """Return the indentation of elements with a line of their own."""
    starts = [start_of(source, key) for key in getattr(node, "keys", elements_of(node)) if key]
    margins = [indent_of(source, at) for at in starts if _begins_line(source, at)]
    if margins:
        return margins[-1]
    step = step_of(source) * is_spread(source, node)
    return indent_of(source, range_of(source, node)[1] - 1) + step


def is_spread(source: Source, node: Brackets) -> bool:
    """Return whether the closing bracket has a line of its own."""
    return _begins_line(source, range_of(source, node)[1] - 1)


def _range(source: Source, node: Brackets) -> tuple[int, int]:
    """Return the range of brackets and what is in them."""
    start, end = range_of(source, node)
    if isinstance(node, ast.Call):
        start = source.text.index("(", range_of(source, node.func)[1])
    return start, end


def _begins_line(source: Source, at: int) -> bool:
    return source.text[:at].endswith(("\n" + indent_of(source, at), "\r" + indent_of(source, at)))


def _behind(text: str) -> tuple[int, bool]:
    """Return the length of the text behind an element that belongs to it; does a comma follow."""
    lines = re.findall(r"[^\r\n]*(?:\r\n?|\n)|[^\r\n]+", f"({text}")
    starts = [length - 1 for length in accumulate(map(len, lines), initial=0)]
    length = 0
    try:
        for token in tokenize.generate_tokens(iter([*lines, ""]).__next__):
            at = starts[min(token.end[0], len(starts)) - 1] + token.end[1]
            if token.string == ",":
                return at, True
            if token.string == ")":
                length = at
    except (tokenize.TokenError, SyntaxError):
        pass  # it ends within the bracket
    return length, False


def argument(setup: Setup, text: str) -> tuple[Edit, ...]:
    """Return the edit that adds an argument to setup(), in the layout of its first one."""
    call, source = setup.call, setup.source
    if call is None or call.args or not call.keywords:
        return ()
    at = start_of(source, call.keywords[0])
    spread = call.keywords[0].lineno > call.lineno
    between = "\n" + indent_of(source, at) if spread else " "
    return (insertion(source, at, f"{text},{between}"),)


def imported(setup: Setup, module: str, name: str) -> tuple[str, tuple[Edit, ...]]:
    """Return the name of a module's function in a file, and the edit that imports it if needed."""
    imports = [node for node in setup.nodes if isinstance(node, (ast.Import, ast.ImportFrom))]
    for node in imports:
        for alias in node.names:
            if isinstance(node, ast.ImportFrom):
                if node.module == module and alias.name in (name, "*"):
                    return alias.asname or name, ()
            elif alias.name == module:
                return f"{alias.asname or module}.{name}", ()
    source = setup.source
    for node in imports:
        if isinstance(node, ast.ImportFrom) and node.module == module and node.col_offset == 0:
            return name, (added_name(source, node, name),)
    body = setup.tree.body
    first = next((node for node in body if node in imports), body[0])
    if isinstance(first, ast.ImportFrom) and first.module == "__future__":
        first = body[body.index(first) + 1]
    line = f"from {module} import {name}\n"
    return name, (insertion(source, start_of(source, first), line),)


def added_name(source: Source, node: ast.ImportFrom, name: str) -> Edit:
    """Return the edit that imports another name, before the first that follows it in order."""
    after = next((alias for alias in node.names if alias.name.lower() > name.lower()), None)
    if after is None:
        return insertion(source, range_of(source, node.names[-1])[1], f", {name}")
    return insertion(source, start_of(source, after), f"{name}, ")


#: How many lists are tried; each costs as much as reading the file.
_TRIES = 40
_LINE_END = re.compile(r"\r\n?|\n")


def arrange(old: str, new: str) -> str:
    """Return an edited file as formatters leave it: imports in order, lists in lines of their own.

    Lines that `old` has stay as they are.
    """
    mark = BOM * new.startswith(BOM)
    old, new = old.removeprefix(BOM), new.removeprefix(BOM)
    return mark + _wrap_lines(old, _sort_imports(old, new))


_IMPORT = re.compile(r"from (\w+)[\w.]* import \w+\s*")
_FORMS = (ast.Import, ast.ImportFrom)
_STANDARD = sys.stdlib_module_names
_LINE = re.compile(r"[^\r\n]*(?:\r\n?|\n)|[^\r\n]+")


def _sort_imports(old: str, new: str) -> str:
    """Return an edited file with new imports of the standard library in their order."""
    before = frozenset(_LINE_END.split(old))
    lines = _LINE.findall(new)
    changed = [line for line in lines if line.rstrip("\r\n") not in before]
    added = [line for line in changed if _imports_standard(line)]
    rest = [line for line in lines if line not in added]
    tree = parse("".join(rest)) if added else None
    nodes = (node for node in tree.body if isinstance(node, _FORMS)) if tree else ()
    imports = [node for node in nodes if _module(node) != "__future__"]
    if not imports:
        return new
    _insert_imports(rest, imports, sorted(added), line_end(Source("", new)))
    return "".join(rest)


def _insert_imports(
    lines: list[str], imports: Sequence[ast.Import | ast.ImportFrom], added: list[str], end: str
) -> None:
    """Insert sorted imports of the standard library into lines that have others."""
    block = [*takewhile(lambda node: _module(node).partition(".")[0] in _STANDARD, imports)]
    if not block:
        first = imports[0].lineno - 1
        lines[first:first] = [*added, end]
        return
    plain = [*takewhile(lambda node: isinstance(node, ast.Import), block)]
    rivals = block[len(plain) :]
    if any(isinstance(node, ast.Import) for node in rivals):
        rivals = block  # the linters of ROS 2 sort both forms of imports together
    for line in reversed(added):
        name = line.split()[1]
        later = (node.lineno - 1 for node in rivals if _module(node) > name)
        lines.insert(next(later, block[-1].end_lineno or 0), line)


def _imports_standard(line: str) -> bool:
    match = _IMPORT.fullmatch(line)
    return match is not None and match[1] in _STANDARD


def _module(node: ast.Import | ast.ImportFrom) -> str:
    return node.module or "" if isinstance(node, ast.ImportFrom) else node.names[0].name


def _wrap_lines(old: str, new: str) -> str:
    before = frozenset(_LINE_END.split(old))
    refused: set[str] = set()
    for _ in range(_TRIES):
        lines = enumerate(_LINE_END.split(new), 1)
        wide = {at for at, line in lines if len(line) > _WIDTH_OF_RUFF and line not in before}
        tree = parse(new) if wide else None
        nodes = ast.walk(tree) if tree else ()
        texts = (_spread(new, node, wide, refused) for node in nodes)
        text = next(filter(None, texts), None)
        if tree is None or text is None:
            break
        # the tree has neither parentheses around items nor text that may follow a generator
        if _same(tree, parse(text)):
            new = text
        else:
            refused.add(text)
    return new


def _same(before: ast.Module, after: ast.Module | None) -> bool:
    try:
        return after is not None and ast.dump(before) == ast.dump(after)
    except RecursionError:
        return False


def _spread(text: str, node: ast.AST, wide: set[int], refused: set[str]) -> str | None:
    """Return the text with each item of a node on its own line, if the node's line is too wide."""
    if not isinstance(node, (ast.List, ast.Tuple, ast.Dict, ast.Call)):
        return None
    if node.lineno not in wide or node.lineno != node.end_lineno:
        return None
    source = Source("", text)
    start, end = _range(source, node)

    def code(item: ast.AST) -> str:
        return text[slice(*range_of(source, item))]

    if isinstance(node, ast.Dict):
        pairs = zip(node.keys, node.values, strict=True)
        items = [(f"{code(key)}: " if key else "**") + code(value) for key, value in pairs]
    else:
        items = [code(element) for element in elements_of(node)]
    margin, line = indent_of(source, start), line_end(source)
    body = "".join(f"{margin}{step_of(source)}{item},{line}" for item in items)
    spread = f"{text[: start + 1]}{line}{body}{margin}{text[end - 1 :]}"
    return spread if items and spread not in refused else None


#: The argument of setup() for which idlc compiles interfaces.
KEYWORD = "idlc_interfaces"


def unnoticed_changes(setup: Setup, folder: str) -> Iterator[Diagnostic]:
    """Yield the problem of a setup.py that installs outdated classes where idlc is missing.

    `folder` contains the classes.
    """
    is_entered = any("/packages" in (entry.folder or "") for entry in setup.data_files or ())
    if BUILD_STEP in setup.source.text or not (is_entered or KEYWORD in setup.arguments):
        return
    find, run = "find_spec('idlc')", f"run_path('{folder}/{BUILD_STEP}')"
    edits = step_before_setup(setup, folder)
    yield codes.STALE_GENERATED_CODE.at(
        setup.place(KEYWORD),
        "builds without idlc do not notice if the classes are out of date",
        hint=f"write `if not {find}: {run}` before setup()"
        + (", or run `idlc check --fix`" if edits else ""),
        edits=edits,
    )


def step_before_setup(setup: Setup, folder: str, *, is_library: bool = False) -> tuple[Edit, ...]:
    """Return the edits that run the build step before the statement that calls setup().

    Where idlc is installed, it compiles the interfaces of other packages than libraries instead.
    """
    source, call = setup.source, setup.call
    if call is None:
        return ()
    statements = [node for node in setup.tree.body if node.lineno <= call.lineno]
    statement = statements[-1]
    at = start_of(source, statement)
    has_own_line = _begins_line(source, at) and not getattr(statement, "decorator_list", ())
    if not has_own_line or re.search(r"[^\w./-]", folder):  # it becomes part of a program
        return ()
    run, imports = imported(setup, "runpy", "run_path")
    step = f"{run}('{folder}/{BUILD_STEP}')"
    reason = "# this build stops if `idlc gen` was not run after a change"
    if is_library:
        text = f"{reason}\n{step}\n\n"
    else:
        find, more = imported(setup, "importlib.util", "find_spec")
        if imports and more and imports[0].span == more[0].span:
            first = more[0]
            blank = first.text.rstrip("\r\n") + line_end(source)
            more, imports = (Edit(first.span, blank + imports[0].text),), ()
        imports = (*more, *imports)
        text = f"if not {find}('idlc'):  {reason}\n{step_of(source)}{step}\n\n"
    quote = quote_of(source, call)
    return (*imports, insertion(source, at, text.replace("'", quote)))


def unusable_entry(setup: Setup, package: str) -> Iterator[Diagnostic]:
    """Yield the problem of a setup.py that registers a package without installing libraries."""
    index = [entry for entry in setup.data_files or () if "/packages" in (entry.folder or "")]
    if not index:
        return
    asked = setup.arguments.get(KEYWORD)
    installs = bool(asked.value) if isinstance(asked, ast.Constant) else asked is not None
    if not installs:
        edits = () if asked else argument(setup, f"{KEYWORD}=True")
        yield codes.NO_LIBRARY_INSTALLED.at(
            span_of(setup.source, index[0].node),
            f"`ros2 bag record` stops at `{package}`: setup.py adds the package to ROS 2's index, "
            "but does not install a library for its types",
            hint=f"pass `{KEYWORD}=True` to setup()"
            + (", or run `idlc check --fix`" if edits else ""),
            edits=edits,
        )
