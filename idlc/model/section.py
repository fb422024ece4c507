"""One section's lines → a message: comments find their owners, definitions their meaning."""

from __future__ import annotations

import math
from typing import NamedTuple

from idlc.model import ir, names
from idlc.model.comments import Comment, condense
from idlc.model.literals import BACKSLASH_HINT, FLOAT32_MAX, Fault, Text, default, scalar
from idlc.model.types import STRINGS, as_parsed, lower_type
from idlc.syntax import tree
from idlc.syntax.escapes import EscapeError, plain_meaning, through_idl
from idlc.syntax.parse import parse_definition
from idlc.text import codes
from idlc.text.diagnostics import Report
from idlc.text.source import Span

_BROKEN = {
    code.slug: code
    for code in (
        codes.MISSING_NAME,
        codes.INDENTED_DEFINITION,
        codes.MALFORMED_TYPE,
        codes.MALFORMED_SEPARATOR,
    )
}


def lower_section(
    file: tree.File, section: tree.Section, name: ir.TypeName, report: Report
) -> ir.Message:
    """Return the message that a section defines; reports what is wrong in it."""
    return _Section(file, section, name, report).lower()


class _Element(NamedTuple):
    """A definition with the comment lines that belong to it."""

    line: tree.Line
    body: tree.Field | tree.Constant
    comments: list[str]


