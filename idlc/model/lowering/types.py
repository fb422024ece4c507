"""Type syntax → IR type (language 2.1), or what is wrong with it."""

from __future__ import annotations

from idlc.diagnostics import codes
from idlc.model import ir, names
from idlc.model.lowering import slips
from idlc.model.lowering.fault import Fault
from idlc.syntax import tree

STRINGS = {"string": False, "wstring": True}
ROS1_TYPES = ("time", "duration")
_NO_FIELDS = {"srv": "services", "action": "actions"}


def lower_type(type_: tree.Type, package: str) -> ir.FieldType | Fault:
    """Return the meaning of a type in a file of `package`; offsets count from the line's start."""
    element = _element(type_, package)
    if isinstance(element, Fault) or type_.brackets is None:
        return element
    if type_.size is None:
        return ir.Sequence(element)
    size = positive(type_.size, "the array's size")
    if isinstance(size, Fault):
        return size
    return ir.Sequence(element, size) if type_.at_most else ir.Array(element, size)


def as_parsed(type_: ir.FieldType) -> ir.FieldType:
    """Return the type that rosidl's parser reads back: `wstring<=N[]` becomes bounded by N."""
    match type_:
        case ir.Sequence(ir.String(wide=True, bound=int(bound)) as element, None):
            return ir.Sequence(element, bound)
    return type_


def _element(type_: tree.Type, package: str) -> ir.Element | Fault:
    name = type_.name.text
    if name in STRINGS:
        bound = None if type_.bound is None else positive(type_.bound, "the string's bound")
        return bound if isinstance(bound, Fault) else ir.String(STRINGS[name], bound)
    if type_.bound is not None:
        piece = tree.Piece("<=" + type_.bound.text, type_.bound.start - 2)
        hint = f"for at most {type_.bound.text} elements write `{name}[<={type_.bound.text}]`"
        return _fault(codes.BOUND_ON_NON_STRING, piece, f"`{name}` cannot have a bound", hint)
    if name in ir.PRIMITIVES:
        return ir.Primitive(name)
    if name in ROS1_TYPES:
        known = "builtin_interfaces/" + name.capitalize()
        return _fault(codes.ROS1_TYPE, type_.name, f"`{name}` is a ROS 1 type", f"write `{known}`")
    return _reference(type_.name, package)


def _reference(piece: tree.Piece, package: str) -> ir.Element | Fault:
    parts = piece.text.split("/")
    if len(parts) > 2:
        hint = (
            f"write `{parts[0]}/{parts[-1].removesuffix('.msg')}`"
            if len(parts) == 3
            else "write `package/Name`"
        )
        if len(parts) == 3 and parts[1] in _NO_FIELDS:
            hint = f"only messages can be the type of a field, not {_NO_FIELDS[parts[1]]}"
        return _fault(codes.INVALID_TYPE_NAME, piece, f"`{piece.text}` has too many parts", hint)
    if len(parts) == 2 and not names.is_package_name(parts[0]):
        wrong = tree.Piece(parts[0], piece.start)
        message = f"`{parts[0]}` cannot be a package name"
        return _fault(codes.INVALID_TYPE_NAME, wrong, message, names.PACKAGE_HINT)
    name = parts[-1]
    if not names.is_message_name(name):
        return _bad_name(tree.Piece(name, piece.end - len(name)), qualified=len(parts) == 2)
    return ir.Ref(ir.TypeName(parts[0] if len(parts) == 2 else package, "msg", name))


def _bad_name(piece: tree.Piece, *, qualified: bool) -> Fault:
    name = piece.text
    if not qualified:
        if dotted := slips.dotted(name):
            message = f"`{name}` cannot be a type name"
            return _fault(codes.INVALID_TYPE_NAME, piece, message, f"write `{dotted}`")
        if meant := slips.type_hint(name):
            return _fault(codes.UNKNOWN_TYPE, piece, f"unknown type `{name}`", meant)
    like = names.message_name_like(name.removesuffix(".msg"))
    hint = f"write `{like}`" if names.is_message_name(like) else names.MESSAGE_HINT
    return _fault(codes.INVALID_TYPE_NAME, piece, f"`{name}` cannot be a type name", hint)


def positive(piece: tree.Piece, what: str) -> int | Fault:
    """Return the size or bound that a piece is."""
    try:
        value = int(piece.text)
    except ValueError:
        value = 0
    if value > 0:
        return value
    message = f"{what} is not a positive integer"
    return _fault(codes.BAD_BOUND, piece, message, "write a decimal number above 0")


def _fault(code: codes.Code, piece: tree.Piece, message: str, hint: str) -> Fault:
    return Fault(code, message, piece.start, piece.end, hint)
