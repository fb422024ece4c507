"""What setup.py does so that C++ tools know a package's types, and the edits with which it does.

A package that is entered in ROS 2's index without a library for its types stops recorders.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from textwrap import indent
from typing import TypeGuard

import msgspec

from idlc.checks.package.python_files import range_of, span_of, start_of
from idlc.checks.package.setup_edits import argument, indent_of, insertion
from idlc.checks.package.setup_py import Setup, name_of_call
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit
from idlc.diagnostics.source import Span

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


def unusable_entry(setup: Setup, package: str) -> Iterator[Diagnostic]:
    """Yield the problem with a setup.py that enters a package without installing libraries."""
    index = [one for one in setup.data_files or () if "/packages" in (one.folder or "")]
    if not index or installs(setup):
        return
    edits = edits_for(setup)
    problem = codes.NO_LIBRARY_INSTALLED.at(
        span_of(setup.source, index[0].node),
        f"`ros2 bag record` will stop at `{package}`: setup.py registers it with ROS 2, but "
        "installs no library for its types",
        hint=f"pass `**{COMPILE}('{package}')` of `idlc.build` to setup()"
        + ("; --fix does" if edits else ""),
    )
    yield msgspec.structs.replace(problem, edits=edits)


def installs(setup: Setup) -> bool:
    """Return whether a setup.py uses what compiling the interfaces returns."""
    dropped = {id(one.value) for one in setup.nodes if _is_plain(one)}
    return any(_is_compile(one) and id(one) not in dropped for one in setup.nodes)


def edits_for(setup: Setup) -> tuple[Edit, ...]:
    """Return the edits after which a setup.py installs libraries; none if it is too unusual."""
    names = {one.id for one in setup.nodes if isinstance(one, ast.Name)}
    if setup.call is None or RESULT in names or installs(setup):
        return ()
    taken = {one.arg for one in setup.call.keywords} & {"distclass", None}
    given = () if taken else argument(setup, f"**{RESULT}")
    compiling = _compiling(setup) if given else ()
    return (*compiling, *given) if compiling else ()


def _compiling(setup: Setup) -> tuple[Edit, ...]:
    """Return the edits that keep what compiling returns, or that compile in the first place."""
    source = setup.source
    plain = [one for one in setup.nodes if _is_plain(one)]
    if not plain:
        name = setup.arguments.get("name")
        first = setup.first_use("packages", "data_files")
        if first is None or not isinstance(name, (ast.Name, ast.Constant)):
            return ()
        at = start_of(source, first)
        margin = indent_of(source, at)
        if first.col_offset != len(margin):
            return ()  # behind a semicolon
        at -= len(margin)
        blank = not at or re.search(r"(\r\n?|\n)[ \t]*(\r\n?|\n)\Z", source.text[:at])
        block = _BLOCK.format(name=ast.unparse(name))
        return (insertion(source, at, ("" if blank else "\n") + indent(block, margin)),)
    found = [one for one in setup.nodes if isinstance(one, ast.Try) and plain[0] in one.orelse]
    if len(plain) != 1 or len(found) != 1 or len(found[0].handlers) != 1:
        return ()
    (otherwise,) = found[0].handlers
    if len(otherwise.body) != 1 or not isinstance(otherwise.body[0], ast.Pass):
        return ()
    nothing = Edit(Span(source, *range_of(source, otherwise.body[0])), f"{RESULT} = {{}}")
    return nothing, insertion(source, start_of(source, plain[0]), f"{RESULT} = ")


def _is_compile(node: ast.AST) -> bool:
    return name_of_call(node) == COMPILE


def _is_plain(node: ast.AST) -> TypeGuard[ast.Expr]:
    """Return whether a statement only calls the function, and drops what it returns."""
    return isinstance(node, ast.Expr) and _is_compile(node.value)
