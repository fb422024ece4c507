"""An interface as the text of its file, also where it came as IDL."""

from __future__ import annotations

import re
from collections.abc import Iterator

from idlc.model import derive, ir
from idlc.model.spelling import spell
from idlc.syntax.tree import OPTIONAL

#: What would end a text or begin a comment is written as an escape (language 1.5).
_SPECIAL = re.compile(r"[\x00-\x1f\x7f-\x9f\"'#\\]")
#: In arrays escapes are interpreted once, and other characters break ROS 2's tools (language 4).
_SPECIAL_IN_ARRAYS = re.compile(r"[^\x20-\x7e]|[\"'#\\]")


def file_text(interface: ir.Interface) -> str:
    """Return the text that defines an interface, as it was written if it was."""
    source = interface.source
    if source is None:
        return ""
    if not source.is_idl:
        return source.text
    sections = map(_section, derive.sections(interface))
    return "---\n".join("".join(f"{line}\n" for line in lines) for lines in sections)


def _section(message: ir.Message) -> Iterator[str]:
    yield from _comment(message.comment)
    yield ""
    for constant in message.constants:
        yield from _comment(constant.comment)
        yield f"{spell(constant.type)} {constant.name}={_scalar(constant.value)}"
    for field in message.fields:
        yield from _comment(field.comment)
        optional = f"{OPTIONAL} " if field.optional else ""
        default = "" if field.default is None else f" {_value(field.default.value)}"
        unit = "" if field.unit is None else f"  # [{field.unit}]"
        type_ = spell(field.type, message.name.package)
        yield f"{optional}{type_} {field.name}{default}{unit}"


def _comment(lines: tuple[str, ...]) -> Iterator[str]:
    return (f"# {line}".rstrip() for line in lines)


def _value(value: ir.Value) -> str:
    if not isinstance(value, tuple):
        return _scalar(value)
    return f"[{', '.join(_element(one) for one in value)}]"


def _element(value: ir.Scalar) -> str:
    if not isinstance(value, str):
        return _scalar(value)
    return f'"{_SPECIAL_IN_ARRAYS.sub(_escaped_once, value)}"'


def _scalar(value: ir.Scalar) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{_SPECIAL.sub(_escaped, value)}"' if isinstance(value, str) else repr(value)


def _escaped(found: re.Match[str]) -> str:
    return "\\" * 4 if found[0] == "\\" else _escaped_once(found)


def _escaped_once(found: re.Match[str]) -> str:
    code = ord(found[0])
    return f"\\x{code:02x}" if code < 0x100 else f"\\U{code:08x}"
