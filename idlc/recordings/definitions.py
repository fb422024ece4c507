"""The type definitions in a recording → interface texts by name; and the texts of recorders.

The texts are not trusted: names that ROS 2 does not allow are ignored, and of repeated
definitions the first counts.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

from idlc.diagnostics.source import Source
from idlc.language.parse import LINE_ENDS
from idlc.model import ir, names
from idlc.model.idl_text import file_text
from idlc.model.link import Model, held
from idlc.project.files import MAX_LINES
from idlc.recordings.containers.container import Schema, Topic

IDL = "ros2idl"
#: A recorder writes `unknown` for a service that refers to no message.
ENCODINGS = ("ros2msg", IDL, "unknown", "")
#: Characters of a definition with all that it refers to, and of one in IDL, each word of which
#: takes memory; real ones stay below a tenth of it.
MAX_TEXT = 16 << 20
MAX_IDL = 2 << 20
_DELIMITER = re.compile(
    r"^={80}[ \t]*\r?\n(MSG|IDL|SRV|ACTION):[ \t]*([^\s]*)[^\n]*(?:\n|\Z)", re.MULTILINE
)
_KINDS: dict[str, ir.Kind] = {"MSG": "msg", "IDL": "msg", "SRV": "srv", "ACTION": "action"}
#: A field whose type is written as pkg/msg/Name, as some recorders do; and an annotation without
#: effect that only newer distributions read.
_ODDITIES = re.compile(r"^(?:@optional[ \t]*)?(?:(\w+/)msg/(?=\w))?", re.MULTILINE)
#: Suffixes that ROS 2 adds to the names of services and actions.
_DERIVED = re.compile(
    r"_((SendGoal|GetResult)_)?(Request|Response|Event)$|_(SendGoal|GetResult|FeedbackMessage)$"
    r"|_(Goal|Result|Feedback)$"
)


class Origin(NamedTuple):
    """The words for where definitions come from, and for the hash and the type that are known."""

    name: str
    hash: str
    type: str


RECORDING = Origin("the recording", "the recorded hash", "the recorded type")
ROBOT = Origin("the robot", "the hash that the node announces", "the robot's type")


class RecordedDefinition(NamedTuple):
    """A topic, the interface that its messages are of, and all texts that came with it.

    `name` may be derived from the `interface`; both are `None` for types that are not of ROS 2.
    `recording` is the recording's name in reports. Of repeated definitions the first counts, and
    the others are in `repeated`. `problem` is the reason why a robot has no definition.
    """

    recording: str
    topic: Topic
    name: ir.TypeName | None
    interface: ir.TypeName | None
    texts: dict[ir.TypeName, Source]
    repeated: tuple[tuple[ir.TypeName, Source], ...] = ()
    origin: Origin = RECORDING
    problem: str = ""


#: The texts recorded with topics, by definition and interface.
TextCache: TypeAlias = dict[
    tuple[Schema | None, ir.TypeName],
    tuple[dict[ir.TypeName, Source], tuple[tuple[ir.TypeName, Source], ...]],
]


def read_definition(
    topic: Topic, recording: str, cache: TextCache | None = None
) -> RecordedDefinition:
    """Return the texts that a recording, by its name in reports, has for a topic.

    The `cache` has the texts of other topics of the recording, and is added to.
    """
    name = type_name(topic.type)
    if name is None:
        return RecordedDefinition(recording, topic, None, None, {})
    interface = interface_of(name)
    key = topic.schema, interface
    cache = {} if cache is None else cache
    if key not in cache:
        texts: dict[ir.TypeName, Source] = {}
        repeated = []
        for own, extension, text in _definitions(topic, interface):
            source = Source(f"{recording}: topic {topic.name}: {own}.{extension}", text, recording)
            first = texts.setdefault(own, source)
            # where a recorder finds no .msg file that it can use, it writes an empty one, then IDL
            if not first.text and source.is_idl:
                texts[own] = source
            elif first.text != text and (text or not first.is_idl):
                repeated.append((own, source))
        cache[key] = texts, tuple(repeated)
    return RecordedDefinition(recording, topic, name, interface, *cache[key])


def type_name(text: str, kind: ir.Kind = "msg") -> ir.TypeName | None:
    """Return the type that `pkg/Name` or `pkg/kind/Name` means, if ROS 2 allows such a name."""
    package, _, rest = text.partition("/")
    word, slash, name = rest.rpartition("/")
    if slash and word not in ir.KINDS:
        return None
    parsed = ir.TypeName(package, word if slash else kind, name)  # type: ignore[arg-type]
    own = interface_of(parsed).name
    is_sound = names.is_package_name(package) and names.is_message_name(own)
    return parsed if is_sound else None


def interface_of(name: ir.TypeName) -> ir.TypeName:
    """Return the interface that a type is, or is derived from."""
    if name.kind == "msg":
        return name
    return name._replace(name=_DERIVED.sub("", name.name))


def _definitions(topic: Topic, root: ir.TypeName) -> Iterator[tuple[ir.TypeName, str, str]]:
    """Yield name, extension and text of each definition that came with a topic."""
    schema = topic.schema
    if schema is None or schema.encoding not in ENCODINGS:
        return
    if len(schema.text) > MAX_TEXT or sum(map(schema.text.count, LINE_ENDS)) > MAX_LINES:
        return
    head, *parts = _DELIMITER.split(schema.text)
    definitions: list[tuple[ir.TypeName | None, bool, str]] = []
    if head.strip() and schema.encoding in ENCODINGS[:2]:
        definitions.append((root, schema.encoding == IDL, head))
    for mark, written, text in zip(parts[::3], parts[1::3], parts[2::3], strict=True):
        name = type_name(written, _KINDS[mark])
        definitions.append((name and interface_of(name), mark == "IDL", text))
    for own, is_idl, text in definitions:
        if own is not None and (not is_idl or len(text) <= MAX_IDL):
            # as every distribution reads it, without the line ends that recorders add
            tidy = text.rstrip("\r\n") + "\n" if text.strip() else ""
            yield own, "idl" if is_idl else own.kind, tidy if is_idl else _ODDITIES.sub(r"\1", tidy)


#: The line between messages in an MCAP schema of encoding `ros2msg`.
MCAP_LINE = "=" * 80


def mcap_text(interface: ir.Interface, model: Model) -> str:
    """Return a message's MCAP schema of encoding `ros2msg`: its text and nested messages' texts."""
    text = file_text(interface)
    for name in held(interface, model):
        line_end = "" if not text or text.endswith("\n") else "\n"
        text += f"{line_end}{MCAP_LINE}\nMSG: {name.package}/{name.name}\n"
        text += file_text(model.interfaces[name])
    return text if not text or text.endswith("\n") else f"{text}\n"


def definition_text(interface: ir.Interface, model: Model) -> str:
    """Return the text that a recorder writes: an interface's file, and those it refers to."""
    text = mcap_text(interface, model)
    if isinstance(interface, ir.Message):
        return text
    return f"{MCAP_LINE}\n{interface.name.kind.upper()}: {interface.name}\n{text}"
