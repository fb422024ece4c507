"""Types and names: their meaning, and hints for mistakes of people who think of another language.

The hints are for lines and names that are wrong anyway; they never decide what is right.
"""

from __future__ import annotations

import re
from itertools import takewhile

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.text import closest
from idlc.language import tree
from idlc.language.tree import Fault
from idlc.model import ir, names

#: Types in interface files, and the names of other languages for them, in lower case.
_NAMES = {
    "bool": "boolean",
    "float32": "f32 float",
    "float64": "double f64 number real",
    "int16": "short",
    "int32": "int integer signed",
    "int64": "long",
    "string": "str text",
    "uint8": "uchar",
    "uint8[]": "blob buffer bytearray bytes octets",
    "uint16": "ushort",
    "uint32": "uint unsigned",
    "uint64": "size_t ulong",
    "builtin_interfaces/Duration": "timedelta",
    "builtin_interfaces/Time": "datetime timestamp",
}
_TYPES = {
    **{name: type_ for type_, spellings in _NAMES.items() for name in spellings.split()},
    **{f"{sign}{bits}": f"{sign}nt{bits}" for sign in ("i", "ui") for bits in (8, 16, 32, 64)},
    **{f"u{bits}": f"uint{bits}" for bits in (8, 16, 32, 64)},
    **{f"{sign}int{bits}_t": f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)},
}
#: Types of several words, without a last `int`.
_C_TYPES = {
    "long double": "float64",
    "long long": "int64",
    "signed char": "int8",
    "unsigned char": "uint8",
    "unsigned long": "uint64",
    "unsigned long long": "uint64",
    "unsigned short": "uint16",
}
_C_WORDS = ("char", "double", "int", "long", "short", "signed", "unsigned")
#: The words of them that people misspell.
_NUMBERS = ("boolean", "double", "float", "int", "integer", "uint")
_ANY = ("any", "auto", "var", "variant")
_LISTS = ("array", "deque", "list", "sequence", "set", "tuple", "vector")
_MAPS = ("dict", "dictionary", "hashmap", "map", "object", "struct", "union", "unordered_map")
#: Words that other languages put before a type.
_QUALIFIERS = ("const", "constexpr", "final", "optional", "required", "static")

_COMMENTS = ("//", "/*")
COMMENT_HINT = "a comment begins with `#`"
_LIST_HINT = "write `TYPE[]` for a list of any length, `TYPE[<=10]` for at most ten elements"


def type_hint(name: str) -> str | None:
    """Return the hint for a name that other languages give to a type."""
    own = (*ir.PRIMITIVES, *STRINGS)
    word = re.split(r"::|\.", name)[-1].lower()
    if word in own:
        return f"did you mean `{word}`?" if word != name else None
    if word in _ANY:
        return "a field has exactly one type; ROS 2 has no type for arbitrary values"
    if word in _LISTS:
        return _LIST_HINT
    if word in _MAPS:
        return "ROS 2 has no maps or inline structures; create a message for the fields"
    if word == "enum":
        return "ROS 2 has no enums; write a uint8 field and a constant for each value"
    near = word if word in _TYPES else closest(name, own) or closest(name, _NUMBERS)
    return f"did you mean `{_TYPES.get(near, near)}`?" if near else None


def ros_spelling(name: str) -> str | None:
    """Return `package/Name` for a message's name as Python or C++ write it."""
    parts = re.split(r"::|\.", name)
    if len(parts) > 1 and parts[-1] == "msg" and names.is_message_name(parts[-2]):
        return "/".join((*parts[:-2][:1], parts[-2]))  # as a file is called
    if parts[0] == "std":
        return None
    fits = names.is_package_name(parts[0]) and names.is_message_name(parts[-1])
    return f"{parts[0]}/{parts[-1]}" if fits and parts[1:-1] in ([], ["msg"]) else None


def is_comment(text: str) -> bool:
    """Return whether a text begins as a comment does in other languages."""
    return text.startswith(_COMMENTS)


def has_comment(value: str) -> bool:
    """Return whether a value is, or ends in, a comment as other languages have it."""
    return any(map(is_comment, value.split(" ")))


