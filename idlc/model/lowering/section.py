"""One section's lines → a message: comments find their owners, definitions their meaning."""

from __future__ import annotations

from itertools import takewhile
from typing import TypeAlias

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Edit, Report
from idlc.diagnostics.source import Span
from idlc.model import ir
from idlc.model.distro import Distro
from idlc.model.lowering import slips
from idlc.model.lowering.comments import Comment, condense, problem
from idlc.model.lowering.fault import Fault
from idlc.model.lowering.literals import Text, default, scalar
from idlc.model.lowering.types import STRINGS, as_parsed, lower_type
from idlc.syntax import tree
from idlc.syntax.parse import parse_definition

Lines: TypeAlias = tuple[tree.Line, ...]


def lower_section(
    file: tree.File, lines: Lines, name: ir.TypeName, report: Report, distro: Distro
) -> ir.Message:
    """Return the message that a section's lines define; reports what is wrong in them."""
    return _Section(file, lines, name, report, distro).lower()


class _Element(msgspec.Struct, frozen=True):
    """A definition with the lines whose comments belong to it."""

    line: tree.Line
    body: tree.Field | tree.Constant
    comments: list[tree.Line]
    optional: bool


class _Section:
    """Lowers one section; holds what its steps share."""

    def __init__(
        self, file: tree.File, lines: Lines, name: ir.TypeName, report: Report, distro: Distro
    ) -> None:
        self.file = file
        self.lines = lines
        self.name = name
        self.report = report
        self.distro = distro
        self.optional = False

    def lower(self) -> ir.Message:
        head = self._head()
        comment = self._condense([_head_text(line) for line in head], head, has_unit=False)
        fields: list[ir.Field] = []
        constants: list[ir.Constant] = []
        for element in self._elements(len(head)):
            line, body, lines = element.line, element.body, element.comments
            texts = [_comment_text(commented) for commented in lines]
            if isinstance(body, tree.Field):
                about = self._condense(texts, lines, has_unit=True)
                field = self._field(line, body, about)
                fields.append(msgspec.structs.replace(field, optional=element.optional))
            else:
                about = self._condense(texts, lines, has_unit=False)
                constant = self._constant(line, body, about)
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

    def _head(self) -> list[tree.Line]:
        """Return the comment lines at the very start, which describe the whole structure."""
        return list(takewhile(lambda line: line.comment and not line.code, self.lines))

    def _elements(self, first: int) -> list[_Element]:
        """Return the sound definitions with their comments; report the broken ones."""
        elements: list[_Element] = []
        pending: list[tree.Line] = []
        for line in self.lines[first:]:
            if line.is_indented_comment:
                if elements:
                    elements[-1].comments.append(line)
                continue
            if line.comment:
                pending.append(line)
            if line.code.startswith(tree.OPTIONAL):
                line = self._after_optional(line)
            text = line.definition
            if not text or (line.start == 0 and text[0] == tree.BYTE_ORDER_MARK):
                continue
            body = parse_definition(text)
            slip = slips.slip(text, body, self.name.kind)
            if slip is not None:
                self._add(line, 0, slip)
            elif isinstance(body, tree.Broken):
                self._broken(line, body)
            else:
                self._warn_hash(line, text)
                elements.append(_Element(line, body, pending, self.optional))
            pending = []
            self.optional = False
        return elements

    def _after_optional(self, line: tree.Line) -> tree.Line:
        from idlc.model.lowering.optional import after_optional

        is_second, self.optional = self.optional, True
        return after_optional(line, self.file.source, self.distro, self.report, is_second=is_second)

    def _condense(self, texts: list[str], lines: list[tree.Line], *, has_unit: bool) -> Comment:
        """Return an element's comment; `has_unit` is whether rosidl writes its unit anywhere."""
        comment = condense(texts)
        found = problem(comment if has_unit else msgspec.structs.replace(comment, unit=None))
        if found is not None:
            span = self._find(found.text, lines)
            self.report.add(found.code.at(span, found.message, hint=found.hint))
        return comment

    def _find(self, text: str, lines: list[tree.Line]) -> Span:
        """Return where `text` stands in the comments of these lines, or the first of them."""
        line, at = next(
            ((line, at) for line in lines if (at := line.comment.find(text)) >= 0), (lines[0], 0)
        )
        start = line.start + len(line.code) + at
        return Span(self.file.source, start, start + (len(text) if at else len(line.comment)))

    def _broken(self, line: tree.Line, body: tree.Broken) -> None:
        span = self.file.span(line, body.piece)
        found = body.code.at(span, body.message, hint=body.hint)
        self.report.add(msgspec.structs.replace(found, edits=self._edits(line, body, span)))

    def _edits(self, line: tree.Line, body: tree.Broken, span: Span) -> tuple[Edit, ...]:
        """Return the edit that makes a broken line what it was meant to be, if that is sure."""
        if body.code is codes.INDENTED_DEFINITION:
            return (Edit(span, ""),)
        if not _is_dashes(line) or line.comment:
            return ()
        lines = [one for section in self.file.sections for one in section.lines]
        count = len(self.file.separators) + sum(map(_is_dashes, lines))
        if count != ir.KINDS.index(self.name.kind):
            return ()
        return (Edit(Span(span.source, line.start, line.start + len(line.code)), "---"),)

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

    def _add_value(self, line: tree.Line, piece: tree.Piece, fault: Fault) -> None:
        if slips.has_comment(piece.text):
            fault = msgspec.structs.replace(fault, hint=slips.COMMENT_HINT)
        self._add(line, piece.start, fault)

    def _type(self, line: tree.Line, type_: tree.Type) -> ir.FieldType:
        lowered = lower_type(type_, self.name.package)
        if isinstance(lowered, Fault):
            self._add(line, 0, lowered)
            return ir.Unknown()
        if as_parsed(lowered) != lowered and type_.bound and type_.brackets:
            bound = type_.bound.text
            self.report.add(
                codes.WSTRING_SEQUENCE_BOUND.at(
                    self.file.span(line, type_.brackets),
                    f"ROS 2 reads this as a sequence of at most {bound} elements",
                    hint=f"write `[<={bound}]` to say so, or remove the string's bound",
                )
            )
        return lowered

    def _field(self, line: tree.Line, body: tree.Field, about: Comment) -> ir.Field:
        wrong = slips.field_name(body.name.text, self.file.span(line, body.name))
        self.report.extend([wrong] if wrong else [])
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
                codes.DEFAULT_ON_MESSAGE.at(
                    self.file.span(line, piece),
                    "a field of a message type cannot have a default value",
                    hint="give the defaults inside that message",
                )
            )
            return None
        found = default(type_, piece.text)
        if isinstance(found, Fault):
            self._add_value(line, piece, found)
            return None
        return found

    def _constant(self, line: tree.Line, body: tree.Constant, about: Comment) -> ir.Constant | None:
        wrong = slips.constant_name(body.name.text, self.file.span(line, body.name))
        self.report.extend([wrong] if wrong else [])
        type_ = self._constant_type(line, body.type)
        if type_ is None:
            return None
        value = scalar(type_, body.value.text)
        if isinstance(value, Fault):
            self._add_value(line, body.value, value)
            return None
        return ir.Constant(
            name=body.name.text,
            type=type_,
            value=value.value if isinstance(value, Text) else value,
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


def _is_dashes(line: tree.Line) -> bool:
    return bool(line.definition) and not line.definition.strip("-")


def _head_text(line: tree.Line) -> str:
    return line.comment.replace("\t", " ").lstrip("#")


def _comment_text(line: tree.Line) -> str:
    # only the comments at the head of a section keep the blanks at their ends
    return line.comment.replace("\t", " ").rstrip().lstrip("#")
