"""Generated classes whose fields hold messages of classes that rosidl made."""

from array import array
from itertools import product

import numpy as np
import pytest

from tests.support import generated

#: What reading and comparing touch of rosidl's classes.
ROSIDLS = """\
from array import array


class MultiArrayDimension:
    __slots__ = ["_label", "_size", "_stride", "_check_fields"]


class MultiArrayLayout:
    __slots__ = ["_dim", "_data_offset", "_check_fields"]

    def __init__(self):
        self._dim, self._data_offset = [], 0

    def __eq__(self, other):
        return self._dim == other._dim and self._data_offset == other._data_offset


class _Numbers:
    __slots__ = ["_layout", "_data", "_check_fields"]

    def __init__(self, data=()):
        self._layout, self._data = MultiArrayLayout(), array(self.code, data)

    def __eq__(self, other):
        if self._layout != other._layout:
            return False
        if self._data != other._data:
            return False
        return True


class Float32MultiArray(_Numbers):
    __slots__ = []
    code = "f"


class UInt64MultiArray(_Numbers):
    __slots__ = []
    code = "Q"
"""
OWN = "uint8[] own\nstd_msgs/Float32MultiArray scan\nstd_msgs/UInt64MultiArray[] counts\n"
VALUES = [(), (1,), (2,), (1, 2), (1, 3), (1,) * 5000]


@pytest.fixture
def kind(tmp_path):
    generated.write_package(tmp_path, "own_msgs", {"msg/Own.msg": OWN})
    module = tmp_path / "std_msgs/msg/__init__.py"
    module.parent.mkdir(parents=True)
    module.write_text(ROSIDLS, encoding="utf-8")
    (tmp_path / "std_msgs/__init__.py").touch()
    with generated.importable(tmp_path):
        yield generated.class_of("own_msgs/msg/Own")


@pytest.mark.parametrize("order", ["little", "big"])
def test_messages_that_are_read_without_copies_are_equal_if_their_values_are(kind, order):
    scan = generated.class_of("std_msgs/msg/Float32MultiArray")
    counts = generated.class_of("std_msgs/msg/UInt64MultiArray")
    made = [kind(own=[1, 2], scan=scan(one), counts=[counts(one)] * 2) for one in VALUES]
    raws = [message.serialize(byteorder=order) for message in made]
    read = [kind.deserialize(raw, copy=False) for raw in raws]
    again = kind.deserialize_many(map(bytearray, raws), copy=False)
    for (at, mine), (other, theirs) in product(enumerate(read), repeat=2):
        for one in (theirs, made[other], again[other]):
            assert (mine == one) is (one == mine) is (at == other)
    assert all(type(one.own) is np.ndarray for one in read)
    assert all(type(one.scan._data) is array for one in read)
    assert [one.serialize(byteorder=order) for one in read] == raws
