"""Values and annotations of IDL → what they mean for a field, a constant or a structure."""

from __future__ import annotations

import ast
import warnings
from collections.abc import Iterable

from idlc.diagnostics import codes
from idlc.model import ir
from idlc.model.lowering import literals
from idlc.model.lowering.elements import MAX_ELEMENTS
from idlc.model.lowering.fault import Fault
from idlc.syntax import idl_tree
from idlc.syntax.escapes import inside_literal
from idlc.syntax.tree import Piece

#: What ROS 2's adapter annotates with.
ANNOTATIONS = frozenset({"verbatim", "default", "unit", "optional"})
#: What the adapter writes between the lines of a comment.
_LINE_END = '"\\n"'


def parameter(
    annotations: Iterable[idl_tree.Annotation], name: str, key: str
) -> idl_tree.Value | None:
    """Return a parameter of the first annotation of a name, or `None`."""
    found = (one.parameters for one in annotations if one.name.text == name)
    return next(found, {}).get(key)


def comment(annotations: Iterable[idl_tree.Annotation]) -> tuple[str, ...]:
    """Return the lines of a comment: a literal for each, and line ends between them."""
    value = parameter(annotations, "verbatim", "text")
    if value is None:
        return ()
    between = value.pieces[1::2]
    if len(value.pieces) % 2 and all(piece.text == _LINE_END for piece in between):
        return tuple(_inside(piece) for piece in value.pieces[::2])
    return tuple(text(value).split("\n"))


def unit(annotations: Iterable[idl_tree.Annotation]) -> str | None:
    """Return the unit that `@unit` says."""
    value = parameter(annotations, "unit", "value")
    return None if value is None else text(value)


def text(value: idl_tree.Value) -> str:
    """Return the texts of a value as one; a number's as it stands."""
    return "".join(map(_inside, value.pieces)) if value.is_text else value.pieces[0].text


def _inside(piece: Piece) -> str:
    try:
        return inside_literal(piece.text[1:-1])
    except ValueError:  # an incomplete escape, which rosidl would not have written
        return piece.text[1:-1]


def scalar(type_: ir.Primitive | ir.String, value: idl_tree.Value) -> ir.Scalar | Fault:
    """Return the value of a constant, or what is wrong with it."""
    found = default(type_, value)
    if isinstance(found, Fault):
        return found
    assert not isinstance(found.value, tuple)
    return found.value


def default(type_: ir.FieldType, value: idl_tree.Value) -> ir.Default | Fault:
    """Return the value of `@default`, or what is wrong with it."""
    if isinstance(type_, (ir.Array, ir.Sequence)):
        return _elements(type_, value)
    if isinstance(type_, ir.String):
        words = text(value)
        if not value.is_text or not _fits(type_, words):
            return _wrong(value, type_)
        return ir.Default(words, words)
    if value.is_text:
        return _wrong(value, type_)
    found = literals.default(type_, value.pieces[0].text)
    return found.moved(value.whole.start) if isinstance(found, Fault) else found


def _elements(type_: ir.Array | ir.Sequence, value: idl_tree.Value) -> ir.Default | Fault:
    """Read the text of a Python tuple, as which the defaults of arrays travel."""
    words = text(value)
    if not value.is_text or words.count(",") > MAX_ELEMENTS:
        return _wrong(value, type_)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # unknown escapes
            found = ast.literal_eval(words)
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return _wrong(value, type_)
    if not isinstance(found, tuple) or not all(_fits(type_.element, one) for one in found):
        return _wrong(value, type_)
    wrong = literals.wrong_length(type_, len(found), value.whole.text)
    return wrong.moved(value.whole.start) if wrong else ir.Default(found, words)


def _fits(type_: ir.Element, value: object) -> bool:
    """Return whether a Python value is one of a scalar type."""
    match type_:
        case ir.String():
            return isinstance(value, str) and (type_.bound is None or len(value) <= type_.bound)
        case ir.Primitive("bool"):
            return isinstance(value, bool)
        case ir.Primitive():
            low, high = type_.info.low, type_.info.high
            if low is None or high is None:
                return isinstance(value, float)
            is_number = isinstance(value, int) and not isinstance(value, bool)
            return is_number and low <= value <= high  # type: ignore[operator]
    return False


def _wrong(value: idl_tree.Value, type_: ir.FieldType) -> Fault:
    from idlc.model.spelling import spell

    message = f"this is no value of type `{spell(type_)}`"
    return Fault(codes.BAD_VALUE, message, value.whole.start, value.whole.end)
