"""One section's lines → a message: comments find their owners, definitions their meaning."""

from __future__ import annotations

from collections import Counter
from itertools import takewhile
from typing import TYPE_CHECKING, TypeAlias

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Edit, Report
from idlc.diagnostics.source import Span
from idlc.language import tree
from idlc.language.escapes import EscapeError, through_idl
from idlc.language.tree import Fault
from idlc.model import ir, names
from idlc.model.comments import Comment, condense, problem
from idlc.model.distros import DEFAULT, Distro
from idlc.model.lowering import lower_types
from idlc.model.lowering.lower_types import STRINGS, as_parsed, fault_at, lower_type
from idlc.model.lowering.lower_values import default, scalar

if TYPE_CHECKING:
    from idlc.language import idl


#: A definition on its line, the lines whose comments belong to it, and whether it is `@optional`.
_Element: TypeAlias = tuple[tree.Line, tree.Field | tree.Constant, list[tree.Line], bool]


class _Section(msgspec.Struct):
    """Lowers one section; holds what its steps share."""

    file: tree.File
    lines: tuple[tree.Line, ...]
    name: ir.TypeName
    report: Report
    distro: Distro

    def lower(self) -> ir.Message:
        # the comment lines at the very start describe the whole structure
        head = list(takewhile(lambda line: line.comment and not line.code, self.lines))
        texts = [line.comment.replace("\t", " ").lstrip("#") for line in head]
        comment = self._condense(texts, head, has_unit=False)
        fields: list[ir.Field] = []
        constants: list[ir.Constant] = []
        for line, body, lines, optional in self._elements(len(head)):
            # only the comments at the head of a section keep their trailing whitespace
            texts = [line.comment.replace("\t", " ").rstrip().lstrip("#") for line in lines]
            about = self._condense(texts, lines, has_unit=isinstance(body, tree.Field))
            if isinstance(body, tree.Field):
                fields.append(self._field(line, body, about, optional=optional))
            elif constant := self._constant(line, body, about):
                constants.append(constant)
        return ir.Message(
            name=self.name,
            fields=tuple(fields),
            constants=tuple(constants),
            comment=comment.lines,
            unit=comment.unit,
            source=self.file.source,
        )

    def _elements(self, first: int) -> list[_Element]:
        """Return the sound definitions with their comments; report the broken ones."""
        from idlc.language.definition import parse_definition  # loads lark

        elements: list[_Element] = []
        latest: list[tree.Line] = []  # the comments of the last definition
        pending: list[tree.Line] = []
        optional = False
        for line in self.lines[first:]:
            if line.is_indented_comment:
                latest.append(line)
                continue
            if line.comment:
                pending.append(line)
            if (rest := line.after_optional) is not None:
                self._report_optional(line, is_second=optional)
                optional, line = True, rest
                if line.after_optional is not None:
                    self._report_optional(line, is_second=True)
                    line = msgspec.structs.replace(line, code="")
            text = line.definition
            if not text or (line.start == 0 and text[0] == tree.BYTE_ORDER_MARK):
                continue
            body = parse_definition(text)
            slip = lower_types.find_slip(text, body, self.name.kind)
            if slip and not (isinstance(body, tree.Constant) and self._is_recorded(body.name)):
                self._add(line, 0, slip)
            elif isinstance(body, Fault):
                self._add(line, 0, body, self._edits(line, body))
            else:
                self._warn_hash(line, text)
                elements.append((line, body, pending, optional))
                latest = pending
            pending = []
            optional = False
        return elements

    def _report_optional(self, line: tree.Line, *, is_second: bool) -> None:
        end = len(tree.OPTIONAL)
        edits: tuple[Edit, ...] = ()
        if not self.distro.reads_optional:
            code = codes.OPTIONAL_NEEDS_LYRICAL
            message = (
                f"ROS 2 {self.distro.title} does not support `@optional`, which Lyrical introduced"
            )
            hint = "remove it; it has no effect in Lyrical either"
            blanks = len(line.code) - end - len(line.code[end:].lstrip(" \t"))
            edits = (Edit(self._span(line, 0, end + blanks), ""),)
        elif is_second:
            code = codes.REPEATED_OPTIONAL
            message, hint = "a definition can have `@optional` only once", "remove it here"
        else:
            code = codes.OPTIONAL_WITHOUT_EFFECT
            message = "ROS 2 accepts `@optional` and ignores it"
            hint = "for an optional value, use `T[<=1]` or a second field of type bool"
        self._add(line, 0, Fault(code, message, 0, end, hint), edits)

    def _condense(self, texts: list[str], lines: list[tree.Line], *, has_unit: bool) -> Comment:
        """Return an element's comment; `has_unit`: rosidl writes its unit somewhere."""
        comment = condense(texts)
        defect = problem(comment if has_unit else msgspec.structs.replace(comment, unit=None))
        if defect is not None:
            text, fault = defect
            # the range of the text at fault in the comments, or the first comment
            places = ((line, line.comment.find(text)) for line in lines)
            line, at = next((place for place in places if place[1] >= 0), (lines[0], 0))
            end = at + len(text) if at else len(line.comment)
            self._add(line, len(line.code), msgspec.structs.replace(fault, start=at, end=end))
        return comment

    def _edits(self, line: tree.Line, fault: Fault) -> tuple[Edit, ...]:
        """Return the edit that repairs a broken line, if its intention is sure."""
        if fault.code is codes.INDENTED_DEFINITION:
            return (Edit(self._span(line, fault.start, fault.end), ""),)
        if not _is_dashes(line) or line.comment:
            return ()
        lines = [other for section in self.file.sections for other in section.lines]
        count = len(self.file.separators) + sum(map(_is_dashes, lines))
        if count != ir.KINDS.index(self.name.kind):
            return ()
        return (Edit(self._span(line, 0, len(line.code)), "---"),)

    def _warn_hash(self, line: tree.Line, text: str) -> None:
        """Warn when a comment begins between two quotes."""
        if any(text.count(quote) % 2 and quote in line.comment for quote in "\"'"):
            message = "a comment begins here, even inside quotes"
            hint = "remove the `#`; in ROS 2, a value cannot contain this character"
            self._add(line, len(line.code), Fault(codes.HASH_IN_QUOTES, message, 0, 1, hint))

    def _span(self, line: tree.Line, start: int, end: int) -> Span:
        return Span(self.file.source, line.start + start, line.start + max(start, end))

    def _add(
        self, line: tree.Line, offset: int, fault: Fault | None, edits: tuple[Edit, ...] = ()
    ) -> None:
        if fault is not None:
            span = self._span(line, offset + fault.start, offset + fault.end)
            self.report.add(fault.code.at(span, fault.message, hint=fault.hint, edits=edits))

    def _is_recorded(self, name: tree.Piece) -> bool:
        """Return whether a name was recorded, and is harmless although ROS 2 may not allow it."""
        return self.file.source.is_recorded and names.is_recorded_name(name.text)

    def _add_value(self, line: tree.Line, piece: tree.Piece, fault: Fault) -> None:
        if lower_types.has_comment(piece.text):
            fault = msgspec.structs.replace(fault, hint=lower_types.COMMENT_HINT)
        self._add(line, piece.start, fault)

    def _type(self, line: tree.Line, type_: tree.Type) -> ir.FieldType:
        lowered = lower_type(type_, self.name.package)
        if isinstance(lowered, Fault):
            self._add(line, 0, lowered)
            return ir.Unknown()
        if as_parsed(lowered) != lowered and type_.bound and type_.brackets:
            bound = type_.bound.text
            message = f"ROS 2 reads this as a sequence of at most {bound} elements"
            hint = f"write `[<={bound}]` if this is intentional, or remove the bound of the string"
            self._add(
                line, 0, fault_at(codes.WSTRING_SEQUENCE_BOUND, type_.brackets, message, hint)
            )
        return lowered

    def _field(
        self, line: tree.Line, body: tree.Field, about: Comment, *, optional: bool
    ) -> ir.Field:
        if not self._is_recorded(body.name):
            self._add(line, body.name.start, lower_types.field_name(body.name.text))
        type_ = self._type(line, body.type)
        return ir.Field(
            name=body.name.text,
            type=as_parsed(type_),
            default=None if body.default is None else self._default(line, type_, body.default),
            comment=about.lines,
            unit=about.unit,
            optional=optional,
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
            message = "a field of a message type cannot have a default value"
            hint = "set the default values in that message"
            self._add(line, 0, fault_at(codes.DEFAULT_ON_MESSAGE, piece, message, hint))
            return None
        lowered = default(type_, piece.text)
        if isinstance(lowered, Fault):
            self._add_value(line, piece, lowered)
            return None
        return lowered

    def _constant(self, line: tree.Line, body: tree.Constant, about: Comment) -> ir.Constant | None:
        if not self._is_recorded(body.name):
            self._add(line, body.name.start, lower_types.constant_name(body.name.text))
        name = body.type.whole.text
        if name not in ir.PRIMITIVES and name not in STRINGS:
            message = f"a constant cannot be of type `{name}`"
            hint = "use bool, byte, char, an integer, a float, string or wstring"
            self._add(line, 0, fault_at(codes.CONSTANT_TYPE, body.type.whole, message, hint))
            return None
        type_ = ir.String(STRINGS[name]) if name in STRINGS else ir.Primitive(name)
        value = scalar(type_, body.value.text)
        if isinstance(value, Fault):
            self._add_value(line, body.value, value)
            return None
        return ir.Constant(
            name=body.name.text,
            type=type_,
            value=value,
            comment=about.lines,
            unit=about.unit,
            name_span=self.file.span(line, body.name),
            value_span=self.file.span(line, body.value),
        )


def _is_dashes(line: tree.Line) -> bool:
    return bool(line.definition) and not line.definition.strip("-")


SECTIONS: dict[ir.Kind, tuple[str, ...]] = {
    "msg": ("",),
    "srv": ("_Request", "_Response"),
    "action": ("_Goal", "_Result", "_Feedback"),
}


_NUMBERS = ("no", "one", "two")


def lower(
    file: tree.File | idl.IdlFile, name: ir.TypeName, report: Report, distro: Distro = DEFAULT
) -> ir.Interface:
    """Return the interface that a file defines for a distribution; missing sections are empty.

    Reports everything that is wrong inside the file; types of other files are `link`'s.
    """
    structures = [name._replace(name=name.name + suffix) for suffix in SECTIONS[name.kind]]
    if isinstance(file, tree.File):
        _check_reading(file, report)
        _check_separators(file, name.kind, report)
        lines = [section.lines for section in file.sections] + [()] * len(structures)
        parts = [
            _Section(file, own, structure, report, distro).lower()
            for structure, own in zip(structures, lines, strict=False)
        ]
    else:
        from idlc.model.lowering.lower_idl import lower_idl  # only recordings hold IDL

        parts = lower_idl(file, structures, report)
    parts = _without_moved_constants(parts, report)
    if name.kind == "msg":
        return parts[0]
    if name.kind == "srv":
        return ir.Service(name=name, request=parts[0], response=parts[1], source=file.source)
    goal, result, feedback = parts
    return ir.Action(name=name, goal=goal, result=result, feedback=feedback, source=file.source)


def _check_reading(file: tree.File, report: Report) -> None:
    source = file.source
    if source.text.startswith(tree.BYTE_ORDER_MARK):
        span = Span(source, 0, 1)
        message = "the file begins with a byte order mark"
        hint = "save it as UTF-8 without a byte order mark"
        report.add(codes.BYTE_ORDER_MARK.at(span, message, hint=hint, edits=(Edit(span, ""),)))
    for section in file.sections:
        for line in section.lines:
            if line.newline not in ("\n", "\r\n", "\r"):
                end = line.start + len(line.code) + len(line.comment)
                message = f"U+{ord(line.newline):04X} ends a line here"
                hint = "remove the character, or start a new line"
                span = Span(source, end, end + 1)
                report.add(codes.UNUSUAL_LINE_END.at(span, message, hint=hint))


def _check_separators(file: tree.File, kind: ir.Kind, report: Report) -> None:
    count, needed = len(file.separators), ir.KINDS.index(kind)
    if count == needed or file.source.text.startswith(tree.BYTE_ORDER_MARK + "-"):
        return
    lines = (line for section in file.sections[: needed + 1] for line in section.lines)
    if any(map(_is_dashes, lines)):
        return  # it resembles a separator, and is reported as such
    message = f"a .{kind} file has {_NUMBERS[needed]} `---` line{'s' * (needed > 1)}"
    if count > needed:
        at = file.separators[needed]
        span = Span(file.source, at, at + 3)
        hint = "remove it" if needed else "put services in .srv and actions in .action files"
        message += "; this one is too many" * (needed > 0)
    else:
        span = Span(file.source, len(file.source.text), len(file.source.text))
        hint = "write `---` on a line of its own between the sections"
        message += f"; this file has {_NUMBERS[count] if count else 'none'}"
    report.add(codes.SEPARATOR_COUNT.at(span, message, hint=hint))


def _without_moved_constants(parts: list[ir.Message], report: Report) -> list[ir.Message]:
    """Drop constants that rosidl's parser gives to an earlier section (language 3).

    It looks constants up by equality, so one that repeats an earlier section's type, name, value
    and comment ends up there, and is missing from its own.
    """
    seen: set[tuple[object, ...]] = set()
    result: list[ir.Message] = []
    for part in parts:
        names = Counter(constant.name for constant in part.constants)
        keys = [_identity(constant) for constant in part.constants]
        kept: list[ir.Constant] = []
        for key, constant in zip(keys, part.constants, strict=True):
            # a name that occurs twice is an error, which a check will report
            if key not in seen or names[constant.name] > 1:
                kept.append(constant)
            elif constant.name_span is not None:
                message = (
                    f"ROS 2 keeps `{constant.name}` only in the earlier section, "
                    "which defines the same constant"
                )
                hint = "give it another name or comment"
                code = codes.REPEATED_SECTION_CONSTANT
                report.add(code.at(constant.name_span, message, hint=hint))
        result.append(msgspec.structs.replace(part, constants=tuple(kept)))
        seen.update(keys)
    return result


def _identity(constant: ir.Constant) -> tuple[object, ...]:
    type_ = constant.type.info.idl if isinstance(constant.type, ir.Primitive) else constant.type
    comment = tuple(map(_seen_by_parser, constant.comment))
    return type_, constant.name, str(constant.value), comment


def _seen_by_parser(text: str) -> str:
    try:
        return through_idl(text)
    except EscapeError:
        return text
