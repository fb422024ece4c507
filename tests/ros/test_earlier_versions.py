"""Packages that an earlier version generated, beside packages of today, on the real rclpy."""

import shutil

from tests.generate.test_earlier_versions import VALUES, folder  # noqa: F401 (a fixture)


def test_they_are_published_and_called(program, folder, tmp_path):  # noqa: F811
    """Where std_msgs and builtin_interfaces are those of ROS 2."""
    path = tmp_path / "path"
    shutil.copytree(folder, path)
    for package in ("std_msgs", "builtin_interfaces", "unique_identifier_msgs"):
        shutil.rmtree(path / package)
    (path / "earlier_values.py").write_text(VALUES, encoding="utf-8")
    out, complaints = (process := program("earlier.py", path=path)).communicate()
    assert process.returncode == 0, complaints
    assert out.split() == [
        "outlines/msg/Path",
        "canvas/msg/Canvas",
        "robot/msg/Plan",
        "logged/msg/Reading",
        "robot/srv/Ask",
        "outlines/srv/Move",
        "outlines/action/Drive",
    ]
