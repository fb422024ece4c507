"""What setup.py does so that C++ tools know a package's types, and the edits with which it does.

A package that is entered in ROS 2's index without a library for its types stops recorders.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import TypeGuard

import msgspec

from idlc.checks.package.python_files import is_setup, parsed, read_setup, start_of
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit
from idlc.diagnostics.source import Source, Span

COMPILE = "compile_interfaces"
RESULT = "compiled"
_BLOCK = f"""\
try:
    from idlc.build import {COMPILE}
except ImportError:
    {RESULT} = {{{{}}}}  # what was compiled last is installed, without libraries for C++ tools
else:
    {RESULT} = {COMPILE}({{name}})

"""


def unusable_entry(setup: Source, package: str) -> Iterator[Diagnostic]:
    """Yield the problem with a setup.py that enters a package without installing libraries."""
    index = [text for text in read_setup(setup).data_files or () if "/packages" in text.value]
    if not index or installs(setup):
        return
    edits = edits_for(setup)
    by_hand = "; --fix does" if edits else f", as in `setup(**{RESULT}, ...)`"
    problem = codes.NO_LIBRARY_INSTALLED.at(
        index[0].span,
        f"`{package}` is entered in ROS 2's index without libraries for its types, and stops "
        "`ros2 bag record`",
        hint=f"give setup() what `idlc.build.{COMPILE}` returns{by_hand}",
    )
    yield msgspec.structs.replace(problem, edits=edits)


def installs(setup: Source) -> bool:
    """Return whether a setup.py uses what compiling the interfaces returns."""
    tree = parsed(setup.text)
    if tree is None:
        return True
    dropped = {id(one.value) for one in ast.walk(tree) if _is_plain(one)}
    return any(_is_compile(one) and id(one) not in dropped for one in ast.walk(tree))


def edits_for(setup: Source) -> tuple[Edit, ...]:
    """Return the edits after which a setup.py installs libraries; none if it is too unusual."""
    tree = parsed(setup.text)
    calls = [one for one in ast.walk(tree) if is_setup(one)] if tree else []
    names = {one.id for one in ast.walk(tree) if isinstance(one, ast.Name)} if tree else set()
    if tree is None or len(calls) != 1 or RESULT in names or installs(setup):
        return ()
    call = calls[0]
    taken = {one.arg for one in call.keywords} & {"distclass", None}
    if call.args or not call.keywords or taken:
        return ()
    compiling = _compiling(setup, tree, call)
    return (*compiling, _argument(setup, call)) if compiling else ()


def _compiling(setup: Source, tree: ast.Module, call: ast.Call) -> tuple[Edit, ...]:
    """Return the edits that keep what compiling returns, or that compile in the first place."""
    plain = [one for one in ast.walk(tree) if _is_plain(one)]
    if not plain:
        first = next((one for one in tree.body if call in ast.walk(one)), None)
        name = next((one.value for one in call.keywords if one.arg == "name"), None)
        if not isinstance(first, ast.Expr) or not isinstance(name, (ast.Name, ast.Constant)):
            return ()
        gap = "\n" if any(setup.lines[first.lineno - 2 : first.lineno - 1]) else ""
        return (_insert(setup, first, gap + _BLOCK.format(name=ast.unparse(name))),)
    found = [one for one in tree.body if isinstance(one, ast.Try) and plain[0] in one.orelse]
    if len(plain) != 1 or len(found) != 1 or len(found[0].handlers) != 1:
        return ()
    (otherwise,) = found[0].handlers
    if len(otherwise.body) != 1 or not isinstance(otherwise.body[0], ast.Pass):
        return ()
    start = start_of(setup, otherwise.body[0])
    nothing = Edit(Span(setup, start, start + len("pass")), f"{RESULT} = {{}}")
    return nothing, _insert(setup, plain[0], f"{RESULT} = ")


def _argument(setup: Source, call: ast.Call) -> Edit:
    """Return the edit that gives setup() one argument more, laid out like its first one."""
    first = call.keywords[0]
    spread = first.lineno > call.lineno
    between = "\n" + " " * first.col_offset if spread else " "
    return _insert(setup, first, f"**{RESULT},{between}")


def _insert(setup: Source, node: ast.AST, text: str) -> Edit:
    start = start_of(setup, node)
    return Edit(Span(setup, start, start), text)


def _is_compile(node: ast.AST) -> bool:
    if not isinstance(node, ast.Call):
        return False
    function = node.func
    return (
        function.id if isinstance(function, ast.Name) else getattr(function, "attr", "")
    ) == COMPILE


def _is_plain(node: ast.AST) -> TypeGuard[ast.Expr]:
    """Return whether a statement only calls the function, and drops what it returns."""
    return isinstance(node, ast.Expr) and _is_compile(node.value)
