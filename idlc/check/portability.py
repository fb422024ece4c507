"""Rules on constructs that ROS 2 accepts, and treats differently from place to place."""

from __future__ import annotations

import re
from collections.abc import Iterator

from idlc.check.style import REMARK, is_unit
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit, first_few
from idlc.diagnostics.source import Span
from idlc.model import catalog, ir
from idlc.model.comments import brackets
from idlc.model.link import Model, own_fields, own_sections

#: Pairs of brackets that a message names.
SHOWN = 5
#: ROS 2's replacements for removed types.
_INSTEAD = {
    "actionlib_msgs": "define the action in an .action file; ROS 2 generates the messages for it",
    "geometry_msgs/msg/Pose2D": "use `geometry_msgs/Pose`, or fields `x`, `y` and `theta`",
}


def wide_strings(model: Model) -> Iterator[Diagnostic]:
    """`wstring` is not used: its encoding differs between middlewares and platforms."""
    for field in own_fields(model):
        element = ir.element_of(field.type)
        if isinstance(element, ir.String) and element.wide:
            message = "the encoding of a wstring depends on the middleware and the platform"
            hint = "use `string`, which is UTF-8"
            yield codes.WIDE_STRING.at(field.type_span, message, hint=hint)


def chars(model: Model) -> Iterator[Diagnostic]:
    """`char` is not used: it is a uint8 that looks like a text."""
    for message in own_sections(model):
        spans = [field.type_span for field in message.fields if _is_char(field.type)]
        spans += [
            _constant_type(constant.name_span)
            for constant in message.constants
            if _is_char(constant.type) and constant.name_span
        ]
        for span in filter(None, spans):
            wide = re.compile(r"char(\S*) ( +)").match(span.source.text, span.start)
            edit = Edit(span, "uint8")
            if wide:  # there is room to leave the name in its column
                whole = Span(span.source, span.start, wide.end())
                edit = Edit(whole, f"uint8{wide[1]}{wide[2]}")
            text = "in ROS 2, `char` is an unsigned one-byte number, not a character"
            hint = "write `uint8`; bytes, hash and code stay the same"
            yield codes.CHAR_TYPE.at(span, text, hint=hint, edits=(edit,))


def _is_char(type_: ir.FieldType) -> bool:
    return ir.element_of(type_) == ir.Primitive("char")


def _constant_type(name: Span) -> Span:
    """Return the range of a constant's type: at the beginning of its line."""
    line, _ = name.source.position(name.start)
    start = name.source.line_starts[line - 1]
    return Span(name.source, start, start + len("char"))


def nested_bounds(model: Model) -> Iterator[Diagnostic]:
    """Bounded texts are not elements of arrays: no middleware checks their length there."""
    for field in own_fields(model):
        element = ir.element_of(field.type)
        bound = element.bound if isinstance(element, ir.String) else None
        if bound is not None and element is not field.type:
            message = f"no middleware checks that each string has at most {bound} characters"
            hint = "check the length in code; the bound is still part of the type hash"
            yield codes.UNENFORCED_BOUND.at(field.type_span, message, hint=hint)


def several_units(model: Model) -> Iterator[Diagnostic]:
    """A comment has one unit: of several pairs of brackets, ROS 2 takes none as the unit."""
    for field in own_fields(model):
        text = "\n".join(field.comment)
        contents = [content for _, content in brackets(text)]
        units = sum(map(is_unit, contents))
        # a remark such as [0..1] beside the unit leaves it clear to readers
        unclear = units > 1 or (units and REMARK.search(text))
        if len(contents) > 1 and unclear and field.unit is None:
            shown = first_few((f"[{unit}]" for unit in contents), SHOWN)
            yield codes.SEVERAL_UNITS.at(
                field.name_span,
                f"`{field.name}` has no unit in ROS 2, because its comment contains several "
                f"pairs of brackets: {shown}",
                hint="use parentheses in the `ignore` comment: `ignore(IDL405)`"
                if REMARK.search(text)
                else "keep one unit in brackets, and write the others without brackets",
            )


def removed_types(model: Model) -> Iterator[Diagnostic]:
    """Used types exist in all later distributions."""
    for target, span in _used(model):
        since = catalog.removed(target, model.distro)
        if since is not None:
            message = f"ROS 2 {since.title} removed `{target}`"
            hint = _INSTEAD.get(str(target)) or _INSTEAD.get(target.package)
            yield codes.REMOVED_STANDARD_TYPE.at(span, message, hint=hint)


def changed_types(model: Model) -> Iterator[Diagnostic]:
    """Used types have the same fields in all later distributions."""
    for target, span in _used(model):
        other = catalog.changed(target, model.distro)
        if other is not None:
            yield codes.CHANGED_STANDARD_TYPE.at(
                span,
                f"ROS 2 {other.title} changed the fields of `{target}`",
                hint="nodes on older and newer distributions cannot exchange this message; "
                f"`idlc breaking --distro {other.name} --against distro:{model.distro.name}` "
                "shows the changes",
            )


def _used(model: Model) -> Iterator[tuple[ir.TypeName, Span | None]]:
    """Yield the messages of other packages that fields hold, with the range of their names."""
    for message in own_sections(model):
        for field, target in message.holders:
            if target.package != model.package:
                yield target, field.type_span
