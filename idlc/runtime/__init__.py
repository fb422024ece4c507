"""Support for generated messages: what their modules share. Copied into each package.

It imports the standard library only; `arrays` imports numpy, `typesupport` looks for rclpy.
"""

from __future__ import annotations

from array import array

from .cdr import (
    ENDS,
    HEADERS,
    NATIVE,
    PAD2,
    PAD4,
    PAD8,
    TRUTHS,
    Texts,
    flags,
    flags_writer,
    layout,
    listed,
    octets,
    octets_writer,
    phases,
    read_flags,
    read_octets,
    read_wide_text,
    rows_writer,
    sizes,
    strings_reader,
    text_block,
    text_phases,
    texts_reader,
    unsized,
    wide_block,
    wide_text,
    wide_texts_reader,
)
from .codec import Codec, Reading, construct, maker
from .errors import DecodeError, MissingPackageError, ValidationError, importing
from .message import (
    Action,
    Imported,
    Message,
    Package,
    Service,
    complete,
    define,
)
from .names import lazily
from .objects import equal, same
from .sequences import (
    Float32Sequence,
    Float64Sequence,
    Fresh,
    FreshList,
    Int8Sequence,
    Int16Sequence,
    Int32Sequence,
    Int64Sequence,
    ListOf,
    UInt8Sequence,
    UInt16Sequence,
    UInt32Sequence,
    UInt64Sequence,
    array_of,
    sequence_copier,
    sequence_reader,
    sequence_writer,
    several,
)

#: What generated code expects of the runtime. Each runtime serves all code of its number.
PROTOCOL = 1

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .hints import Floats as Floats
    from .hints import Integers as Integers
    from .hints import Iterable as Iterable
    from .hints import Join as Join
    from .hints import Options as Options
    from .hints import TypeAlias as TypeAlias
    from .hints import Unpack as Unpack
else:
    _HINTS = "Floats Integers Iterable Join Options TypeAlias Unpack"
    __getattr__, __dir__ = lazily(__name__, dict.fromkeys(_HINTS.split(), "hints"))

__all__ = [
    "ENDS",
    "HEADERS",
    "NATIVE",
    "PAD2",
    "PAD4",
    "PAD8",
    "PROTOCOL",
    "TRUTHS",
    "Action",
    "Codec",
    "DecodeError",
    "Float32Sequence",
    "Float64Sequence",
    "Fresh",
    "FreshList",
    "Imported",
    "Int8Sequence",
    "Int16Sequence",
    "Int32Sequence",
    "Int64Sequence",
    "ListOf",
    "Message",
    "MissingPackageError",
    "Package",
    "Reading",
    "Service",
    "Texts",
    "UInt8Sequence",
    "UInt16Sequence",
    "UInt32Sequence",
    "UInt64Sequence",
    "ValidationError",
    "array",
    "array_of",
    "complete",
    "construct",
    "define",
    "equal",
    "flags",
    "flags_writer",
    "importing",
    "layout",
    "lazily",
    "listed",
    "maker",
    "octets",
    "octets_writer",
    "phases",
    "read_flags",
    "read_octets",
    "read_wide_text",
    "rows_writer",
    "same",
    "sequence_copier",
    "sequence_reader",
    "sequence_writer",
    "several",
    "sizes",
    "strings_reader",
    "text_block",
    "text_phases",
    "texts_reader",
    "unsized",
    "wide_block",
    "wide_text",
    "wide_texts_reader",
]
