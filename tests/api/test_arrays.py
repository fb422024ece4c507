"""Arrays of images, points, grids and scans: number by number what their bytes say."""

import io
import random
import struct
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

import idlc
from tests.support import recordings as made

#: Encodings: the letter that `struct` has for a channel, and the number of these.
ENCODINGS = {
    "mono8": ("B", 1), "mono16": ("H", 1), "rgb8": ("B", 3), "bgr8": ("B", 3), "rgba8": ("B", 4),
    "bgra8": ("B", 4), "rgb16": ("H", 3), "bgr16": ("H", 3), "rgba16": ("H", 4),
    "bgra16": ("H", 4), "8UC1": ("B", 1), "8SC2": ("b", 2), "16UC3": ("H", 3), "16SC4": ("h", 4),
    "32SC1": ("i", 1), "32FC1": ("f", 1), "64FC2": ("d", 2), "16UC": ("H", 1), "16FC1": ("e", 1),
    "8UC5": ("B", 5), "bayer_rggb8": ("B", 1), "bayer_grbg16": ("H", 1), "yuv422": ("B", 2),
    "yuv422_yuy2": ("B", 2), "uyvy": ("B", 2), "yuyv": ("B", 2),
}  # fmt: skip


def image(encoding, height, width, step, data, big=0):
    return SimpleNamespace(
        height=height, width=width, encoding=encoding, step=step, is_bigendian=big, data=data
    )


@pytest.mark.parametrize("big", [0, 1])
def test_each_number_of_an_image_is_where_step_and_order_say(big):
    rng = random.Random(big)
    for encoding, (letter, channels) in ENCODINGS.items():
        height, width, padding = rng.randrange(1, 5), rng.randrange(1, 5), rng.randrange(4)
        row = struct.Struct("<>"[big] + letter * channels * width)
        data = rng.randbytes((row.size + padding) * height)
        message = image(encoding, height, width, row.size + padding, data, big)
        found = idlc.to_numpy(message, "Image")
        wanted = [list(row.unpack_from(data, (row.size + padding) * y)) for y in range(height)]
        assert found.shape == ((height, width) if channels == 1 else (height, width, channels))
        assert found.dtype.isnative
        np.testing.assert_array_equal(found.reshape(height, -1), wanted)
        message.data = data[: len(data) - padding]  # the last row needs no padding
        np.testing.assert_array_equal(idlc.to_numpy(message, "Image"), found)
        message.data = data[: len(data) - padding - 1]
        with pytest.raises(ValueError, match=r"the data has \d+ bytes, and its description"):
            idlc.to_numpy(message, "Image")


def test_planes_are_rows_of_bytes():
    for encoding, rows in (("nv21", 6), ("nv24", 12)):
        data = bytes(range(rows * 2))
        assert idlc.to_numpy(image(encoding, 4, 2, 2, data), "Image").tolist() == [
            [2 * row, 2 * row + 1] for row in range(rows)
        ]


def test_what_no_image_is_is_refused():
    for message, text in (
        (image("rgb9", 1, 1, 3, b"abc"), "`rgb9` is not an encoding"),
        (image("8FC1", 1, 1, 3, b"abc"), "`8FC1` is not an encoding"),
        (image("rgb8", 1, 2, 3, b"abc"), "the step is 3 bytes, and a row needs 6"),
        (image("mono8", 1 << 31, 1 << 31, 1 << 31, b""), "the data has 0 bytes"),
    ):
        with pytest.raises(ValueError, match=text):
            idlc.to_numpy(message, "Image")
    with pytest.raises(ValueError, match="SimpleNamespace is not one of Image"):
        idlc.to_numpy(image("mono8", 0, 0, 0, b""))
    assert idlc.to_numpy(image("rgb8", 0, 0, 0, b""), "Image").shape == (0, 0, 3)