def find_slip(text: str, body: tree.Body, kind: ir.Kind) -> Fault | None:
    """Return the fault of a line as a whole, which makes all other problems of it needless."""
    if is_comment(text):
        message = f"`{text[:2]}` does not begin a comment"
        return Fault(codes.MALFORMED_TYPE, message, 0, 2, COMMENT_HINT)
    if isinstance(body, Fault):
        return _broken(text, body, kind)
    word = body.type.whole.text
    if word in _QUALIFIERS:
        hint = f"a line begins with its type: `{text[len(word) :].strip()}`"
        return _invalid(codes.INVALID_TYPE_NAME, "type", body.type.whole, hint)
    if word in _C_WORDS and (fault := _of_c(text)):
        return fault
    return _constant(body) if isinstance(body, tree.Constant) else _field(body)


def _broken(text: str, fault: Fault, kind: ir.Kind) -> Fault | None:
    if fault.code is codes.MALFORMED_SEPARATOR and kind == "msg":
        hint = f"a .msg file has no separators; in a comment, write `# {text.split()[0]}`"
        return msgspec.structs.replace(fault, hint=hint)
    word = re.match(r"(?:std::)?(\w+)[<(]", text)
    if fault.code is codes.MALFORMED_TYPE and word and word[1].lower() in (*_LISTS, *_MAPS):
        return msgspec.structs.replace(fault, hint=type_hint(word[1]))
    return None


def _of_c(text: str) -> Fault | None:
    """Return the fault of a type of several words, such as `unsigned int`."""
    words = list(takewhile(lambda word: word.group() in _C_WORDS, re.finditer(r"\S+", text)))
    if len(words) == 1 or words[0].group() == "char":
        return None
    whole = " ".join(word.group() for word in words)
    c_type = whole.removesuffix(" int").removeprefix("signed ")
    primitive = _C_TYPES.get(c_type) or _TYPES.get(c_type) or "int32"
    message = f"unknown type `{whole}`"
    return Fault(codes.UNKNOWN_TYPE, message, 0, words[-1].end(), f"did you mean `{primitive}`?")


def _field(body: tree.Field) -> Fault | None:
    type_, name = body.type.whole.text, body.name
    if "," in name.text:
        listed = f"{name.text} {body.default.text if body.default else ''}".split(",")
        definitions = [f"`{type_} {part.strip()}`" for part in listed if part.strip()]
        hint = f"write one line for each: {', '.join(definitions[:4])}"
        return fault_at(codes.INVALID_FIELD_NAME, name, "a line can define only one field", hint)
    plain, bracket, size = name.text.partition("[")
    if bracket and size.endswith("]"):
        hint = f"write the brackets after the type: `{type_}[{size} {plain}`"
        return _invalid(codes.INVALID_FIELD_NAME, "field", name, hint)
    if type_.endswith(":"):
        hint = f"write the type first: `{name.text} {type_[:-1]}`"
        return _invalid(codes.INVALID_TYPE_NAME, "type", body.type.whole, hint)
    return None


def _constant(body: tree.Constant) -> Fault | None:
    type_, name, value = body.type.whole.text, body.name, body.value.text
    if not value or len(value) > 40:
        value = "VALUE"
    if not name.text:
        hint = f"write `{type_} NAME={value}`"
        code, end = codes.INVALID_CONSTANT_NAME, name.end + 1
        return Fault(code, "a constant has no name", name.start, end, hint)
    if names.is_field_name(name.text):
        hint = f"for a default value, omit the equals sign: `{type_} {name.text} {value}`"
        if type_ in (*ir.PRIMITIVES, *STRINGS):
            hint += f"; for a constant, use the name `{name.text.upper()}`"
        return _invalid(codes.INVALID_CONSTANT_NAME, "constant", name, hint)
    return None


def field_name(name: str) -> Fault | None:
    """Return the fault of a field's name, or `None`."""
    if names.is_field_name(name):
        return None
    like = names.field_name_like(name)
    hint = f"write `{like}`" if names.is_field_name(like) else names.FIELD_HINT
    return _invalid(codes.INVALID_FIELD_NAME, "field", tree.Piece(name, 0), hint)


def constant_name(name: str) -> Fault | None:
    """Return the fault of a constant's name, or `None`."""
    if names.is_constant_name(name):
        return None
    upper = names.field_name_like(name).upper()
    hint = f"write `{upper}`" if names.is_constant_name(upper) else names.CONSTANT_HINT
    return _invalid(codes.INVALID_CONSTANT_NAME, "constant", tree.Piece(name, 0), hint)


