"""The packages of a workspace beside one: the Python modules of each, and what it depends on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path

from idlc.diagnostics.report import Report
from idlc.project.files import entries, is_file, is_folder
from idlc.project.find import KIND_FOLDERS
from idlc.project.package_xml import read_statements
from idlc.project.root import MANIFEST, Root

#: Python modules of ROS 2 without interfaces, and the package that provides each.
LIBRARIES = {
    **{
        name: name
        for name in (
            "ament_index_python cv_bridge geometry_msgs launch launch_ros launch_testing "
            "message_filters rclpy ros2cli ros2launch rosbag2_py rosidl_runtime_py sensor_msgs_py "
            "tf2_geometry_msgs tf_transformations"
        ).split()
    },
    "tf2_ros": "tf2_ros_py",
    "moveit": "moveit_py",
    "urdf_parser_py": "urdfdom_py",
}
#: Folders of a package that contain its Python packages.
_HOMES = ("", "src", "python")


class Neighbours:
    """The compiled packages by name, each with its folders."""

    def __init__(self, folders: Mapping[str, Sequence[Path]], root: Root) -> None:
        self._folders = folders
        self._root = root

    @cached_property
    def _homes(self) -> dict[str, Path]:
        """The folder of each package that has a package.xml."""
        manifests = {
            name: self._root.manifest(folder)
            for name, folders in self._folders.items()
            for folder in folders[:1]
        }
        return {name: path.parent for name, path in manifests.items() if path}

    @cached_property
    def _needs(self) -> dict[str, set[str]]:
        """The packages that each one depends on, for whatever purpose."""
        needs = {}
        for name, home in self._homes.items():
            declared = read_statements(home / MANIFEST, MANIFEST, self._root, Report())
            needs[name] = {each.text for each in declared if each.tag.endswith("depend")}
        return needs

    def dependents(self, package: str) -> frozenset[str]:
        """Return the packages that depend on one, directly or by others, and the package itself."""
        users: dict[str, set[str]] = {}
        for name, needed in self._needs.items():
            for each in needed:
                users.setdefault(each, set()).add(name)
        reached: set[str] = set()
        waiting = {package}
        while waiting:
            name = waiting.pop()
            reached.add(name)
            waiting |= users.get(name, set()) - reached
        return frozenset(reached)

    def providers(self, ros_packages: Iterable[str]) -> dict[str, frozenset[str]]:
        """Return the packages that provide each Python module.

        One of the workspace provides what its folder contains. All other ROS packages, which are
        known by their interfaces, provide the module of their name.
        """
        modules = {name: {name} for name in ros_packages if name not in self._folders}
        modules |= {module: {package} for module, package in LIBRARIES.items()}
        for name, folders in self._folders.items():
            modules.get(name, set()).discard(name)  # as a package of C++ alone does
            for module in self._modules(name, folders):
                modules.setdefault(module, set()).add(name)
        return {module: frozenset(packages) for module, packages in modules.items() if packages}

    def _modules(self, package: str, folders: Sequence[Path]) -> set[str]:
        has_interfaces = any(
            is_folder(folder / kind) for folder in folders for kind in KIND_FOLDERS
        )
        home = self._homes.get(package)
        places = [home / inside for inside in _HOMES] if home else []
        inside = (path for place in places for path in entries(place))
        modules = {
            path.stem
            for path in inside
            if is_file(path / "__init__.py") or (path.suffix == ".py" and path.parent == home)
        }
        return modules | {package} if has_interfaces else modules
