"""Print what message classes make of None and of sequences: conversions_side.py NAME...

rosidl's or idlc's, whichever is imported by these names. Each line is a field, what kind of field
it is, and for each operation the type that is read, or the exception's bases.
"""

import json
import sys
from collections import UserList, deque

from trees import INTEGERS, class_of, shape_of

SEQUENCES = {
    "list": list,
    "tuple": tuple,
    "deque": deque,
    "UserList": UserList,
    "iterator": iter,
    "keys": lambda values: dict(enumerate(values)).keys(),
}


def good(element):
    if isinstance(element, list):
        return class_of(*element)() if len(element) == 3 else "good"
    if element in ("boolean", "octet"):
        return True if element == "boolean" else b"g"
    return 2 if element in INTEGERS else 2.5


def outcome(operation):
    try:
        kind = type(operation())
        return "message" if hasattr(kind, "get_fields_and_field_types") else kind.__name__
    except Exception as error:
        return [kind.__name__ for kind in type(error).__mro__[:-2]]


def assigned(message, field, value):
    setattr(message, field, value)
    return getattr(message, field)


def of_field(cls, field, shape):
    """Yield operations on a field with what comes of them."""
    container, size, element = shape
    for how, options in (("", {}), (", checked", {"check_fields": True})):
        given = {field: None, **options}
        yield f"None{how}", outcome(lambda given=given: getattr(cls(**given), field))
    if container == "one":
        return
    for name, make in SEQUENCES.items():
        count = size if container == "array" else 2

        def value(make=make, count=count):
            return make([good(element) for _ in range(count)])

        yield f"assigned {name}", outcome(lambda value=value: assigned(cls(), field, value()))
        yield (
            f"constructed {name}",
            outcome(lambda value=value: getattr(cls(**{field: value()}), field)),
        )


def kind_of(shape):
    """Return a field's container and what is in it, as the table of outcomes calls them."""
    container, _, element = shape
    if isinstance(element, list):
        return f"{container} {'message' if len(element) == 3 else 'text'}"
    return f"{container} {'integer' if element in INTEGERS else element.replace('double', 'float')}"


def main():
    for full in sys.argv[1:]:
        cls = class_of(*full.split("/"))
        unknown = {
            "keyword": outcome(lambda cls=cls: cls(no_such=1)),
            "keyword, checked": outcome(lambda cls=cls: cls(no_such=1, check_fields=True)),
        }
        print(json.dumps([full, "unknown", unknown]))
        for field, shape in shape_of(cls).items():
            if not field.startswith("gap"):
                done = dict(of_field(cls, field, shape))
                print(json.dumps([f"{full}.{field}", kind_of(shape), done]))


if __name__ == "__main__":
    main()
