"""Images, point clouds, grids and scans as arrays of numpy."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from idlc.recordings.columns.values import Columns, needing

#: The channels and the type of a channel of each encoding of images that has a name.
_NAMED = re.compile(r"(?:(mono|bayer_(?:rggb|bggr|gbrg|grbg))|(rgb|bgr)(a?))(8|16)")
_GENERIC = re.compile(r"(8|16|32|64)([USF])C([1-9]\d{0,2})?")
#: Two bytes for each pixel, and planes of bytes: how many rows these have for each row of pixels.
_PAIRS = {"yuv422", "yuv422_yuy2", "uyvy", "yuyv"}
_PLANES = {"nv21": (3, 2), "nv12": (3, 2), "nv24": (3, 1)}
#: The types of fields of points, by their number.
_DATATYPES = dict(enumerate("i1 u1 i2 u2 i4 u4 f4 f8".split(), 1))
#: A compressed image has at most so many pixels, unless a program allows more.
PIXELS = 1 << 26

Read = Callable[[str], Any]


def to_numpy(
    message: Any, kind: str | None = None, *, prefix: str = "", pixels: int = PIXELS
) -> Any:
    """Return the array of an Image, CompressedImage, PointCloud2, OccupancyGrid or LaserScan.

    >>> pixels = idlc.to_numpy(image)

    Values are those of the message: colours are not converted. Raw arrays share its memory where
    they can. The message may also be a mapping, such as a row of a table whose columns begin with
    `prefix`, or columns of many messages, for which a list is returned. These, and messages of
    other types with the same fields, need a `kind`, such as "Image". Raises ValueError if the data
    does not fit the description, or if a compressed image has more than `pixels`.
    """
    name = type(message).__name__ if kind is None else kind
    if not (isinstance(name, str) and name in _KINDS):
        raise ValueError(f"{name} is not one of {', '.join(_KINDS)}: name one of them as `kind`")
    if isinstance(message, Columns):
        rows = [_row(message, prefix, row) for row in range(len(message))]
        return [_KINDS[name](read, pixels) for read in rows]
    if isinstance(message, Mapping):
        return _KINDS[name](lambda field: message[prefix + field], pixels)
    return _KINDS[name](lambda field: getattr(message, field), pixels)


def _row(columns: Columns, prefix: str, row: int) -> Read:
    return lambda field: columns[prefix + field][row]


def _member(value: Any, name: str) -> Any:
    return value[name] if isinstance(value, Mapping) else getattr(value, name)


def _bytes(data: Any) -> Any:
    """Return data of any type as an array of bytes, without a copy of buffers."""
    if isinstance(data, list):
        data = bytes(data)
    return np.frombuffer(data, np.uint8)


def _view(data: Any, shape: tuple[int, ...], dtype: Any, strides: tuple[int, ...]) -> Any:
    """Return a view of rows; the last one needs no padding."""
    sizes = zip(shape, strides, strict=True)
    needed = sum((size - 1) * stride for size, stride in sizes) + dtype.itemsize
    if 0 in shape:
        return np.zeros(shape, dtype)
    if needed > len(data):
        raise ValueError(f"the data has {len(data):,} bytes, and its description {needed:,}")
    return np.ndarray(shape, dtype, data, 0, strides)


def _pixel(encoding: str) -> tuple[str, int]:
    """Return the type and the number of the channels of an encoding."""
    if match := _NAMED.fullmatch(encoding):
        channels = 1 if match[1] else len(match[2] + match[3])
        return f"u{int(match[4]) // 8}", channels
    if match := _GENERIC.fullmatch(encoding):
        size = int(match[1]) // 8
        if match[2] != "F" or size > 1:
            return f"{match[2].lower().replace('s', 'i')}{size}", int(match[3] or 1)
    if encoding in _PAIRS:
        return "u1", 2
    raise ValueError(f"`{encoding}` is not an encoding of ROS 2")


def _image(read: Read, _: int) -> Any:
    height, width, step = (int(read(name)) for name in ("height", "width", "step"))
    data, encoding = _bytes(read("data")), str(read("encoding"))
    if encoding in _PLANES:
        rows, per = _PLANES[encoding]
        return _view(data, (height * rows // per, width), np.dtype("u1"), (step or width, 1))
    code, channels = _pixel(encoding)
    dtype = np.dtype((">" if read("is_bigendian") else "<") + code)
    least = width * channels * dtype.itemsize
    if step < least and height:
        raise ValueError(f"the step is {step:,} bytes, and a row needs {least:,}")
    strides = (step, channels * dtype.itemsize, dtype.itemsize)
    pixels = _view(data, (height, width, channels), dtype, strides)
    pixels = pixels.astype(dtype.newbyteorder("="), copy=False)
    return pixels[:, :, 0] if channels == 1 else pixels


def _compressed(read: Read, most: int) -> Any:
    if "compressedDepth" in str(read("format")):
        raise ValueError("idlc does not decode images of compressed_depth_image_transport")
    with needing("pillow", "to_numpy of compressed images"):
        from PIL import Image
    try:
        with Image.open(io.BytesIO(_bytes(read("data")))) as image:
            width, height = image.size
            if width * height > most:
                raise ValueError(f"the image has {width:,} × {height:,} pixels, more than {most:,}")
            return np.asarray(image.convert("RGB") if image.mode == "P" else image)
    except (OSError, SyntaxError, Image.DecompressionBombError) as error:
        raise ValueError(f"the image cannot be decoded: {error}") from error


def _cloud(read: Read, _: int) -> Any:
    height, width, row, step = (
        int(read(name)) for name in ("height", "width", "row_step", "point_step")
    )
    order = ">" if read("is_bigendian") else "<"
    names, formats, offsets = [], [], []
    for number, field in enumerate(read("fields")):
        type_, count, offset = (
            int(_member(field, name)) for name in ("datatype", "count", "offset")
        )
        name = str(_member(field, "name")) or f"unnamed_field_{number}"
        if type_ not in _DATATYPES or not count:
            raise ValueError(f"field `{name}` has type {type_} and {count} elements")
        size = np.dtype(_DATATYPES[type_]).itemsize * count
        if offset + size > step:
            raise ValueError(f"field `{name}` ends at byte {offset + size}, and a point at {step}")
        names.append(name)
        formats.append(
            (order + _DATATYPES[type_], (count,)) if count > 1 else order + _DATATYPES[type_]
        )
        offsets.append(offset)
    if len(set(names)) < len(names):
        raise ValueError(f"several fields have one name, among {', '.join(names)}")
    if row < width * step and height > 1:
        raise ValueError(
            f"the row step is {row:,} bytes, and {width:,} points need {width * step:,}"
        )
    description: Any = {"names": names, "formats": formats, "offsets": offsets, "itemsize": step}
    points = _view(_bytes(read("data")), (height, width), np.dtype(description), (row, step))
    return points[0] if height == 1 else points


def _grid(read: Read, _: int) -> Any:
    info, cells = read("info"), np.asarray(read("data"), np.int8)
    shape = int(_member(info, "height")), int(_member(info, "width"))
    if cells.size != shape[0] * shape[1]:
        raise ValueError(f"the grid has {cells.size:,} cells, not {shape[0]:,} × {shape[1]:,}")
    return cells.reshape(shape)


def _scan(read: Read, _: int) -> Any:
    """Return angle, range, x, y and, if there are any, intensity of each beam."""
    ranges = np.asarray(read("ranges"), np.float32)
    intensities = np.asarray(read("intensities"), np.float32)
    names = ["angle", "range", "x", "y"]
    names += ["intensity"] * bool(len(intensities) == len(ranges) and len(ranges))
    beams = np.zeros(len(ranges), [(name, np.float32) for name in names])
    angles = float(read("angle_min")) + np.arange(len(ranges)) * float(read("angle_increment"))
    beams["angle"], beams["range"] = angles, ranges
    with np.errstate(invalid="ignore"):  # beams that hit nothing are infinite
        beams["x"], beams["y"] = ranges * np.cos(angles), ranges * np.sin(angles)
    if "intensity" in names:
        beams["intensity"] = intensities
    return beams


_KINDS: dict[str, Callable[[Read, int], Any]] = {
    "Image": _image,
    "CompressedImage": _compressed,
    "PointCloud2": _cloud,
    "OccupancyGrid": _grid,
    "LaserScan": _scan,
}
