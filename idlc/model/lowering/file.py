"""Syntax → IR: one file's meaning, without looking at any other file."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit, Report
from idlc.diagnostics.source import Source, Span
from idlc.model import ir
from idlc.model.distro import DEFAULT, Distro
from idlc.model.lowering.section import lower_section
from idlc.syntax import tree
from idlc.syntax.escapes import EscapeError, through_idl

if TYPE_CHECKING:
    from idlc.syntax import idl_tree

SECTIONS: dict[ir.Kind, tuple[str, ...]] = {
    "msg": ("",),
    "srv": ("_Request", "_Response"),
    "action": ("_Goal", "_Result", "_Feedback"),
}


_NUMBERS = ("no", "one", "two")


def lower(
    file: tree.File | idl_tree.File, name: ir.TypeName, report: Report, distro: Distro = DEFAULT
) -> ir.Interface:
    """Return the interface that a file defines for a distribution; missing sections are empty.

    Reports everything that is wrong inside the file; types of other files are `link`'s.
    """
    suffixes = SECTIONS[name.kind]
    if not isinstance(file, tree.File):
        from idlc.model.lowering.idl import lower_idl  # only recordings hold IDL

        wanted = [name._replace(name=name.name + suffix) for suffix in suffixes]
        return _assembled(name, lower_idl(file, wanted, report), file.source, report)
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
    """Return the interface that sections are."""
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
        found = codes.BYTE_ORDER_MARK.at(
            Span(source, 0, 1),
            "the file begins with a byte order mark",
            hint="save it as UTF-8 without a byte order mark",
        )
        report.add(msgspec.structs.replace(found, edits=(Edit(Span(source, 0, 1), ""),)))
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
    """Return whether some line was meant as a separator and is reported as such.

    What comes after the `expected` sections is not looked at any more.
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
