"""Python source as libcst trees: reading strings that are written out, appending to lists.

An appended element looks like its neighbours: quotes, indentation, trailing comma. Comments stay
with the elements beside them.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence

import libcst as cst

INDENT = 4


def constants(module: cst.Module) -> dict[str, str]:
    """Return the names that are given a string once, at the top of a module, and never again."""
    by_name: dict[str, list[str | None]] = {}
    for name, value in assignments(module):
        by_name.setdefault(name, []).append(string(value, {}))
    return {
        name: values[0]
        for name, values in by_name.items()
        if len(values) == 1 and values[0] is not None
    }


def assignments(module: cst.Module) -> list[tuple[str, cst.BaseExpression]]:
    """Return every `NAME = value` outside of functions and classes, in order."""
    values: list[tuple[str, cst.BaseExpression]] = []

    class Assignments(cst.CSTVisitor):
        def visit_FunctionDef(self, node: cst.FunctionDef) -> bool:  # noqa: N802, ARG002
            return False

        def visit_ClassDef(self, node: cst.ClassDef) -> bool:  # noqa: N802, ARG002
            return False

        def visit_Assign(self, node: cst.Assign) -> None:  # noqa: N802
            names = (target.target for target in node.targets)
            values.extend((name.value, node.value) for name in names if isinstance(name, cst.Name))

        def visit_AnnAssign(self, node: cst.AnnAssign) -> None:  # noqa: N802
            if isinstance(node.target, cst.Name) and node.value is not None:
                values.append((node.target.value, node.value))

        def visit_AugAssign(self, node: cst.AugAssign) -> None:  # noqa: N802
            if isinstance(node.target, cst.Name):
                values.append((node.target.value, node.value))

    module.visit(Assignments())
    return values


def string(node: cst.BaseExpression, strings: Mapping[str, str]) -> str | None:
    """Return the string value of an expression, where the source shows it."""
    match node:
        case cst.SimpleString() | cst.ConcatenatedString():
            value = _evaluated(node)
            return value if isinstance(value, str) else None
        case cst.Name():
            return strings.get(node.value)
        case cst.FormattedString():
            parts = [_part(part, strings) for part in node.parts]
            return None if None in parts else "".join(part for part in parts if part)
        case cst.BinaryOperation(operator=cst.Add()):
            left, right = string(node.left, strings), string(node.right, strings)
            return None if left is None or right is None else left + right
    return None


def _evaluated(node: cst.SimpleString | cst.ConcatenatedString) -> str | bytes | None:
    if isinstance(node, cst.SimpleString):
        return node.evaluated_value
    try:
        return node.evaluated_value
    except AttributeError:  # an f-string among the parts has no value of its own
        return None


def _part(part: cst.BaseFormattedStringContent, strings: Mapping[str, str]) -> str | None:
    match part:
        case cst.FormattedStringText():
            return part.value.replace("{{", "{").replace("}}", "}")
        case cst.FormattedStringExpression(
            expression=cst.Name(), conversion=None, format_spec=None, equal=None
        ):
            return string(part.expression, strings)
    return None


def quoted(text: str, like: Sequence[cst.BaseExpression]) -> cst.SimpleString:
    """Return a string literal in the quotes that the last of the other literals has."""
    quote = "'"
    for node in like:
        if isinstance(node, cst.SimpleString):
            quote = node.quote[0]
    return cst.SimpleString(f"{quote}{text}{quote}")


def appended(
    sequence: cst.List | cst.Tuple | cst.Dict, new: cst.BaseElement | cst.BaseDictElement
) -> cst.BaseExpression:
    """Return a list, tuple or dictionary with an element more at its end."""
    elements: list[_Element] = list(sequence.elements)
    opening, closing = _brackets(sequence)
    if not elements:
        opening, closing, new = _first(opening, closing, new)
    else:
        elements[-1], new, closing = _after(elements, opening, closing, new)
    elements.append(new)
    if isinstance(sequence, cst.Dict):
        brace = sequence.lbrace.with_changes(whitespace_after=opening)
        end = sequence.rbrace.with_changes(whitespace_before=closing)
        return sequence.with_changes(elements=elements, lbrace=brace, rbrace=end)
    if isinstance(sequence, cst.List):
        left = sequence.lbracket.with_changes(whitespace_after=opening)
        right = sequence.rbracket.with_changes(whitespace_before=closing)
        return sequence.with_changes(elements=elements, lbracket=left, rbracket=right)
    if len(elements) == 1:
        elements[0] = elements[0].with_changes(comma=cst.Comma())
    (*outer, left_paren) = sequence.lpar or [cst.LeftParen()]
    (right_paren, *rest) = sequence.rpar or [cst.RightParen()]
    return sequence.with_changes(
        elements=elements,
        lpar=[*outer, left_paren.with_changes(whitespace_after=opening)],
        rpar=[right_paren.with_changes(whitespace_before=closing), *rest],
    )


def inner_indent(sequence: cst.List) -> str:
    """Return the indentation of elements with a line of their own, that of blocks left out."""
    opening, closing = _brackets(sequence)
    if isinstance(opening, cst.ParenthesizedWhitespace):
        return opening.last_line.value if sequence.elements else opening.last_line.value + " " * 4
    return closing.last_line.value if isinstance(closing, cst.ParenthesizedWhitespace) else ""


_Space = cst.BaseParenthesizableWhitespace


def _brackets(sequence: cst.List | cst.Tuple | cst.Dict) -> tuple[_Space, _Space]:
    """Return the white space inside the opening and before the closing bracket."""
    if isinstance(sequence, cst.Dict):
        return sequence.lbrace.whitespace_after, sequence.rbrace.whitespace_before
    if isinstance(sequence, cst.List):
        return sequence.lbracket.whitespace_after, sequence.rbracket.whitespace_before
    nothing = cst.SimpleWhitespace("")
    left = sequence.lpar[-1].whitespace_after if sequence.lpar else nothing
    right = sequence.rpar[0].whitespace_before if sequence.rpar else nothing
    return left, right


_Element = cst.BaseElement | cst.BaseDictElement


def _first(opening: _Space, closing: _Space, new: _Element) -> tuple[_Space, _Space, _Element]:
    """Place the only element: on a line of its own where the brackets are on different lines."""
    space = opening if isinstance(opening, cst.ParenthesizedWhitespace) else closing
    if not isinstance(space, cst.ParenthesizedWhitespace):
        return opening, closing, new
    deeper = cst.SimpleWhitespace(space.last_line.value + " " * INDENT)
    return (
        space.with_changes(last_line=deeper),
        _fresh_line(space, space.last_line),
        new.with_changes(comma=cst.Comma()),
    )


def _after(
    elements: Sequence[_Element], opening: _Space, closing: _Space, new: _Element
) -> tuple[_Element, _Element, _Space]:
    """Return the last element, the new one after it and the space after both."""
    last = elements[-1]
    between = _separation(elements, opening)
    if isinstance(closing, cst.ParenthesizedWhitespace):
        deeper = (
            between.last_line
            if isinstance(between, cst.ParenthesizedWhitespace)
            else cst.SimpleWhitespace(closing.last_line.value + " " * INDENT)
        )
        comma = cst.Comma(whitespace_after=closing.with_changes(last_line=deeper))
        return (
            last.with_changes(comma=comma),
            new.with_changes(comma=cst.Comma()),
            _fresh_line(closing, closing.last_line),
        )
    trailing = last.comma
    comma = cst.Comma(whitespace_after=between)
    return last.with_changes(comma=comma), new.with_changes(comma=trailing), closing


def _separation(elements: Sequence[_Element], opening: _Space) -> _Space:
    """Return the space between two elements, without the comments in it."""
    for element in elements[:-1]:
        if isinstance(element.comma, cst.Comma):
            space = element.comma.whitespace_after
            if isinstance(space, cst.ParenthesizedWhitespace):
                return _fresh_line(space, space.last_line)
    if isinstance(opening, cst.ParenthesizedWhitespace):
        return _fresh_line(opening, opening.last_line)
    return cst.SimpleWhitespace(" ")


def _fresh_line(
    space: cst.ParenthesizedWhitespace, last_line: cst.SimpleWhitespace
) -> cst.ParenthesizedWhitespace:
    """Return a line break as in `space`, without its comments and empty lines."""
    first = cst.TrailingWhitespace(newline=space.first_line.newline)
    return cst.ParenthesizedWhitespace(first_line=first, indent=space.indent, last_line=last_line)


def parsed(text: str) -> cst.Module | None:
    """Return the tree of a source text; `None` if it is not Python."""
    try:
        ast.parse(text)
        return cst.parse_module(text)
    except (SyntaxError, ValueError, cst.ParserSyntaxError):
        return None
