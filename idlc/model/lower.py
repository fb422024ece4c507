"""One section's lines → a message: comments find their owners, definitions their meaning."""

from __future__ import annotations

from collections import Counter
from itertools import takewhile
from typing import TYPE_CHECKING, TypeAlias

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit, Report
from idlc.diagnostics.source import Source, Span
from idlc.language import tree
from idlc.language.escapes import EscapeError, through_idl
from idlc.language.parse import parse_definition
from idlc.model import ir, lower_types
from idlc.model.comments import Comment, condense, problem
from idlc.model.distros import DEFAULT, Distro
from idlc.model.lower_types import STRINGS, Fault, as_parsed, lower_type
from idlc.model.lower_values import Text, default, scalar

if TYPE_CHECKING:
    from idlc.language import idl


def after_optional(
    line: tree.Line, source: Source, distro: Distro, report: Report, *, is_second: bool
) -> tree.Line:
    """Return the rest of a line that begins with `@optional`; report problems with it.

    `is_second`: the definition has another one before. After a second one the rest is empty.
    """
    rest = line.after_optional or line
    report.add(_problem(_span(line, source), distro, is_second=is_second))
    if rest.after_optional is None:
        return rest
    report.add(_problem(_span(rest, source), distro, is_second=True))
    return msgspec.structs.replace(rest, code="")


def _span(line: tree.Line, source: Source) -> Span:
    return Span(source, line.start, line.start + len(tree.OPTIONAL))


def _problem(span: Span, distro: Distro, *, is_second: bool) -> Diagnostic:
    if not distro.reads_optional:
        diagnostic = codes.OPTIONAL_NEEDS_LYRICAL.at(
            span,
            f"ROS 2 {distro.title} does not know `@optional`, which came with Lyrical",
            hint="leave it out; where it is known (`--distro lyrical`), it has no effect",
        )
        return msgspec.structs.replace(diagnostic, edits=(_removal(span),))
    if is_second:
        message = "a definition can have `@optional` only once"
        return codes.REPEATED_OPTIONAL.at(span, message, hint="leave it out here")
    return codes.OPTIONAL_WITHOUT_EFFECT.at(
        span,
        "`@optional` is accepted and has no effect",
        hint="for a value that may be missing use `T[<=1]`, or a bool field beside it",
    )


def _removal(span: Span) -> Edit:
    """Return the edit that removes it, with the whitespace after it."""
    rest = span.source.text[span.end :]
    blanks = len(rest) - len(rest.lstrip(" \t"))
    return Edit(Span(span.source, span.start, span.end + blanks), "")


Lines: TypeAlias = tuple[tree.Line, ...]


def lower_section(
    file: tree.File, lines: Lines, name: ir.TypeName, report: Report, distro: Distro
) -> ir.Message:
    """Return the message that a section's lines define; reports their problems."""
    return _Section(file, lines, name, report, distro).lower()


class _Element(msgspec.Struct, frozen=True):
    """A definition with the lines whose comments belong to it."""

    line: tree.Line
    body: tree.Field | tree.Constant
    comments: list[tree.Line]
    optional: bool


class _Section:
    """Lowers one section; holds the state that its steps share."""

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
            slip = lower_types.find_slip(text, body, self.name.kind)
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
        is_second, self.optional = self.optional, True
        return after_optional(line, self.file.source, self.distro, self.report, is_second=is_second)

    def _condense(self, texts: list[str], lines: list[tree.Line], *, has_unit: bool) -> Comment:
        """Return an element's comment; `has_unit`: rosidl writes its unit somewhere."""
        comment = condense(texts)
        defect = problem(comment if has_unit else msgspec.structs.replace(comment, unit=None))
        if defect is not None:
            span = self._find(defect.text, lines)
            self.report.add(defect.code.at(span, defect.message, hint=defect.hint))
        return comment

    def _find(self, text: str, lines: list[tree.Line]) -> Span:
        """Return the range of `text` in the comments of these lines, or the first comment."""
        line, at = next(
            ((line, at) for line in lines if (at := line.comment.find(text)) >= 0), (lines[0], 0)
        )
        start = line.start + len(line.code) + at
        return Span(self.file.source, start, start + (len(text) if at else len(line.comment)))

    def _broken(self, line: tree.Line, body: tree.Broken) -> None:
        span = self.file.span(line, body.piece)
        diagnostic = body.code.at(span, body.message, hint=body.hint)
        self.report.add(msgspec.structs.replace(diagnostic, edits=self._edits(line, body, span)))

    def _edits(self, line: tree.Line, body: tree.Broken, span: Span) -> tuple[Edit, ...]:
        """Return the edit that repairs a broken line, if its intention is sure."""
        if body.code is codes.INDENTED_DEFINITION:
            return (Edit(span, ""),)
        if not _is_dashes(line) or line.comment:
            return ()
        lines = [other for section in self.file.sections for other in section.lines]
        count = len(self.file.separators) + sum(map(_is_dashes, lines))
        if count != ir.KINDS.index(self.name.kind):
            return ()
        return (Edit(Span(span.source, line.start, line.start + len(line.code)), "---"),)

    def _warn_hash(self, line: tree.Line, text: str) -> None:
        """Warn when a comment begins between two quotes."""
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
            self.report.add(
                codes.WSTRING_SEQUENCE_BOUND.at(
                    self.file.span(line, type_.brackets),
                    f"ROS 2 reads this as a sequence of at most {bound} elements",
                    hint=f"write `[<={bound}]` to say so, or remove the string's bound",
                )
            )
        return lowered

    def _field(self, line: tree.Line, body: tree.Field, about: Comment) -> ir.Field:
        wrong = lower_types.field_name(body.name.text, self.file.span(line, body.name))
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
        lowered = default(type_, piece.text)
        if isinstance(lowered, Fault):
            self._add_value(line, piece, lowered)
            return None
        return lowered

    def _constant(self, line: tree.Line, body: tree.Constant, about: Comment) -> ir.Constant | None:
        wrong = lower_types.constant_name(body.name.text, self.file.span(line, body.name))
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
    # only the comments at the head of a section keep their trailing whitespace
    return line.comment.replace("\t", " ").rstrip().lstrip("#")


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
    suffixes = SECTIONS[name.kind]
    if not isinstance(file, tree.File):
        from idlc.model.lower_idl import lower_idl  # only recordings hold IDL

        structures = [name._replace(name=name.name + suffix) for suffix in suffixes]
        return _assembled(name, lower_idl(file, structures, report), file.source, report)
    _check_reading(file, report)
    _check_separators(file, name.kind, len(suffixes), report)
    empty = tree.Section(len(file.source.text), ())
    sections = (*file.sections, *([empty] * len(suffixes)))
    parts = [
        lower_section(file, section.lines, name._replace(name=name.name + suffix), report, distro)
        for suffix, section in zip(suffixes, sections, strict=False)
    ]
    return _assembled(name, parts, file.source, report)


