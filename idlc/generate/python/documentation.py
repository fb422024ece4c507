"""Docstrings of generated classes: the file's comments, and what ROS 2 adds.

All text is safe in a docstring (see `prose`).
"""

from __future__ import annotations

import msgspec

from idlc.generate.python import lines
from idlc.generate.python.lines import docstring, prose, wrapped
from idlc.model import derive, ir, python_names
from idlc.model.ir import spell


class DocstringSection(msgspec.Struct, frozen=True):
    """A list in a docstring, such as that of the attributes."""

    title: str
    entries: tuple[str, ...]


class Docstring(msgspec.Struct, frozen=True):
    """A class's docstring: `text` of one or more lines, and lists after it."""

    text: str
    sections: tuple[DocstringSection, ...] = ()

    @property
    def is_one_line(self) -> bool:
        """True if the closing quotes are on the line of the opening ones."""
        return not self.sections and "\n" not in self.text


def message(structure: ir.Message, purpose: str, entries: tuple[str, ...], file: str) -> Docstring:
    """Return a message's docstring: its comment, or else its `purpose`, and its fields' entries.

    `file` is the one that defines it, within its package.
    """
    lines = [prose(line) for line in structure.comment] or [purpose]
    if len(lines) > 1 and lines[1]:
        lines.insert(1, "")
    lines += _hidden(structure)
    place = _place(structure, file)
    lines += ["", f"Defined in {place}"] if place else []
    constants = tuple(_constant(c) for c in structure.constants if c.comment or c.unit)
    sections = (DocstringSection("Attributes", entries), DocstringSection("Constants", constants))
    filled = tuple(section for section in sections if section.entries)
    return Docstring(docstring(lines, one_line=not filled), filled)


def purposes(interface: ir.Interface) -> dict[ir.TypeName, str]:
    """Return what the messages of a service or action are for, and an action's services."""
    name = interface.name.name
    match interface:
        case ir.Message():
            return {interface.name: f"{interface.name}."}
        case ir.Service():
            return {
                interface.request.name: f"The request of the service {interface.name}.",
                interface.response.name: f"The response of the service {interface.name}.",
                **_event(interface, f"a call of {name}"),
            }
        case ir.Action():
            send, get = derive.services(interface)
            goal = f"a {name} goal"
            words = {
                send.name: f"Starts {goal}",
                send.request.name: f"Sent by a client to start {goal}",
                send.response.name: f"Tells a client whether {goal} was accepted, and when",
                get.name: f"Waits for the result of {goal}",
                get.request.name: f"Sent by a client to wait for the result of {goal}",
                get.response.name: f"Tells a client how {goal} ended, and its result",
                derive.feedback_message(interface).name: f"Published while {goal} is executed",
            }
            return {
                interface.goal.name: f"The goal of the action {interface.name}.",
                interface.result.name: f"The result of the action {interface.name}.",
                interface.feedback.name: f"The feedback of the action {interface.name}.",
                **{type_name: f"{text}. Added by ROS 2." for type_name, text in words.items()},
                **_event(send, f"a call that starts {goal}"),
                **_event(get, "a call that waits for a result"),
            }


def _event(service: ir.Service, call: str) -> dict[ir.TypeName, str]:
    text = f"Published about {call}, where services are introspected. Added by ROS 2."
    return {derive.event(service).name: text}


def _hidden(structure: ir.Message) -> list[str]:
    """Return how to call the methods that fields hide."""
    hidden = [field.name for field in structure.fields if python_names.hides_method(field.name)]
    if not hidden:
        return []
    name = python_names.class_(structure.name)
    text = (
        f"Fields hide the methods of the same name ({', '.join(hidden)}): "
        f"`super({name}, message)` still has them, and `super({name}, {name})` those of the class."
    )
    return ["", *lines.wrapped(text, 4)]


def _place(structure: ir.Message, file: str) -> str:
    """Return the file and line where a structure begins; empty if nobody wrote any of it.

    Later sections have no line: it would change with each field of those before, and people review
    what one more field changes.
    """
    described: list[ir.Field | ir.Constant] = [*structure.fields, *structure.constants]
    spans = [definition.name_span for definition in described if definition.name_span]
    if not spans:
        return ""
    first = min(spans, key=lambda span: span.start)
    if "\n---" in f"\n{first.source.text[: first.start]}":
        return file
    return f"{file}:{first.source.position(first.start)[0]}"


def _constant(constant: ir.Constant) -> str:
    return entry(constant.name, constant, words(constant))


def words(described: ir.Field | ir.Constant) -> str:
    """Return the unit and comment of a field or constant, the suffix of its type or name."""
    unit = f" [{lines.prose(described.unit)}]" if described.unit else ""
    comment = " ".join(lines.prose(line).strip() for line in described.comment).strip()
    return unit + (f". {comment}" if comment else "")


def entry(name: str, described: ir.Field | ir.Constant, suffix: str) -> str:
    """Return the entry of a field or constant in a list, on as many lines as it takes."""
    text = f"{name}: {spell(described.type)}{suffix}"
    return "\n".join(lines.wrapped(text, 8, hanging=4))


def attribute(described: ir.Field | ir.Constant, suffix: str, file: str) -> str:
    """Return the statement that editors show of a field or constant: its definition and comment.

    The file is named without a line number, which other lines would change. The statement is empty
    for fields that ROS 2 adds: their annotation says it all.
    """
    if described.name_span is None:
        return ""
    lines = wrapped(f"{spell(described.type)} {described.name}{suffix} ({file})", 6)
    text = docstring(lines, one_line=True)
    return f'"""{text}"""' if len(lines) == 1 else f'"""{text}\n"""'