class _Section:
    """Lowers one section; holds what its steps share."""

    def __init__(
        self, file: tree.File, section: tree.Section, name: ir.TypeName, report: Report
    ) -> None:
        self.file = file
        self.lines = section.lines
        self.name = name
        self.report = report

    def lower(self) -> ir.Message:
        head = self._head()
        comment = condense(head)
        self._check_comment(comment._replace(unit=None), self.lines[: len(head)])
        fields: list[ir.Field] = []
        constants: list[ir.Constant] = []
        for element in self._elements(len(head)):
            about = condense(element.comments)
            if isinstance(element.body, tree.Field):
                self._check_comment(about, (element.line,))
                fields.append(self._field(element.line, element.body, about))
            else:
                # rosidl writes no unit for a constant, so a bad one does no harm
                self._check_comment(about._replace(unit=None), (element.line,))
                constant = self._constant(element.line, element.body, about)
                if constant is not None:
                    constants.append(constant)
        return ir.Message(
            name=self.name,
            fields=tuple(fields),
            constants=tuple(constants),
            comment=comment.lines,
            unit=comment.unit,
            source=self.file.source,
        )

    def _head(self) -> list[str]:
        """Return the comment lines at the very start, which describe the whole structure."""
        head: list[str] = []
        for line in self.lines:
            if line.code or not line.comment:
                break
            head.append(line.comment.replace("\t", " ").lstrip("#"))
        return head

    def _elements(self, first: int) -> list[_Element]:
        """Return the sound definitions with their comments; report the broken ones."""
        elements: list[_Element] = []
        pending: list[str] = []
        for line in self.lines[first:]:
            comment = line.comment.replace("\t", " ").rstrip().lstrip("#")
            if line.is_indented_comment:
                if elements:
                    elements[-1].comments.append(comment)
                continue
            if line.comment:
                pending.append(comment)
            text = line.definition
            if not text:
                continue
            body = parse_definition(text)
            if isinstance(body, tree.Broken):
                self._broken(line, body)
            else:
                self._warn_hash(line, text)
                elements.append(_Element(line, body, pending))
            pending = []
        return elements

    def _broken(self, line: tree.Line, body: tree.Broken) -> None:
        span = self.file.span(line, body.piece)
        self.report.add(_BROKEN[body.slug].at(span, body.message, hint=body.hint))

    def _warn_hash(self, line: tree.Line, text: str) -> None:
        """Warn when a comment begins between quotes that the writer saw as a pair."""
        opened = [quote for quote in "\"'" if text.count(quote) % 2 and quote in line.comment]
        if opened:
            at = line.start + len(line.code)
            self.report.add(
                codes.HASH_IN_QUOTES.at(
                    Span(self.file.source, at, at + 1),
                    "a comment begins here, although it is inside quotes",
                    hint="ROS 2 has no way to write `#` in a value; leave it out",
                )
            )

    def _add(self, line: tree.Line, offset: int, fault: Fault) -> None:
        piece = tree.Piece(" " * max(fault.end - fault.start, 0), offset + fault.start)
        self.report.add(fault.code.at(self.file.span(line, piece), fault.message, hint=fault.hint))

    def _type(self, line: tree.Line, type_: tree.Type) -> ir.FieldType:
        lowered = lower_type(type_, self.name.package)
        if isinstance(lowered, Fault):
            self._add(line, 0, lowered)
            return ir.Unknown()
        if as_parsed(lowered) != lowered and type_.bound and type_.brackets:
            bound = type_.bound.text
            self.report.add(
                codes.WSTRING_BOUND.at(
                    self.file.span(line, type_.brackets),
                    f"ROS 2 reads this as a sequence of at most {bound} elements",
                    hint=f"write `[<={bound}]` to say so, or remove the string's bound",
                )
            )
        return lowered

    def _field(self, line: tree.Line, body: tree.Field, about: Comment) -> ir.Field:
        if not names.is_field_name(body.name.text):
            like = names.field_name_like(body.name.text)
            self.report.add(
                codes.FIELD_NAME.at(
                    self.file.span(line, body.name),
                    f"`{body.name.text}` cannot be a field name",
                    hint=f"write `{like}`" if names.is_field_name(like) else names.FIELD_HINT,
                )
            )
        type_ = self._type(line, body.type)
        return ir.Field(
            name=body.name.text,
            type=as_parsed(type_),
            default=None if body.default is None else self._default(line, type_, body.default),
            comment=about.lines,
            unit=about.unit,
            name_span=self.file.span(line, body.name),
            type_span=self.file.span(line, body.type.name),
            default_span=None if body.default is None else self.file.span(line, body.default),
        )

    def _default(
        self, line: tree.Line, type_: ir.FieldType, piece: tree.Piece
    ) -> ir.Default | None:
        element = ir.element_of(type_)
        if isinstance(element, ir.Unknown):
            return None
        if isinstance(element, ir.Ref):
            self.report.add(
                codes.MESSAGE_DEFAULT.at(
                    self.file.span(line, piece),
                    "a field of a message type cannot have a default value",
                    hint="give the defaults inside that message",
                )
            )
            return None
        found = default(type_, piece.text)
        if isinstance(found, Fault):
            self._add(line, piece.start, found)
            return None
        self._warn_value(self.file.span(line, piece), element, found.value, piece.text)
        return found

    def _constant(self, line: tree.Line, body: tree.Constant, about: Comment) -> ir.Constant | None:
        if not names.is_constant_name(body.name.text):
            upper = names.field_name_like(body.name.text).upper()
            hint = f"write `{upper}`" if names.is_constant_name(upper) else names.CONSTANT_HINT
            self.report.add(
                codes.CONSTANT_NAME.at(
                    self.file.span(line, body.name),
                    f"`{body.name.text}` cannot be a constant name",
                    hint=hint,
                )
            )
        type_ = self._constant_type(line, body.type)
        if type_ is None:
            return None
        value = scalar(type_, body.value.text)
        if isinstance(value, Fault):
            self._add(line, body.value.start, value)
            return None
        plain = value.value if isinstance(value, Text) else value
        self._warn_value(self.file.span(line, body.value), type_, plain, body.value.text)
        return ir.Constant(
            name=body.name.text,
            type=type_,
            value=plain,
            comment=about.lines,
            unit=about.unit,
            name_span=self.file.span(line, body.name),
            value_span=self.file.span(line, body.value),
        )

    def _constant_type(self, line: tree.Line, type_: tree.Type) -> ir.Primitive | ir.String | None:
        name = type_.whole.text
        if name in ir.PRIMITIVES:
            return ir.Primitive(name)
        if name in STRINGS:
            return ir.String(STRINGS[name])
        self.report.add(
            codes.CONSTANT_TYPE.at(
                self.file.span(line, type_.whole),
                f"a constant cannot be of type `{name}`",
                hint="use bool, byte, char, an integer, a float, string or wstring",
            )
        )
        return None

    def _warn_value(self, span: Span, type_: ir.Element, value: ir.Value, text: str) -> None:
        values = value if isinstance(value, tuple) else (value,)
        numbers = [number for number in values if isinstance(number, float)]
        if any(not math.isfinite(number) for number in numbers):
            self.report.add(
                codes.NON_FINITE.at(
                    span,
                    f"`{text}` is not finite; what rosidl generates for it does not compile",
                    hint="use a large finite number, or set the value in code",
                )
            )
        elif type_ == ir.Primitive("float32") and any(abs(n) > FLOAT32_MAX for n in numbers):
            self.report.add(
                codes.FLOAT32_RANGE.at(
                    span, f"`{text}` is beyond what a float32 holds", hint="use float64"
                )
            )
        elif isinstance(value, str) and "\\" in text and value != plain_meaning(_unquoted(text)):
            self.report.add(
                codes.MANGLED_TEXT.at(
                    span,
                    f"ROS 2 interprets the backslashes more than once and reads {value!r}",
                    hint=BACKSLASH_HINT,
                )
            )

    def _check_comment(self, comment: Comment, lines: tuple[tree.Line, ...]) -> None:
        """Report comments and units that break the pipeline (spec 1.4, 1.5)."""
        if comment.unit is not None and "\n" in comment.unit:
            self._comment_fault(
                codes.UNIT_ACROSS_LINES,
                "[",
                lines,
                "a bracket that closes in another line becomes a unit with a line break, "
                "on which ROS 2's tools fail",
                "close the bracket in the same line",
            )
            return
        for text in (*comment.lines, *([comment.unit] if comment.unit else [])):
            try:
                through_idl(text)
            except EscapeError as error:
                self._comment_fault(
                    codes.BAD_ESCAPE,
                    text[error.start : error.end],
                    lines,
                    f"ROS 2's tools fail on {error} in a comment",
                    "write the path or formula without backslashes",
                )
                return

    def _comment_fault(
        self, code: codes.Code, text: str, lines: tuple[tree.Line, ...], message: str, hint: str
    ) -> None:
        span = self._find_in_comments(text, lines)
        self.report.add(code.at(span, message, hint=hint))

    def _find_in_comments(self, text: str, lines: tuple[tree.Line, ...]) -> Span:
        """Return where `text` stands in these comments or in those before them."""
        source = self.file.source
        end = self.lines.index(lines[-1]) if lines else 0
        candidates = (*lines, *reversed(self.lines[:end]), *self.lines[end:])
        for line in candidates:
            at = line.comment.replace("\t", " ").find(text)
            if text and at >= 0:
                start = line.start + len(line.code) + at
                return Span(source, start, start + len(text))
        line = candidates[0]
        start = line.start + len(line.code)
        return Span(source, start, start + len(line.comment))


def _unquoted(text: str) -> str:
    if len(text) > 1 and text[0] == text[-1] and text[0] in "\"'":
        return text[1:-1]
    return text
