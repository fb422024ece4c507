r"""The texts of interfaces as nodes send them, which rosidl damages.

For each line, rosidl writes Python's `repr` of the bytes, in which a TAB is `\t` and `°` is
`\xc2\xb0`. Then it cuts the text off at its former number of characters. It damages the default
values in type descriptions in the same way.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TypeAlias

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import INCOMPLETE, Source
from idlc.language.parse import parse
from idlc.model import derive, ir
from idlc.model.distros import NEWEST
from idlc.model.idl_text import spell_default
from idlc.model.ir import spell
from idlc.model.lowering.lower import lower
from idlc.model.lowering.lower_idl import default_of_words

#: Default values as type descriptions have them, by structure and field; not those that are empty.
Defaults: TypeAlias = Mapping[tuple[ir.TypeName, str], str]
#: An escape of `repr`, and one that is cut off.
_ESCAPE = re.compile(r"\\(?:x(0[0-8bcef]|1[0-9a-f]|7f|[89a-f][0-9a-f])|([tr\\']))")
_CUT = re.compile(r"(?:\\(?:x[0-9a-f]?)?)?\Z")
_NAMED = {"t": "\t", "r": "\r"}
_PLAIN = re.compile(r"[\n\x20-\x7e]*")
#: A field, maybe cut off; names of constants have other first letters.
_FIELD = re.compile(r"\S+\s+([a-z][a-z0-9_]*)(?:\s.*)?")
#: The characters of the shortest constant, `bool A=1`.
_SHORTEST = 8


def unescape(text: str) -> tuple[str, int]:
    """Return the text before rosidl escaped it, and how many characters it lacks at most."""
    rest = _ESCAPE.sub("", text) if "\\" in text and _PLAIN.fullmatch(text) else ""
    match = _CUT.search(rest)
    cut = match[0] if match else ""
    if not rest or not text.endswith(cut) or "\\" in rest.removesuffix(cut):
        return text, 0
    data = _ESCAPE.sub(_character, text.removesuffix(cut)).encode("latin-1")
    try:
        whole = codecs.getincrementaldecoder("utf-8")().decode(data)
    except UnicodeDecodeError:
        return text, 0
    return whole, len(text) - len(whole)


def _character(match: re.Match[str]) -> str:
    return chr(int(match[1], 16)) if match[1] else _NAMED.get(match[2], match[2])


def default_of(type_: ir.FieldType, text: str) -> ir.Default | None:
    """Return the default value in a description; `None` if the description does not tell it."""
    if not text or "\\" in text or text == "inf":  # damaged maybe; the sign of infinity is lost
        return None
    value = default_of_words(type_, text, is_text=not isinstance(type_, ir.Primitive))
    return value if isinstance(value, ir.Default) else None


def field_line(field: ir.Field, package: str) -> str:
    """Return a field with its default value as a line of an interface file."""
    default = "" if field.default is None else f" {spell_default(field.default.value)}"
    return f"{spell(field.type, package)} {field.name}{default}\n"


def field_lines(fields: Iterable[ir.Field], package: str) -> str:
    """Return fields as lines of an interface file."""
    return "".join(field_line(field, package) for field in fields)


def restore(
    name: ir.TypeName, text: str, parts: Sequence[ir.Message], defaults: Defaults
) -> str | None:
    """Return the text of an interface as it was, as far as its damaged form tells.

    `parts` are the sections in its description, the fields of which replace lost ones. The last
    line is INCOMPLETE if constants or default values may be missing. The result is `None` if the
    text contradicts the description.
    """
    whole, lost = unescape(text)
    plain = _checked(name, text, parts, defaults)
    if not lost:
        return text if plain else None
    restored = _completed(name, whole, lost, parts, defaults)
    # escapes of bytes beyond ASCII prove the damage, while other ones may belong to the text
    if plain is None or not whole.isascii():
        return restored
    if restored is None:
        return text
    other = _checked(name, restored, parts, defaults)
    return restored if other and ir.content(plain) == ir.content(other) else None


def _checked(
    name: ir.TypeName, text: str, parts: Sequence[ir.Message], defaults: Defaults
) -> ir.Interface | None:
    """Return the interface in a text, if it has the fields and default values of `parts`."""
    report = Report()
    interface = lower(parse(Source(str(name), text)), name, report, NEWEST)
    sections = derive.sections(interface)
    is_like = not report.had_errors and all(map(_agree, sections, parts))
    is_told = all(_is_told(part, field, defaults) for part in sections for field in part.fields)
    return interface if is_like and is_told else None


def _agree(section: ir.Message, part: ir.Message) -> bool:
    return [field.name for field in section.fields] == [field.name for field in part.fields]


def _is_told(part: ir.Message, field: ir.Field, defaults: Defaults) -> bool:
    """Return whether a description has a field's default value, whole or damaged."""
    text = field.default.text if field.default else ""
    escaped = repr(text.encode("utf-8", "surrogatepass"))[2:-1]
    told = defaults.get((part.name, field.name), "")
    return told in (text, escaped[: len(text)])


def _completed(
    name: ir.TypeName, whole: str, lost: int, parts: Sequence[ir.Message], defaults: Defaults
) -> str | None:
    """Return the sound lines of a text that was cut off, with the fields that these lack."""
    *lines, last = whole.split("\n")
    definition, sign, _ = last.partition("#")
    if sign and definition.strip():  # the definition before a comment is whole
        lines.append(definition.rstrip())
    last = "" if sign else last
    text = "".join(f"{line}\n" for line in lines)
    file = parse(Source(str(name), text))
    reached = len(file.separators)
    if reached >= len(parts):
        return None
    section = derive.sections(lower(file, name, Report(), NEWEST))[reached]
    rest = [parts[reached].fields[len(section.fields) :], *(each.fields for each in parts)]
    del rest[1 : reached + 2]
    text += "---\n".join(field_lines(own, name.package) for own in rest)
    owners = ((part, field) for part in parts[reached:] for field in part.fields)
    keys = ((part.name, field.name) for part, field in owners if field.default is None)
    present = {(section.name, field.name) for field in section.fields}
    untold = dict.fromkeys((key for key in keys if key not in present), "")
    if _checked(name, text, parts, {**defaults, **untold}) is None:
        return None
    names = [field.name for own in rest for field in own]
    is_complete = not any(map(defaults.get, untold)) and not _may_hold_constant(last, lost, names)
    return text if is_complete else f"{text}{INCOMPLETE}\n"


def _may_hold_constant(last: str, lost: int, fields: Sequence[str]) -> bool:
    """Return whether an incomplete line, or the lost characters after it, may define a constant.

    `fields` are the names of the fields that are there, or begin there.
    """
    match = _FIELD.fullmatch(last.strip())
    is_field = match is not None and any(name.startswith(match[1]) for name in fields[:1])
    if last.strip("- \t") and not is_field:
        return True
    # each further field has at least a type of four letters, a space and the end of its line
    return lost - sum(len(name) + 6 for name in fields[is_field:]) >= _SHORTEST
