"""Where idlc's classes differ from rosidl's: one function for each section of docs/differences.md.

Each is given an operation and both outcomes, and returns whether it explains their difference. What
rosidl itself means by a value, its own check tells (`checked`): a value that the check refuses and
that is sent all the same is read as if it were of the right type, which is whatever lies in memory.
"""

from typing import NamedTuple


class Case(NamedTuple):
    """An operation and what came of it on both sides.

    `field` is the field's container, size and element as in `trees`, or nothing for a whole
    message; `value` names what was given to it; `right` is what rosidl makes of a list of right
    elements.
    """

    key: str
    field: list
    value: str
    checked: dict
    right: dict
    official: dict
    idlc: dict

    @property
    def is_checked(self):
        return self.key.endswith(", checked")

    @property
    def constructed(self):
        return "(" in self.key

    @property
    def is_numeric_list(self):
        """Whether rosidl's class converts what it is given."""
        container, _, element = self.field
        return container != "one" and isinstance(element, str) and element not in BYTES


BYTES = ("boolean", "octet")


def refuses(outcome):
    return "raised" in outcome or "refused" in outcome


def sends(outcome):
    return "read" in outcome and "refused" not in outcome


def wrong_values(case):
    """rosidl reads wrong values as if they were right; idlc refuses them, or sends the number."""
    if case.is_checked or not case.field or case.is_numeric_list:
        return False
    if not refuses(case.checked) and case.value not in ("append wrong", "append None"):
        return False
    if "bytes" in case.official and case.official["bytes"] == case.right.get("bytes"):
        return False
    if refuses(case.idlc):
        return True
    _, _, element = case.field
    return sends(case.idlc) and isinstance(element, str) and "text" not in case.value


def arrays_of_another_size(case):
    """rosidl sends arrays of another size or shape, cut or with what lies after them."""
    return bool(case.field) and case.field[0] == "array" and refuses(case.idlc)


def arrays_with_one_column(case):
    """A column of the right size is stored flat."""
    return (
        bool(case.field)
        and case.field[0] == "array"
        and case.official.get("bytes") == case.idlc.get("bytes")
        and case.value.endswith(("column", "list with list"))
    )


def strings_with_null_characters(case):
    """rosidl cuts a text at a zero character."""
    return case.value == "text NUL" and sends(case.idlc)


def none_as_a_default(case):
    """None in the place of a message or of elements is the default, where rosidl fails later."""
    return case.constructed and case.value == "None" and not refuses(case.idlc)


def unknown_keywords(case):
    """rosidl ignores keywords that are no fields, unless it checks."""
    return case.key.endswith("unknown keyword")


def positional_arguments(case):
    """Fields may be given by position."""
    return case.key.endswith(("by position", "filled by a text"))


def more_accepted_values(case):
    """idlc sends more kinds of sequences and texts than rosidl."""
    return bool(case.field) and refuses(case.official) and sends(case.idlc)


def slots(case):
    """There is no slot `_check_fields`."""
    return case.key.endswith(" slots") and case.official["told"] == [
        *case.idlc["told"],
        "_check_fields",
    ]


DIFFERENCES = (
    slots,
    unknown_keywords,
    positional_arguments,
    none_as_a_default,
    strings_with_null_characters,
    arrays_with_one_column,
    arrays_of_another_size,
    wrong_values,
    more_accepted_values,
)
