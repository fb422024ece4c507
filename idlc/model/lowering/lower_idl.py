"""IDL's syntax → IR: the same meaning as the interface file from which the .idl was made.

Some facts are lost in the adapter: whether a number was a `char`, the units of constants, and the
spelling of a text.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import msgspec
from lark import Token, Transformer, Tree, v_args

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.text import including
from idlc.language.escapes import inside_literal
from idlc.language.idl import IdlFile
from idlc.language.tree import OPTIONAL, Fault, Piece, piece
from idlc.model import ir, names
from idlc.model.lowering import lower_types, lower_values
from idlc.model.lowering.lower_types import STRINGS, as_parsed, positive
from idlc.model.lowering.lower_values import MAX_ELEMENTS

#: Primitives by their name in IDL; the later of two with one name, which is the plainer one.
_PRIMITIVES = {
    **{info.idl: ir.Primitive(name) for name, info in ir.PRIMITIVES.items()},
    **{
        f"{sign}{word}": ir.Primitive(f"{sign[:1]}int{bits}")
        for sign in ("", "unsigned ")
        for word, bits in (("short", 16), ("long", 32), ("long long", 64))
    },
}
#: The annotations that ROS 2's adapter writes.
ANNOTATIONS = frozenset({"verbatim", "default", "unit", "optional"})
_CONSTANTS = "_Constants"
_DUMMY = (ir.DUMMY_FIELD, ir.Primitive("uint8"))


class _Value(NamedTuple):
    """A number, `TRUE` or `FALSE` as written; or texts in quotes, one after the other."""

    texts: tuple[str, ...]
    is_text: bool
    start: int
    end: int

    @property
    def words(self) -> str:
        """The texts as one."""
        return "".join(self.texts)


class _Type(NamedTuple):
    """A type and its name in the text, for problems with it."""

    type: ir.FieldType
    piece: Piece


class _Annotation(NamedTuple):
    """`@name (parameter=value, ...)`."""

    name: Piece
    parameters: Mapping[str, _Value]


def _parameter(annotations: Iterable[_Annotation], name: str, key: str) -> _Value | None:
    """Return a parameter of the first annotation of a name, or `None`."""
    matches = (annotation.parameters for annotation in annotations if annotation.name.text == name)
    return next(matches, {}).get(key)


def _comment(annotations: Iterable[_Annotation]) -> tuple[str, ...]:
    value = _parameter(annotations, "verbatim", "text")
    if value is None:
        return ()
    # a text for each line, which may spell a line end by an escape, and line ends between them
    if len(value.texts) % 2 and {*value.texts[1::2]} <= {"\n"}:
        return value.texts[::2]
    return tuple(value.words.split("\n"))


def _inside(literal: str) -> str:
    try:
        return inside_literal(literal[1:-1])
    except ValueError:  # an incomplete escape, which rosidl would not have written
        return literal[1:-1]


def default_of_words(type_: ir.FieldType, words: str, *, is_text: bool) -> ir.Default | Fault:
    """Return the value of `@default` or of a constant, or its fault, which is all of it."""
    if not is_text and isinstance(type_, ir.Primitive):
        return lower_values.default(type_, words)
    if is_text and isinstance(type_, ir.String) and _fits(type_, words):
        return ir.Default(words, words)
    if is_text and isinstance(type_, (ir.Array, ir.Sequence)):
        values = None
        with suppress(ValueError):  # the defaults of arrays travel as the text of a tuple
            values = lower_values.python_tuple(words) if words.count(",") <= MAX_ELEMENTS else None
        if values is not None and all(_fits(type_.element, each) for each in values):
            wrong = lower_values.wrong_length(type_, len(values), words)
            return wrong or ir.Default(values, words)
    message = f"this is not a value of type `{ir.spell(type_)}`"
    return Fault(codes.BAD_VALUE, message, 0, 0)


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
            # a bool is no number here
            return type(value) is int and low <= value <= high
    return False


def lower_idl(file: IdlFile, names: Sequence[ir.TypeName], report: Report) -> list[ir.Message]:
    """Return the structures of these names from a file, which must hold no others."""
    lowering = _Lowering(file.source, names, report)
    if file.broken is None:
        # a definition of a type may come after its uses
        order = {"enum": 0, "typedef": 1}
        parts = sorted(file.tree.children, key=lambda part: order.get(getattr(part, "data", ""), 2))
        lowering.transform(Tree("file", parts))
    else:
        word = f"`{file.broken.text}`" if file.broken.text else "this end of the text"
        lowering.foreign(file.broken, word)
    return [
        msgspec.structs.replace(message, constants=tuple(lowering.constants_of[name]))
        for name, message in lowering.messages.items()
    ]


@v_args(inline=True)
class _Lowering(Transformer):  # type: ignore[type-arg]  # generic in lark 1.x only
    """Lowers the tree of one file; `foreign` reports, other public methods are grammar rules."""

    def __init__(self, source: Source, names: Sequence[ir.TypeName], report: Report) -> None:
        super().__init__()
        self.messages = {name.name: ir.Message(name=name, source=source) for name in names}
        self.constants_of: dict[str, list[ir.Constant]] = {name.name: [] for name in names}
        self._source = source
        self._top = names[0]
        self._report = report
        self._missing = [name.name for name in names]
        self._typedefs: dict[str, _Type] = {}
        self._strange = False

    def file(self, *parts: Any) -> None:
        package, kind = (piece(part) for part in parts if isinstance(part, Token))
        for name, written in ((package, self._top.package), (kind, self._top.kind)):
            if name.text != written:
                self._strange = True
                self.foreign(name, f"module `{name.text}` for `{self._top}`")
        for missing in () if self._strange else self._missing:
            self.foreign(kind, f"a module without `{missing}`")

    def typedef(self, target: _Type, name: Token, size: Token | None = None) -> None:
        self._name_type(name, target._replace(type=self._sized(target.type, name, size)))

    def enum(self, *parts: Any) -> None:
        name = next(part for part in parts if isinstance(part, Token))
        # Connext, Fast DDS and Cyclone DDS write enumerations so
        self._name_type(name, _Type(ir.Primitive("uint32"), piece(name)))

    def _name_type(self, name: Token, target: _Type) -> None:
        if self._typedefs.get(str(name), target).type != target.type:
            self.foreign(piece(name), f"a duplicate `{name}`")
        self._typedefs[str(name)] = target

    def _sized(self, type_: ir.FieldType, name: Token, size: Token | None) -> ir.FieldType:
        """Return an array of a type; the type itself without a size."""
        length = self._positive(size, "the array's size")
        if length is None:
            return type_
        if isinstance(type_, (ir.Array, ir.Sequence)):
            self.foreign(piece(name), "an array of arrays")
            return ir.Unknown()
        return type_ if isinstance(type_, ir.Unknown) else ir.Array(type_, length)

    def sequence(self, element: _Type, bound: Token | None = None) -> _Type:
        if isinstance(element.type, (ir.Array, ir.Sequence)):
            self.foreign(element.piece, "a sequence of arrays")
            return _Type(ir.Unknown(), element.piece)
        most = self._positive(bound, "the array's size")
        return _Type(as_parsed(ir.Sequence(element.type, most)), element.piece)

    def element(self, *tokens: Token) -> _Type:
        bound = tokens[-1] if tokens[-1].type == "SIZE" else None
        parts = [str(token) for token in tokens if token is not bound]
        whole = Piece(" ".join("::".join(parts).split()), piece(tokens[0]).start)
        if whole.text in STRINGS:
            length = self._positive(bound, "the string's bound")
            return _Type(ir.String(STRINGS[whole.text], length), whole)
        if bound is None:
            if whole.text in _PRIMITIVES:
                return _Type(_PRIMITIVES[whole.text], whole)
            if whole.text in self._typedefs:
                return self._typedefs[whole.text]
            if parts[:-1] == [self._top.package, self._top.kind] and parts[-1] in self._typedefs:
                return self._typedefs[parts[-1]]
            package, kind, name = parts if len(parts) == 3 else ("", "", "")
            if kind == "msg" and names.is_package_name(package) and names.is_message_name(name):
                return _Type(ir.Ref(ir.TypeName(package, "msg", name)), whole)
        self.foreign(whole, f"the type `{whole.text}`")
        return _Type(ir.Unknown(), whole)

    def annotation(self, name: Token, *parameters: tuple[str, _Value]) -> _Annotation:
        return _Annotation(piece(name), dict(parameters))

    def parameter(self, name: Token, value: _Value) -> tuple[str, _Value]:
        return str(name), value

    def value(self, *tokens: Token) -> _Value:
        is_text = tokens[0].type == "STRING"
        texts = tuple(map(_inside if is_text else str, tokens))
        return _Value(texts, is_text, piece(tokens[0]).start, piece(tokens[-1]).end)

    def struct(self, *parts: Any) -> None:
        at = next(i for i, part in enumerate(parts) if isinstance(part, Token))
        name = str(parts[at])
        if message := self._message(parts[at], name):
            if name not in self._missing:
                self.foreign(piece(parts[at]), f"a duplicate `{name}`")
                return
            self._missing.remove(name)
            fields = parts[at + 1 :]
            if [(field.name, field.type) for field in fields] == [_DUMMY]:
                fields = ()
            comment = _comment(parts[:at])
            self.messages[name] = msgspec.structs.replace(message, fields=fields, comment=comment)

    def constants(self, token: Token, *constants: ir.Constant | None) -> None:
        name = token.removesuffix(_CONSTANTS)
        if self._message(token, name):
            self.constants_of[name] += filter(None, constants)

    def member(self, *parts: Any) -> ir.Field:
        size = parts[-1] if parts[-1].type == "SIZE" else None
        *annotations, (type_, at), token = parts if size is None else parts[:-1]
        type_ = self._sized(type_, token, size)
        name = self._name(token, annotations, lower_types.field_name)
        value = _parameter(annotations, "default", "value")
        unit = _parameter(annotations, "unit", "value")
        return ir.Field(
            name=name.text,
            type=type_,
            default=value and self._default(type_, value),
            comment=_comment(annotations),
            unit=unit and unit.words,
            optional=any(annotation.name.text == OPTIONAL[1:] for annotation in annotations),
            name_span=self._span(name),
            type_span=self._span(at),
        )

    def constant(self, *parts: Any) -> ir.Constant | None:
        *annotations, (type_, at), token, value = parts
        name = self._name(token, annotations, lower_types.constant_name)
        if not isinstance(type_, (ir.Primitive, ir.String)):
            self.foreign(at, f"a constant of the type `{at.text}`")
            return None
        lowered = self._default(type_, value)
        if lowered is None:
            return None
        assert not isinstance(lowered.value, tuple)
        return ir.Constant(
            name=name.text,
            type=type_,
            value=lowered.value,
            comment=_comment(annotations),
            name_span=self._span(name),
        )

    def foreign(self, part: Piece | _Value, subject: str) -> None:
        message = f"ROS 2 never generates {subject} from a .msg file"
        advice = f"{including('DIR')}, where DIR contains the package's .msg files"
        hint = f"idlc reads only IDL that ROS 2 generates; {advice}"
        self._report.add(codes.FOREIGN_IDL.at(self._span(part), message, hint=hint))

    def _fault(self, fault: Fault) -> None:
        span = Span(self._source, fault.start, fault.end)
        self._report.add(fault.code.at(span, fault.message, hint=fault.hint))

    def _span(self, part: Piece | _Value) -> Span:
        return Span(self._source, part.start, part.end)

    def _message(self, token: Token, name: str) -> ir.Message | None:
        if name not in self.messages:
            self._strange = True
            self.foreign(piece(token), f"`{token}` among the parts of `{self._top}`")
        return self.messages.get(name)

    def _positive(self, token: Token | None, subject: str) -> int | None:
        size = None if token is None else positive(piece(token), subject)
        if not isinstance(size, Fault):
            return size
        self._fault(size)
        return None

    def _name(
        self,
        token: Token,
        annotations: Iterable[_Annotation],
        fault_of: Callable[[str], Fault | None],
    ) -> Piece:
        """Return a name; report one that ROS 2 does not allow, and unknown annotations.

        ROS 2 ignores annotations in files that people wrote.
        """
        for annotation in annotations:
            if self._source.is_recorded and annotation.name.text not in ANNOTATIONS:
                self.foreign(annotation.name, f"the annotation `@{annotation.name.text}`")
        name = piece(token)
        fault = None if names.is_recorded_name(name.text) else fault_of(name.text)
        if fault:
            self._fault(fault.moved(name.start))
        return name

    def _default(self, type_: ir.FieldType, value: _Value) -> ir.Default | None:
        element = ir.element_of(type_)
        if isinstance(element, ir.Ref):
            self.foreign(value, "a default for a message")
        if isinstance(element, (ir.Ref, ir.Unknown)):
            return None
        lowered = default_of_words(type_, value.words, is_text=value.is_text)
        if isinstance(lowered, Fault):
            self._fault(msgspec.structs.replace(lowered, start=value.start, end=value.end))
            return None
        return lowered
