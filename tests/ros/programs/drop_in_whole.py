"""Operations on whole messages; each is given a class and returns what JSON knows.

ROS's own Python tools (rosidl_runtime_py) have no wheel; what they do to a message is done here:
they go over SLOT_TYPES, read fields, and fill in dictionaries by `type(field)(value)`.
"""

import array
import copy
import pickle
import zlib
from importlib import import_module

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from trees import Values, shape_of


def fields_of(message):
    return message.get_fields_and_field_types()


def ordered(value, slot=None):
    """Return a message as the tools' ordered dictionaries have it."""
    if hasattr(value, "get_fields_and_field_types"):
        slots = zip(fields_of(value), value.SLOT_TYPES, strict=True)
        return {name: ordered(getattr(value, name), slot) for name, slot in slots}
    if isinstance(value, (list, tuple, array.array, np.ndarray)):
        return [ordered(one) for one in value]
    if isinstance(value, bytes):
        return str(value)
    return value.item() if isinstance(value, np.generic) else value


def plain(value):
    """Return a message as somebody would write it in YAML."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in fields_of(value)}
    if isinstance(value, (list, tuple, array.array, np.ndarray)):
        return [plain(one) for one in value]
    return value.item() if isinstance(value, np.generic) else value


def fill(message, values):
    """Set fields as the tools do, who try the type of a field before they go into it."""
    if not hasattr(values, "items"):
        raise TypeError(f"{values!r} is expected to be a dictionary")
    for (name, value), slot in zip(values.items(), message.SLOT_TYPES, strict=False):
        field = getattr(message, name)
        kind = type(field)
        if kind is array.array:
            made = kind(field.typecode, value)
        elif kind is np.ndarray:
            made = np.array(value, dtype=field.dtype)
        elif type(value) is kind:
            made = value
        else:
            try:
                made = kind(value)
            except TypeError:
                made = kind()
                fill(made, value)
        element = getattr(slot, "value_type", None)
        if element is not None and hasattr(element, "namespaces"):
            inner = getattr(import_module(".".join(element.namespaces)), element.name)
            for index, one in enumerate(made):
                nested = inner()
                fill(nested, one)
                made[index] = nested
        setattr(message, name, made)


def invented(cls):
    """Return a message with a value in every field, the same on both sides."""
    name = f"{cls.__module__.split('.')[0]}/{cls.__module__.split('.')[1]}/{cls.__name__}"
    shapes = shapes_below(cls, name)
    values = Values(shapes, seed=zlib.crc32(name.encode()))
    values.random.seed(zlib.crc32(name.encode()))
    return values.build(name, values.invent(name))


def shapes_below(cls, name):
    from trees import class_of

    found, waiting = {}, [name]
    while waiting:
        one = waiting.pop()
        if one in found:
            continue
        found[one] = shape_of(class_of(*one.split("/")))
        for _, _, element in found[one].values():
            if isinstance(element, list) and len(element) == 3:
                waiting.append("/".join(element))
    return found


def kinds(message):
    """Return the type of each field's value, and of its elements."""
    found = {}
    for name in fields_of(message):
        value = getattr(message, name)
        found[name] = f"{type(value).__module__.split('.')[0]}.{type(value).__name__}"
        for extra in ("typecode", "dtype"):
            found[name] += f" {getattr(value, extra, '')}"
        if isinstance(value, list) and value:
            found[name] += f" of {type(value[0]).__name__}"
    return found


def constants(cls):
    names = [name for name in dir(cls) if name.isupper() and name != "SLOT_TYPES"]
    return {name: repr(getattr(cls, name)) for name in names}


#: Exceptions that somebody may catch, the most telling first.
TELLING = (AssertionError, TypeError, OverflowError, AttributeError, ValueError, Exception)


def told_as(error):
    """Return the exceptions as which an error can be caught."""
    return [kind.__name__ for kind in TELLING if isinstance(error, kind)]


def refusal(action):
    """Return as what something is refused; nothing if it is taken."""
    try:
        action()
    except Exception as error:
        return told_as(error)
    return []


def filled(cls, values):
    message = cls()
    fill(message, values)
    return repr(message)


def copies(cls):
    message = invented(cls)
    made = [copy.copy(message), copy.deepcopy(message)]
    made += [pickle.loads(pickle.dumps(message, protocol)) for protocol in range(2, 6)]
    return [[isinstance(one, cls), repr(one) == repr(message)] for one in made]


def shared(cls):
    """Return whether a copy shares what its fields hold."""
    message = invented(cls)
    shallow, deep = copy.copy(message), copy.deepcopy(message)
    found = {}
    for name in fields_of(message):
        value = getattr(message, name)
        if isinstance(value, (list, array.array, np.ndarray)):
            found[name] = [getattr(shallow, name) is value, getattr(deep, name) is value]
    return found


def nested_texts(cls):
    """Return what becomes of a text in the place of each field, as in `{header: auto}`."""
    return {name: refusal(lambda name=name: filled(cls, {name: "auto"})) for name in fields_of(cls)}


ON_MESSAGES = {
    "repr": lambda cls: repr(cls()),
    "repr of values": lambda cls: repr(invented(cls)),
    "types": lambda cls: kinds(cls()),
    "types of values": lambda cls: kinds(invented(cls)),
    "types as read": lambda cls: kinds(deserialize_message(serialize_message(invented(cls)), cls)),
    "checks as read": lambda cls: deserialize_message(serialize_message(cls()), cls)._check_fields,
    "value as read": lambda cls: repr(deserialize_message(serialize_message(invented(cls)), cls)),
    "fields": lambda cls: fields_of(cls),
    "slot types": lambda cls: {name: str(shape) for name, shape in shape_of(cls).items()},
    "slots": lambda cls: list(cls.__slots__),
    "constants": constants,
    "constants of an instance": lambda cls: {
        name: repr(getattr(cls(), name)) for name in constants(cls)
    },
    "a constant is set": lambda cls: {
        name: [
            refusal(lambda name=name: setattr(cls, name, 1)),
            refusal(lambda name=name: setattr(cls(), name, 1)),
        ]
        for name in constants(cls)
    },
    "hash": lambda cls: refusal(lambda: hash(cls())),
    "equal": lambda cls: [cls() == cls(), cls() != cls(), cls() == None, cls() == 5],  # noqa: E711
    "other is unequal": lambda cls: cls() == object(),
    "copies": copies,
    "shared by copies": shared,
    "names": lambda cls: [cls.__name__, cls.__module__, cls.__qualname__, type(cls).__name__],
    "unknown keyword": lambda cls: refusal(lambda: cls(nonesuch=1)),
    "unknown keyword, checked": lambda cls: refusal(lambda: cls(nonesuch=1, check_fields=True)),
    "unknown attribute": lambda cls: refusal(lambda: setattr(cls(), "nonesuch", 1)),
    "unknown attribute read": lambda cls: refusal(lambda: cls().nonesuch),
    "a dictionary by position": lambda cls: refusal(lambda: cls({"nonesuch": 1})),
    "a text by position": lambda cls: refusal(lambda: cls("auto")),
    "checks": lambda cls: [cls()._check_fields, cls(check_fields=True)._check_fields],
    "checked": lambda cls: repr(cls(check_fields=True)) == repr(cls()),
    "ordered dictionary": lambda cls: ordered(invented(cls)),
    "filled by itself": lambda cls: filled(cls, plain(invented(cls))),
    "filled by a text": nested_texts,
    "filled by nothing": lambda cls: filled(cls, {}),
}
