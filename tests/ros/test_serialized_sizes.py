"""The sizes of messages that programs serialize with rclpy, and write to bags."""

from importlib import import_module

import pytest

import idlc
from idlc.recordings.lengths import MOST_PADDING, estimated_size
from idlc.runtime.typeinfo import structure_of

pytestmark = pytest.mark.ros

VALUES = [
    ("sensor_msgs/msg/JointState", {"name": ["a", "bcd"]}),
    ("std_msgs/msg/Float64MultiArray", {}),
    ("rcl_interfaces/msg/ParameterEvent", {"new_parameters": [{"name": "a"}, {"name": "bc"}]}),
    ("test_msgs/msg/WStrings", {"wstring_value": "abc"}),
    ("std_msgs/msg/Bool", {}),
]


@pytest.mark.parametrize(("name", "values"), VALUES, ids=lambda value: str(value)[-20:])
def test_fast_dds_gives_messages_the_estimated_size(name, values):
    from rclpy.serialization import deserialize_message, serialize_message
    from rclpy.utilities import get_rmw_implementation_identifier

    if get_rmw_implementation_identifier() != "rmw_fastrtps_cpp":
        pytest.skip("another middleware has no estimate")
    package, _, own = name.split("/")
    kind = idlc.load(name)[name]
    exact = kind.from_dict(values).serialize()
    message = deserialize_message(exact, getattr(import_module(f"{package}.msg"), own))
    raw = serialize_message(message)
    padding = len(raw) - estimated_size(structure_of(kind), raw)
    assert 0 <= padding <= MOST_PADDING
    if name != "std_msgs/msg/Bool":
        assert len(raw) - len(exact) > MOST_PADDING
