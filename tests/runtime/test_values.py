"""Any value that its field can hold comes back as it was."""

import struct

import pytest

from tests.support import generated
from tests.support.examples import HealthCheck, given, settings, st
from tests.support.values import INTEGERS

pytestmark = pytest.mark.usefixtures("standard")

STRINGS = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
FLOATS = {
    "float32": st.floats(width=32, allow_nan=False),
    "float64": st.floats(allow_nan=False),
}
ELEMENTS = {
    "bool": st.booleans(),
    "byte": st.binary(min_size=1, max_size=1),
    "char": st.integers(0, 255),
    "string": STRINGS,
    "wstring": STRINGS,
    **FLOATS,
    **{name: st.integers(*limits) for name, limits in INTEGERS.items()},
}
#: The fields of the recorded messages are named after their types.
SCALARS = {
    f"{'an' if name[0] == 'i' else 'a'}_{name}": element for name, element in ELEMENTS.items()
}
LISTS = {f"{name}s": st.lists(element, max_size=9) for name, element in ELEMENTS.items()}
ARRAYS = {
    f"{name}s": st.lists(element, min_size=3, max_size=3) for name, element in ELEMENTS.items()
}


def there_and_back(name, fields):
    cls = generated.class_of(f"idlc_fixtures/msg/{name}")
    assert set(cls.__match_args__) - {"nested"} == set(fields)
    message = cls(**fields)
    message.validate()
    for order in ("little", "big"):
        raw = message.serialize(byteorder=order)
        found = cls.deserialize(raw)
        assert found == message
        assert repr(found) == repr(message)
        assert found.serialize(byteorder=order) == raw
    assert cls.from_dict(message.to_dict()) == message


FEW = settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow], deadline=None)


@FEW
@given(st.fixed_dictionaries(SCALARS))
def test_numbers_and_strings_come_back_as_they_were(fields):
    there_and_back("AllPrimitives", fields)


@FEW
@given(st.fixed_dictionaries(LISTS))
def test_sequences_come_back_as_they_were(fields):
    there_and_back("Sequences", fields)


@FEW
@given(st.fixed_dictionaries(ARRAYS))
def test_arrays_come_back_as_they_were(fields):
    there_and_back("FixedArrays", fields)


@given(st.binary(min_size=8, max_size=8))
def test_floats_keep_their_bits(raw):
    cls = generated.class_of("std_msgs/msg/Float64")
    for order, code, header in (("little", "<d", b"\0\1\0\0"), ("big", ">d", b"\0\0\0\0")):
        message = cls.deserialize(header + raw)
        assert struct.pack(code, message.data) == message.serialize(byteorder=order)[4:] == raw


@given(st.binary(max_size=40))
def test_any_bytes_are_a_message_or_an_error(raw):
    for name in ("AllPrimitives", "Sequences", "WithDeps"):
        cls = generated.class_of(f"idlc_fixtures/msg/{name}")
        for header in (b"\0\1\0\0", b"\0\0\0\0"):
            try:
                assert type(cls.deserialize(header + raw)) is cls
            except ValueError as error:
                assert type(error).__name__ == "DecodeError"  # noqa: PT017
