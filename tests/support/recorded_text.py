"""A recording from text: a line for each topic, and below it the definition of its type.

    @ TOPIC TYPE [ENCODING [HASH]]
    float64 speed
    --- MSG demo_msgs/Part

`--- MSG NAME` stands for the line of 80 `=` and that which names the next definition. The hash is
what was recorded, `right` for that of TYPE in ROS 2 Jazzy.
"""

import re
from pathlib import Path

from mcap.writer import Writer

from idlc.diagnostics.report import Report
from idlc.language.parse import parse
from idlc.model import catalog, ir
from idlc.model.link import link
from idlc.model.lowering.lower import lower

_NEXT = re.compile(r"^--- (MSG|IDL|SRV|ACTION) (\S+)$", re.MULTILINE)


def write(path, text, messages=None):
    """Write the MCAP file that a text describes; `messages` is how many there are by topic.

    Each holds one byte, a zero.
    """
    with Path(path).open("wb") as file:
        writer = Writer(file, chunk_size=1024)
        writer.start(profile="ros2", library="test")
        for block in text.split("@ ")[1:]:
            head, _, definition = block.partition("\n")
            topic, type_, encoding, hash_ = (
                *head.split(),
                *("ros2msg", "")[len(head.split()) - 2 :],
            )
            definition = _NEXT.sub(lambda found: f"{'=' * 80}\n{found[1]}: {found[2]}", definition)
            schema = writer.register_schema(type_, encoding, definition.encode())
            hash_ = right_hash(type_) if hash_ == "right" else hash_
            metadata = {"topic_type_hash": hash_} if hash_ else {}
            channel = writer.register_channel(topic, "cdr", schema, metadata)
            for number in range((messages or {}).get(topic, 0)):
                writer.add_message(channel, number, b"\0\1\0\0\0", number)
        writer.finish()
    return path


def right_hash(type_):
    """Return the type hash of a standard message."""
    name = ir.TypeName.parse(type_)
    own = lower(parse(catalog.source(name)), name, Report())
    return link(name.package, [own], catalog, Report()).describer.hash(type_)