def _assembled(
    name: ir.TypeName, parts: list[ir.Message], source: Source, report: Report
) -> ir.Interface:
    """Return the interface that consists of these sections."""
    parts = _without_moved_constants(parts, report)
    if name.kind == "msg":
        return parts[0]
    if name.kind == "srv":
        return ir.Service(name=name, request=parts[0], response=parts[1], source=source)
    goal, result, feedback = parts
    return ir.Action(name=name, goal=goal, result=result, feedback=feedback, source=source)


def _check_reading(file: tree.File, report: Report) -> None:
    source = file.source
    if source.text.startswith(tree.BYTE_ORDER_MARK):
        diagnostic = codes.BYTE_ORDER_MARK.at(
            Span(source, 0, 1),
            "the file begins with a byte order mark",
            hint="save it as UTF-8 without a byte order mark",
        )
        report.add(msgspec.structs.replace(diagnostic, edits=(Edit(Span(source, 0, 1), ""),)))
    for section in file.sections:
        for line in section.lines:
            if line.newline and line.newline not in ("\n", "\r\n", "\r"):
                end = line.start + len(line.code) + len(line.comment)
                report.add(
                    codes.UNUSUAL_LINE_END.at(
                        Span(source, end, end + 1),
                        f"U+{ord(line.newline):04X} ends a line here",
                        hint="remove the character, or start a new line",
                    )
                )


def _check_separators(file: tree.File, kind: ir.Kind, expected: int, report: Report) -> None:
    count = len(file.separators)
    needed = expected - 1
    if count == needed or _has_near_separator(file, expected):
        return
    rule = f"a .{kind} file has {_NUMBERS[needed]} `---` line{'s' * (needed > 1)}"
    if count > needed:
        at = file.separators[needed]
        span = Span(file.source, at, at + 3)
        hint = "remove it" if needed else "put services in .srv and actions in .action files"
        message = f"{rule}; this is one more" if needed else rule
        report.add(codes.SEPARATOR_COUNT.at(span, message, hint=hint))
    else:
        end = len(file.source.text)
        report.add(
            codes.SEPARATOR_COUNT.at(
                Span(file.source, end, end),
                f"{rule}; this file has {_NUMBERS[count] if count else 'none'}",
                hint="write `---` on a line of its own between the parts",
            )
        )


def _has_near_separator(file: tree.File, expected: int) -> bool:
    """Return whether some line resembles a separator and is reported as such.

    Lines after the `expected` sections are ignored.
    """
    if file.source.text.startswith(tree.BYTE_ORDER_MARK + "-"):
        return True
    lines = (line for section in file.sections[:expected] for line in section.lines)
    return any(text and set(text) == {"-"} for line in lines if (text := line.definition))


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
                report.add(_moved(constant, constant.name_span))
        result.append(msgspec.structs.replace(part, constants=tuple(kept)))
        seen.update(keys)
    return result


def _moved(constant: ir.Constant, span: Span) -> Diagnostic:
    return codes.REPEATED_SECTION_CONSTANT.at(
        span,
        f"ROS 2 gives `{constant.name}` to the earlier section only, because it is the same there",
        hint="give it another name or comment",
    )


def _identity(constant: ir.Constant) -> tuple[object, ...]:
    idl = "wstring" if constant.type == ir.String(wide=True) else "string"
    if isinstance(constant.type, ir.Primitive):
        idl = constant.type.info.idl
    comment = tuple(_seen_by_parser(line) for line in constant.comment)
    return idl, constant.name, str(constant.value), comment


def _seen_by_parser(text: str) -> str:
    try:
        return through_idl(text)
    except EscapeError:
        return text
