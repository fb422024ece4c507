"""IDL's syntax → IR: the same meaning as that of the interface file that the .idl was made of.

What the adapter loses on the way stays lost: whether a number was a `char`, the units of
constants, and how a text was written.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Span
from idlc.diagnostics.suggest import including
from idlc.model import ir, names
from idlc.model.lowering import idl_values, slips
from idlc.model.lowering.fault import Fault
from idlc.model.lowering.types import STRINGS, as_parsed, positive
from idlc.syntax import idl_tree
from idlc.syntax.tree import OPTIONAL, Piece

#: What IDL calls primitives; of two that it calls alike, the one that says what it is.
_PRIMITIVES = {info.idl: ir.Primitive(name) for name, info in ir.PRIMITIVES.items()}
_CONSTANTS = "_Constants"


def lower_idl(
    file: idl_tree.File, wanted: Sequence[ir.TypeName], report: Report
) -> list[ir.Message]:
    """Return the wanted structures of a file, which must hold these and no others."""
    return _Lowering(file, report).structures(wanted)


class _Type(NamedTuple):
    """A type and what names it, for problems with it."""

    type: ir.FieldType
    piece: Piece


class _Lowering:
    """Lowers one file; holds what its steps share."""

    def __init__(self, file: idl_tree.File, report: Report) -> None:
        self.file = file
        self.report = report
        self.typedefs: dict[str, _Type] = {}
        self.strange = False

    def structures(self, wanted: Sequence[ir.TypeName]) -> list[ir.Message]:
        if self.file.broken is not None:
            what = f"`{self.file.broken.text}`" if self.file.broken.text else "this end of the text"
            self._foreign(self.file.broken, what)
            return [ir.Message(name=name, source=self.file.source) for name in wanted]
        self._check_modules(wanted[0])
        constants: dict[str, list[ir.Constant]] = {}
        found: dict[str, idl_tree.Structure] = {}
        known = {name.name for name in wanted}
        for part in self.file.parts:
            name = part.name.text.removesuffix(_CONSTANTS)
            if isinstance(part, idl_tree.Typedef):
                self._typedef(part)
            elif name not in known:
                self._foreign(part.name, f"`{part.name.text}` among the parts of `{wanted[0]}`")
            elif isinstance(part, idl_tree.Constants):
                lowered = map(self._constant, part.constants)
                constants.setdefault(name, []).extend(one for one in lowered if one)
            elif found.setdefault(name, part) is not part:
                self._foreign(part.name, f"a second `{name}`")
        if not self.strange:
            for name in known - found.keys():
                self._foreign(self.file.kind, f"a module without `{name}`")
        return [self._structure(name, found.get(name.name), constants) for name in wanted]

    def _check_modules(self, name: ir.TypeName) -> None:
        for piece, expected in ((self.file.package, name.package), (self.file.kind, name.kind)):
            if piece.text != expected:
                self._foreign(piece, f"module `{piece.text}` for `{name}`")

    def _foreign(self, piece: Piece, what: str) -> None:
        self.strange = True
        message = f"{what} is nothing that ROS 2 writes when it makes IDL of a .msg file"
        hint = f"idlc reads no other IDL; {including('DIR')} with the package's .msg files"
        self.report.add(codes.FOREIGN_IDL.at(self.file.span(piece), message, hint=hint))

    def _fault(self, fault: Fault) -> None:
        span = Span(self.file.source, fault.start, fault.end)
        self.report.add(fault.code.at(span, fault.message, hint=fault.hint))

    def _structure(
        self,
        name: ir.TypeName,
        found: idl_tree.Structure | None,
        constants: dict[str, list[ir.Constant]],
    ) -> ir.Message:
        fields = [self._field(member) for member in found.members] if found else []
        if [(field.name, field.type) for field in fields] == [
            (ir.DUMMY_FIELD, ir.Primitive("uint8"))
        ]:
            fields = []
        return ir.Message(
            name=name,
            fields=tuple(fields),
            constants=tuple(constants.get(name.name, ())),
            comment=idl_values.comment(found.annotations) if found else (),
            source=self.file.source,
        )

    def _typedef(self, typedef: idl_tree.Typedef) -> None:
        target = self._type(typedef.type)
        type_ = target.type
        if typedef.size is not None:
            size = positive(typedef.size, "the array's size")
            if isinstance(size, Fault):
                self._fault(size)
            elif isinstance(type_, (ir.Array, ir.Sequence)):
                self._foreign(typedef.name, "an array of arrays")
                type_ = ir.Unknown()
            else:
                type_ = ir.Array(type_, size)
        self.typedefs[typedef.name.text] = _Type(type_, target.piece)

    def _type(self, type_: idl_tree.Element | idl_tree.Sequence) -> _Type:
        if isinstance(type_, idl_tree.Element):
            return self._element(type_)
        element, piece = self._element(type_.element)
        if isinstance(element, (ir.Array, ir.Sequence)):
            self._foreign(piece, "a sequence of arrays")
            return _Type(ir.Unknown(), piece)
        bound = None if type_.bound is None else positive(type_.bound, "the array's size")
        if isinstance(bound, Fault):
            self._fault(bound)
            return _Type(ir.Unknown(), piece)
        return _Type(as_parsed(ir.Sequence(element, bound)), piece)

    def _element(self, element: idl_tree.Element) -> _Type:
        piece = element.name
        if piece.text in STRINGS:
            bound = None if element.bound is None else positive(element.bound, "the string's bound")
            if isinstance(bound, Fault):
                self._fault(bound)
                return _Type(ir.Unknown(), piece)
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

    def _field(self, member: idl_tree.Member) -> ir.Field:
        self._check_annotations(member.annotations)
        type_, piece = self._type(member.type)
        span = self.file.span(member.name)
        wrong = slips.field_name(member.name.text, span)
        self.report.extend([wrong] if wrong else [])
        return ir.Field(
            name=member.name.text,
            type=type_,
            default=self._default(type_, member.annotations),
            comment=idl_values.comment(member.annotations),
            unit=idl_values.unit(member.annotations),
            optional=any(f"@{one.name.text}" == OPTIONAL for one in member.annotations),
            name_span=span,
            type_span=self.file.span(piece),
        )

    def _check_annotations(self, annotations: Sequence[idl_tree.Annotation]) -> None:
        for one in annotations:
            if one.name.text not in idl_values.ANNOTATIONS:
                self._foreign(one.name, f"the annotation `@{one.name.text}`")

    def _default(
        self, type_: ir.FieldType, annotations: Sequence[idl_tree.Annotation]
    ) -> ir.Default | None:
        value = idl_values.parameter(annotations, "default", "value")
        element = ir.element_of(type_)
        if value is None or isinstance(element, ir.Unknown):
            return None
        if isinstance(element, ir.Ref):
            self._foreign(value.whole, "a default for a message")
            return None
        found = idl_values.default(type_, value)
        if isinstance(found, Fault):
            self._fault(found)
            return None
        return found

    def _constant(self, constant: idl_tree.Constant) -> ir.Constant | None:
        self._check_annotations(constant.annotations)
        span = self.file.span(constant.name)
        wrong = slips.constant_name(constant.name.text, span)
        self.report.extend([wrong] if wrong else [])
        type_, piece = self._type(constant.type)
        if not isinstance(type_, (ir.Primitive, ir.String)):
            self._foreign(piece, f"a constant of the type `{piece.text}`")
            return None
        value = idl_values.scalar(type_, constant.value)
        if isinstance(value, Fault):
            self._fault(value)
            return None
        return ir.Constant(
            name=constant.name.text,
            type=type_,
            value=value,
            comment=idl_values.comment(constant.annotations),
            name_span=span,
        )
