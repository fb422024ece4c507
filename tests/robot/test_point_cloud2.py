"""Clouds of points in the words of sensor_msgs_py."""

import math

import pytest

import idlc

np = pytest.importorskip("numpy")
from idlc.robot.nodes import point_cloud2  # noqa: E402 - it imports numpy

Header = idlc.load("std_msgs/msg/Header").Header
PointField = idlc.load("sensor_msgs/msg/PointField").PointField
HEADER = Header(frame_id="map")
FIELDS = [
    PointField(name="ring", offset=0, datatype=PointField.UINT8, count=2),
    PointField(offset=8, datatype=PointField.FLOAT64, count=1),
]
XYZ = ["x", "y", "z"]


def test_tuples_become_a_cloud_and_an_array_again():
    cloud = point_cloud2.create_cloud_xyz32(HEADER, [(1, 2, 3), (4, 5, math.nan), (7, 8, 9)])
    assert (cloud.header, cloud.width, cloud.height) == (HEADER, 3, 1)
    assert (cloud.point_step, cloud.row_step, cloud.is_dense) == (12, 36, False)
    points = point_cloud2.read_points(cloud)
    assert points.dtype == [(name, "f4") for name in XYZ]
    assert points["x"].tolist() == [1, 4, 7]
    assert point_cloud2.read_points(cloud, ["z", "x"], skip_nans=True).tolist() == [(3, 1), (9, 7)]
    assert point_cloud2.read_points(cloud, uvs=[2, 0])["y"].tolist() == [8, 2]
    assert point_cloud2.read_points_numpy(cloud, ["x", "y"]).tolist() == [[1, 2], [4, 5], [7, 8]]
    copy = type(cloud).deserialize(cloud.serialize())
    assert point_cloud2.read_points(copy)["x"].tolist() == [1, 4, 7]


def test_fields_of_several_values_gaps_and_the_other_byte_order():
    cloud = point_cloud2.create_cloud(HEADER, FIELDS, [(1, 2, 0.5), (3, 4, 1.5)])
    assert bytes(cloud.data[:8]) == bytes([1, 2, 0, 0, 0, 0, 0, 0])
    points = point_cloud2.read_points(cloud)
    assert points.dtype.names == ("ring_0", "ring_1", "unnamed_field_1")
    assert points.tolist() == [(1, 2, 0.5), (3, 4, 1.5)]
    cloud.data = points.astype(points.dtype.newbyteorder()).tobytes()
    cloud.is_bigendian = not cloud.is_bigendian
    assert point_cloud2.read_points(cloud).tolist() == points.tolist()
    assert point_cloud2.read_points(cloud).dtype == points.dtype


def test_organized_arrays_keep_their_shape():
    array = np.arange(24, dtype="f4").reshape(2, 4, 3)
    fields = point_cloud2.create_cloud_xyz32(HEADER, []).fields
    cloud = point_cloud2.create_cloud(HEADER, fields, array)
    assert (cloud.width, cloud.height, cloud.row_step) == (2, 4, 24)
    points = point_cloud2.read_points(cloud, reshape_organized_cloud=True)
    assert points.shape == (2, 4)
    assert points["y"].tolist() == array[..., 1].tolist()
    with pytest.raises(ValueError, match="3 dimensions"):
        point_cloud2.create_cloud(HEADER, fields, array.reshape(1, 2, 4, 3))