STRINGS = {"string": False, "wstring": True}
ROS1_TYPES = ("time", "duration")
_NO_FIELDS = {"srv": "services", "action": "actions"}


def lower_type(type_: tree.Type, package: str) -> ir.FieldType | Fault:
    """Return the meaning of a type in a file of `package`; offsets count from the line's start."""
    element = _element(type_, package)
    if isinstance(element, Fault) or type_.brackets is None:
        return element
    if type_.size is None:
        return ir.Sequence(element)
    size = positive(type_.size, "the array's size")
    if isinstance(size, Fault):
        return size
    return ir.Sequence(element, size) if type_.at_most else ir.Array(element, size)


def as_parsed(type_: ir.FieldType) -> ir.FieldType:
    """Return the type that rosidl's parser reads back: `wstring<=N[]` becomes bounded by N."""
    match type_:
        case ir.Sequence(ir.String(wide=True, bound=int(bound)) as element, None):
            return ir.Sequence(element, bound)
    return type_


def _element(type_: tree.Type, package: str) -> ir.Element | Fault:
    name = type_.name.text
    if name in STRINGS:
        bound = None if type_.bound is None else positive(type_.bound, "the string's bound")
        return bound if isinstance(bound, Fault) else ir.String(STRINGS[name], bound)
    if type_.bound is not None:
        piece = tree.Piece("<=" + type_.bound.text, type_.bound.start - 2)
        hint = f"for at most {type_.bound.text} elements, write `{name}[<={type_.bound.text}]`"
        return fault_at(codes.BOUND_ON_NON_STRING, piece, f"`{name}` cannot have a bound", hint)
    if name in ir.PRIMITIVES:
        return ir.Primitive(name)
    if name in ROS1_TYPES:
        message = f"`{name}` is a ROS 1 type"
        hint = f"write `builtin_interfaces/{name.capitalize()}`"
        return fault_at(codes.ROS1_TYPE, type_.name, message, hint)
    return _reference(type_.name, package)


def _reference(piece: tree.Piece, package: str) -> ir.Element | Fault:
    parts = piece.text.split("/")
    if len(parts) > 2:
        hint = "write `package/Name`"
        if len(parts) == 3:
            hint = f"write `{parts[0]}/{parts[-1].removesuffix('.msg')}`"
        if len(parts) == 3 and parts[1] in _NO_FIELDS:
            hint = f"only messages can be the type of a field, not {_NO_FIELDS[parts[1]]}"
        return fault_at(codes.INVALID_TYPE_NAME, piece, f"`{piece.text}` has too many parts", hint)
    if len(parts) == 2 and not names.is_package_name(parts[0]):
        wrong = tree.Piece(parts[0], piece.start)
        return _invalid(codes.INVALID_TYPE_NAME, "package", wrong, names.PACKAGE_HINT)
    name = parts[-1]
    if names.is_message_name(name):
        return ir.Ref(ir.TypeName(parts[0] if len(parts) == 2 else package, "msg", name))
    like = names.message_name_like(name.removesuffix(".msg"))
    hint = f"write `{like}`" if names.is_message_name(like) else names.MESSAGE_HINT
    if len(parts) == 1:
        if dotted := ros_spelling(name):
            hint = f"write `{dotted}`"
        elif spelling := type_hint(name):
            return fault_at(codes.UNKNOWN_TYPE, piece, f"unknown type `{name}`", spelling)
    wrong = tree.Piece(name, piece.end - len(name))
    return _invalid(codes.INVALID_TYPE_NAME, "type", wrong, hint)


def positive(piece: tree.Piece, subject: str) -> int | Fault:
    """Return a piece as a size or bound; `subject` begins the message if it is none."""
    try:
        value = int(piece.text)
    except ValueError:
        value = 0
    if value > 0:
        return value
    message = f"{subject} is not a positive integer"
    return fault_at(codes.BAD_BOUND, piece, message, "write a decimal number above 0")


def fault_at(code: codes.DiagnosticCode, piece: tree.Piece, message: str, hint: str) -> Fault:
    """Return the fault of a piece of a line."""
    return Fault(code, message, piece.start, piece.end, hint)


def _invalid(code: codes.DiagnosticCode, noun: str, name: tree.Piece, hint: str) -> Fault:
    return fault_at(code, name, f"`{name.text}` cannot be a {noun} name", hint)
