"""Clouds of points as numpy arrays, with the functions of sensor_msgs_py.point_cloud2."""

from __future__ import annotations

import sys
from array import array
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.lib.recfunctions import structured_to_unstructured, unstructured_to_structured

from idlc.robot.nodes.interfaces import standard

#: The types of numpy by the constants of PointField.
_TYPES = dict(enumerate("i1 u1 i2 u2 i4 u4 f4 f8".split(), 1))


def _point_type(fields: Iterable[Any], point_step: int | None = None) -> Any:
    """Return the type of a point of `point_step` bytes; a field of several values becomes several.

    Raises KeyError for a type that PointField does not have.
    """
    names, formats, offsets = [], [], []
    for number, field in enumerate(fields):
        name, kind = field.name or f"unnamed_field_{number}", np.dtype(_TYPES[field.datatype])
        for part in range(field.count):
            names.append(f"{name}_{part}" if field.count > 1 else name)
            formats.append(kind)
            offsets.append(field.offset + part * kind.itemsize)
    size = {} if point_step is None else {"itemsize": point_step}
    layout: Any = {"names": names, "formats": formats, "offsets": offsets, **size}
    return np.dtype(layout)


def read_points(
    cloud: Any,
    field_names: Sequence[str] | None = None,
    skip_nans: bool = False,
    uvs: Iterable[int] | None = None,
    reshape_organized_cloud: bool = False,
) -> Any:
    """Return the points as a structured array: of some fields, without NaN, at the positions `uvs`.

    Raises KeyError for a field that the cloud does not have, and TypeError if its data is short.
    """
    dtype = _point_type(cloud.fields, cloud.point_step)
    stored = dtype.newbyteorder(">" if cloud.is_bigendian else "<")
    points: Any = np.ndarray((cloud.width * cloud.height,), stored, cloud.data)
    points = points if stored == dtype else points.astype(dtype)
    if field_names is not None:
        points = points[[*field_names]]
    if skip_nans and not cloud.is_dense:
        is_nan = [np.isnan(points[name]) for name in points.dtype.names]
        points = points[~np.any(is_nan, axis=0)]
    if uvs is not None:
        points = points[uvs if isinstance(uvs, np.ndarray) else np.fromiter(uvs, int)]
    if reshape_organized_cloud and cloud.height > 1:
        points = points.reshape(cloud.width, cloud.height)
    return points


def read_points_numpy(cloud: Any, *args: Any, **kwargs: Any) -> Any:
    """Return the points as a plain array, of which all fields have one type; see `read_points`."""
    return structured_to_unstructured(read_points(cloud, *args, **kwargs))


def create_cloud(
    header: Any, fields: Sequence[Any], points: Any, point_step: int | None = None
) -> Any:
    """Return a PointCloud2 of an array or of tuples; ValueError if they do not fit the fields."""
    dtype = _point_type(fields, point_step)
    if not isinstance(points, np.ndarray):
        points = np.array([*map(tuple, points)], dtype)
    elif points.dtype.names is None:
        points = unstructured_to_structured(points, dtype)
    if points.dtype != dtype or points.ndim > 2:
        raise ValueError(f"the points are {points.dtype} in {points.ndim} dimensions, not {dtype}")
    width, height = (*points.shape, 1)[:2]
    data = np.zeros(points.shape, dtype)  # other arrays have anything between the fields
    data[:] = points
    return standard("sensor_msgs/msg/PointCloud2").kind(
        header=header,
        height=height,
        width=width,
        fields=[*fields],
        is_bigendian=sys.byteorder != "little",
        point_step=dtype.itemsize,
        row_step=dtype.itemsize * width,
        data=array("B", data.tobytes()),
    )


def create_cloud_xyz32(header: Any, points: Any) -> Any:
    """Return a PointCloud2 with x, y and z."""
    kind = standard("sensor_msgs/msg/PointField").kind
    fields = [
        kind(name=name, offset=offset, datatype=kind.FLOAT32, count=1)
        for name, offset in (("x", 0), ("y", 4), ("z", 8))
    ]
    return create_cloud(header, fields, points)