def test_compressed_images_are_decoded_up_to_a_size():
    pixels = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    for mode in (pixels, pixels[:, :, 0], pixels[:, :, 0].astype(np.uint16) * 300):
        file = io.BytesIO()
        Image.fromarray(mode).save(file, "png")
        message = SimpleNamespace(format="png", data=file.getvalue())
        np.testing.assert_array_equal(idlc.to_numpy(message, "CompressedImage"), mode)
    with pytest.raises(ValueError, match="4 × 2 pixels, more than 7"):
        idlc.to_numpy(message, "CompressedImage", pixels=7)
    for data in (b"", b"\x89PNG", file.getvalue()[:60]):
        broken = SimpleNamespace(format="png", data=data)
        with pytest.raises(ValueError, match="the image cannot be decoded"):
            idlc.to_numpy(broken, "CompressedImage")
    depth = SimpleNamespace(format="16UC1; compressedDepth png", data=b"")
    with pytest.raises(ValueError, match="does not decode"):
        idlc.to_numpy(depth, "CompressedImage")


def test_points_grids_and_scans_of_recordings(tmp_path):
    """As columns of many messages, as messages, and as rows of tables."""
    store = made.STORE
    header = made.kind("std_msgs/msg/Header")(made.kind("builtin_interfaces/msg/Time")(0, 0), "")
    field = made.kind("sensor_msgs/msg/PointField")
    fields = [field("x", 0, 7, 1), field("n", 6, 2, 2), field("", 8, 8, 1)]
    row = struct.Struct(">f2x2Bd4x")
    points = [(0.5 * index, index, index + 1, float("nan")) for index in range(6)]
    content = b"".join(row.pack(*point) for point in points[:3]) + b"??"
    content += b"".join(row.pack(*point) for point in points[3:]) + b"??"
    size = row.size, row.size * 3 + 2
    cloud = made.kind("sensor_msgs/msg/PointCloud2")(
        header, 2, 3, fields, True, *size, np.frombuffer(content, np.uint8), True
    )
    scan = made.kind("sensor_msgs/msg/LaserScan")(
        header, 0.0, 1.0, np.pi / 2, 0.0, 0.0, 0.0, 9.0,
        np.array([1, 2, np.inf], np.float32), np.zeros(0, np.float32),
    )  # fmt: skip
    messages = {
        "/points": ("sensor_msgs/msg/PointCloud2", cloud),
        "/scan": ("sensor_msgs/msg/LaserScan", scan),
    }
    found = [
        made.Recorded(topic, type_, number, number, bytes(store.serialize_cdr(message, type_)))
        for number, (topic, (type_, message)) in enumerate(messages.items())
    ]
    with idlc.Recording(made.by_mcap(tmp_path / "a.mcap", found)) as recording:
        for read in (
            lambda topic, kind: idlc.to_numpy(recording[topic].to_columns(), kind)[0],
            lambda topic, _: idlc.to_numpy(next(recording[topic].messages()).message),
            lambda topic, kind: idlc.to_numpy(
                recording.aligned([topic], on=topic).to_arrow().to_pylist()[0],
                kind,
                prefix=f"{topic}.",
            ),
        ):
            found = read("/points", "PointCloud2")
            assert found.shape == (2, 3)
            assert found.dtype.names == ("x", "n", "unnamed_field_2")
            assert found["x"].ravel().tolist() == [point[0] for point in points]
            assert found["n"].reshape(6, 2).tolist() == [list(point[1:3]) for point in points]
            assert np.isnan(found["unnamed_field_2"]).all()
            beams = read("/scan", "LaserScan")
            np.testing.assert_allclose(beams["x"][:2], [1, 0], atol=1e-6)
            np.testing.assert_allclose(beams["y"][:2], [0, 2], atol=1e-6)
            assert np.isinf(beams["range"][2])
    grid = SimpleNamespace(info=SimpleNamespace(width=3, height=2), data=[-1, 0, 1, 2, 3, 100])
    assert idlc.to_numpy(grid, "OccupancyGrid").tolist() == [[-1, 0, 1], [2, 3, 100]]
    for name, value in (("offset", 17), ("count", 0), ("datatype", 9), ("name", "n")):
        other = SimpleNamespace(
            **{each: getattr(cloud, each) for each in cloud.__dataclass_fields__}
        )
        point = SimpleNamespace(name="x", offset=0, datatype=7, count=1)
        setattr(point, name, value)
        other.fields = [point, fields[1]]
        with pytest.raises(ValueError, match="field"):
            idlc.to_numpy(other, "PointCloud2")
