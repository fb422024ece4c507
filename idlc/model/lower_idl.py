"""IDL's syntax → IR: the same meaning as the interface file from which the .idl was made.

Some facts are lost in the adapter: whether a number was a `char`, the units of constants, and the
spelling of a text.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Span
from idlc.diagnostics.text import including
from idlc.language import idl
from idlc.language.escapes import inside_literal
from idlc.language.tree import OPTIONAL, Fault, Piece
from idlc.model import ir, lower_types, lower_values, names
from idlc.model.lower_types import STRINGS, as_parsed, positive
from idlc.model.lower_values import MAX_ELEMENTS

#: The annotations that ROS 2's adapter writes.
ANNOTATIONS = frozenset({"verbatim", "default", "unit", "optional"})
#: The literal that the adapter writes between the lines of a comment.
_LINE_END = '"\\n"'


def parameter(annotations: Iterable[idl.Annotation], name: str, key: str) -> idl.Value | None:
    """Return a parameter of the first annotation of a name, or `None`."""
    matches = (annotation.parameters for annotation in annotations if annotation.name.text == name)
    return next(matches, {}).get(key)


def comment(annotations: Iterable[idl.Annotation]) -> tuple[str, ...]:
    """Return the lines of a comment: a literal for each, and line ends between them."""
    value = parameter(annotations, "verbatim", "text")
    if value is None:
        return ()
    between = value.pieces[1::2]
    if len(value.pieces) % 2 and all(piece.text == _LINE_END for piece in between):
        return tuple(_inside(piece) for piece in value.pieces[::2])
    return tuple(text(value).split("\n"))


def unit(annotations: Iterable[idl.Annotation]) -> str | None:
    """Return the unit in `@unit`."""
    value = parameter(annotations, "unit", "value")
    return None if value is None else text(value)


def text(value: idl.Value) -> str:
    """Return the texts of a value as one; a number as written."""
    return "".join(map(_inside, value.pieces)) if value.is_text else value.pieces[0].text


def _inside(piece: Piece) -> str:
    try:
        return inside_literal(piece.text[1:-1])
    except ValueError:  # an incomplete escape, which rosidl would not have written
        return piece.text[1:-1]


def scalar(type_: ir.Primitive | ir.String, value: idl.Value) -> ir.Scalar | Fault:
    """Return the value of a constant, or its fault."""
    lowered = default(type_, value)
    if isinstance(lowered, Fault):
        return lowered
    assert not isinstance(lowered.value, tuple)
    return lowered.value


def default(type_: ir.FieldType, value: idl.Value) -> ir.Default | Fault:
    """Return the value of `@default`, or its fault."""
    words = text(value)
    if not value.is_text and isinstance(type_, ir.Primitive):
        lowered = lower_values.default(type_, words)
        return lowered.moved(value.whole.start) if isinstance(lowered, Fault) else lowered
    if value.is_text and isinstance(type_, ir.String) and _fits(type_, words):
        return ir.Default(words, words)
    if value.is_text and isinstance(type_, (ir.Array, ir.Sequence)):
        values = _elements(type_, words)
        if values is not None:
            wrong = lower_values.wrong_length(type_, len(values), value.whole.text)
            return wrong.moved(value.whole.start) if wrong else ir.Default(values, words)
    message = f"this is no value of type `{ir.spell(type_)}`"
    return Fault(codes.BAD_VALUE, message, value.whole.start, value.whole.end)


def _elements(type_: ir.Array | ir.Sequence, words: str) -> tuple[ir.Scalar, ...] | None:
    """Read the text of a Python tuple, as which the defaults of arrays travel."""
    try:
        values = lower_values.python_tuple(words) if words.count(",") <= MAX_ELEMENTS else None
    except ValueError:
        return None
    return values if all(_fits(type_.element, value) for value in values or ()) else None


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


#: Primitives by their name in IDL; the later of two with one name, which is the plainer one.
_PRIMITIVES = {info.idl: ir.Primitive(name) for name, info in ir.PRIMITIVES.items()}
_CONSTANTS = "_Constants"


def lower_idl(file: idl.IdlFile, names: Sequence[ir.TypeName], report: Report) -> list[ir.Message]:
    """Return the structures of these names from a file, which must hold no others."""
    return _Lowering(file, report).structures(names)


class _Type(NamedTuple):
    """A type and its name in the text, for problems with it."""

    type: ir.FieldType
    piece: Piece


class _Lowering:
    """Lowers one file; holds the state that its steps share."""

    def __init__(self, file: idl.IdlFile, report: Report) -> None:
        self.file = file
        self.report = report
        self.typedefs: dict[str, _Type] = {}
        self.strange = False

    def structures(self, names: Sequence[ir.TypeName]) -> list[ir.Message]:
        if self.file.broken is not None:
            word = f"`{self.file.broken.text}`" if self.file.broken.text else "this end of the text"
            self._foreign(self.file.broken, word)
            return [ir.Message(name=name, source=self.file.source) for name in names]
        top, file = names[0], self.file
        for piece, written in ((file.package, top.package), (file.kind, top.kind)):
            if piece.text != written:
                self._foreign(piece, f"module `{piece.text}` for `{top}`")
        constants: dict[str, list[ir.Constant]] = {}
        structures: dict[str, idl.Structure] = {}
        expected = {name.name for name in names}
        for part in self.file.parts:
            name = part.name.text.removesuffix(_CONSTANTS)
            if isinstance(part, idl.Typedef):
                self._typedef(part)
            elif name not in expected:
                self._foreign(part.name, f"`{part.name.text}` among the parts of `{names[0]}`")
            elif isinstance(part, idl.Constants):
                lowered = map(self._constant, part.constants)
                constants.setdefault(name, []).extend(constant for constant in lowered if constant)
            elif structures.setdefault(name, part) is not part:
                self._foreign(part.name, f"a second `{name}`")
        if not self.strange:
            for name in expected - structures.keys():
                self._foreign(self.file.kind, f"a module without `{name}`")
        return [self._structure(name, structures.get(name.name), constants) for name in names]

    def _foreign(self, piece: Piece, subject: str) -> None:
        self.strange = True
        message = f"{subject} is nothing that ROS 2 writes when it makes IDL of a .msg file"
        hint = f"idlc reads no other IDL; {including('DIR')} with the package's .msg files"
        self.report.add(codes.FOREIGN_IDL.at(self.file.span(piece), message, hint=hint))

    def _fault(self, fault: Fault) -> None:
        span = Span(self.file.source, fault.start, fault.end)
        self.report.add(fault.code.at(span, fault.message, hint=fault.hint))

    def _structure(
        self,
        name: ir.TypeName,
        structure: idl.Structure | None,
        constants: dict[str, list[ir.Constant]],
    ) -> ir.Message:
        fields = [self._field(member) for member in structure.members] if structure else []
        dummy = ir.DUMMY_FIELD, ir.Primitive("uint8")
        if [(field.name, field.type) for field in fields] == [dummy]:
            fields = []
        return ir.Message(
            name=name,
            fields=tuple(fields),
            constants=tuple(constants.get(name.name, ())),
            comment=comment(structure.annotations) if structure else (),
            source=self.file.source,
        )

    def _typedef(self, typedef: idl.Typedef) -> None:
        target = self._type(typedef.type)
        type_ = target.type
        if size := self._positive(typedef.size, "the array's size"):
            if isinstance(type_, (ir.Array, ir.Sequence)):
                self._foreign(typedef.name, "an array of arrays")
                type_ = ir.Unknown()
            else:
                type_ = ir.Array(type_, size)
        self.typedefs[typedef.name.text] = _Type(type_, target.piece)

    def _positive(self, piece: Piece | None, subject: str) -> int | None:
        size = None if piece is None else positive(piece, subject)
        if not isinstance(size, Fault):
            return size
        self._fault(size)
        return None

    def _type(self, type_: idl.Element | idl.Sequence) -> _Type:
        if isinstance(type_, idl.Element):
            return self._element(type_)
        element, piece = self._element(type_.element)
        if isinstance(element, (ir.Array, ir.Sequence)):
            self._foreign(piece, "a sequence of arrays")
            return _Type(ir.Unknown(), piece)
        bound = self._positive(type_.bound, "the array's size")
        return _Type(as_parsed(ir.Sequence(element, bound)), piece)

    def _element(self, element: idl.Element) -> _Type:
        piece = element.name
        if piece.text in STRINGS:
            bound = self._positive(element.bound, "the string's bound")
            return _Type(ir.String(STRINGS[piece.text], bound), piece)
        if element.bound is None:
            if piece.text in _PRIMITIVES:
                return _Type(_PRIMITIVES[piece.text], piece)
            if piece.text in self.typedefs:
                return self.typedefs[piece.text]
            match element.parts:
                case (package, "msg", name) if names.is_package_name(
                    package
                ) and names.is_message_name(name):
                    return _Type(ir.Ref(ir.TypeName(package, "msg", name)), piece)
        self._foreign(piece, f"the type `{piece.text}`")
        return _Type(ir.Unknown(), piece)

    def _check(self, element: idl.Member | idl.IdlConstant) -> None:
        """Report unknown annotations, and a name that ROS 2 does not allow."""
        for annotation in element.annotations:
            if annotation.name.text not in ANNOTATIONS:
                self._foreign(annotation.name, f"the annotation `@{annotation.name.text}`")
        is_field = isinstance(element, idl.Member)
        fault = (lower_types.field_name if is_field else lower_types.constant_name)(
            element.name.text
        )
        if fault is not None:
            self._fault(fault.moved(element.name.start))

    def _field(self, member: idl.Member) -> ir.Field:
        self._check(member)
        type_, piece = self._type(member.type)
        return ir.Field(
            name=member.name.text,
            type=type_,
            default=self._default(type_, member.annotations),
            comment=comment(member.annotations),
            unit=unit(member.annotations),
            optional=any(
                f"@{annotation.name.text}" == OPTIONAL for annotation in member.annotations
            ),
            name_span=self.file.span(member.name),
            type_span=self.file.span(piece),
        )

    def _default(
        self, type_: ir.FieldType, annotations: Sequence[idl.Annotation]
    ) -> ir.Default | None:
        value = parameter(annotations, "default", "value")
        element = ir.element_of(type_)
        if value is None or isinstance(element, ir.Unknown):
            return None
        if isinstance(element, ir.Ref):
            self._foreign(value.whole, "a default for a message")
            return None
        lowered = default(type_, value)
        if isinstance(lowered, Fault):
            self._fault(lowered)
            return None
        return lowered

    def _constant(self, constant: idl.IdlConstant) -> ir.Constant | None:
        self._check(constant)
        type_, piece = self._type(constant.type)
        if not isinstance(type_, (ir.Primitive, ir.String)):
            self._foreign(piece, f"a constant of the type `{piece.text}`")
            return None
        value = scalar(type_, constant.value)
        if isinstance(value, Fault):
            self._fault(value)
            return None
        return ir.Constant(
            name=constant.name.text,
            type=type_,
            value=value,
            comment=comment(constant.annotations),
            name_span=self.file.span(constant.name),
        )
