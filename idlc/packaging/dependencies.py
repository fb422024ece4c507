"""The dependencies of packages: what provides a module, and adding them to a package.xml.

An edit keeps every other byte.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path

from idlc.diagnostics.report import Edit, Report, apply
from idlc.diagnostics.source import Source, Span
from idlc.packaging.files import Edited, Outcome, Refused
from idlc.project.files import entries, is_file, is_folder
from idlc.project.find import KIND_FOLDERS
from idlc.project.package_xml import NOT_XML, Manifest, Statement, read, read_statements, statements
from idlc.project.root import MANIFEST, Root

#: The elements of a package.xml in the order of the schema: dependencies come after the head.
HEAD = ("name", "version", "description", "maintainer", "license", "url", "author")
DEPENDENCIES = (
    *("build_depend", "build_export_depend", "buildtool_depend", "buildtool_export_depend"),
    *("exec_depend", "run_depend", "depend", "doc_depend", "test_depend"),
    *("conflict", "replace", "group_depend", "member_of_group"),
)
RANK = {tag: at for at, tag in enumerate((*HEAD, *DEPENDENCIES))}
_BLANK_LINE = re.compile(r"[^\S\n]*\n[^\S\n]*\n")
#: Tags that make a package available when a node runs.
AT_RUN_TIME = frozenset({"depend", "exec_depend", "run_depend"})
AT_TEST_TIME = AT_RUN_TIME | {"test_depend"}
GROUP = "rosidl_interface_packages"


def add_dependencies(
    text: str,
    *,
    depends: Sequence[str] = (),
    executes: Sequence[str] = (),
    tests: Sequence[str] = (),
    group: bool = False,
) -> Outcome:
    """Return the file with the dependencies that it lacks.

    `depends` are needed to build and run, `executes` to run, `tests` for testing; `group` declares
    that the package has interfaces.
    """
    try:
        manifest = read(text.encode("utf-8"), "utf-8")
    except NOT_XML:
        manifest = Manifest("", ())
    own = set(manifest.texts("name"))
    if not own:
        lines = " ".join(f"<depend>{name}</depend>" for name in depends)
        why = "it has no `<name>`"
        if not manifest.elements:
            why = "this is not a well-formed package.xml"
        return Refused(why, lines, "within `<package>`")
    running = own.union(manifest.texts(*AT_RUN_TIME))
    testing = own.union(manifest.texts(*AT_TEST_TIME))
    old = ("run_depend", "run_depend")
    depend, execute = old if manifest.format == "1" else ("depend", "exec_depend")
    new = [(depend, name) for name in depends if name not in running]
    new += [(execute, name) for name in executes if name not in {*running, *depends}]
    testing.update(name for _, name in new)
    new += [("test_depend", name) for name in tests if name not in testing]
    if group and manifest.format not in ("1", "2"):
        present = manifest.texts("member_of_group")
        new += [("member_of_group", GROUP)] if GROUP not in present else []
    for kind, name in new:
        source = Source(MANIFEST, text)
        text = apply(text, addition(source, statements(source), kind, name))[0]
    return Edited(text)


def addition(
    manifest: Source, statements: Iterable[Statement], tag: str, name: str
) -> tuple[Edit, ...]:
    """Return the edits that add an element, on a line of its own after its like.

    An edit before it separates it from the head where blank lines separate groups of elements.
    """
    from html import escape  # with its thousands of names, of which few runs need three

    text = manifest.text
    ranked = [statement for statement in statements if RANK.get(statement.tag, 99) <= RANK[tag]]
    same = [statement for statement in ranked if statement.tag == tag]
    if not ranked:
        return ()
    after = max(same or ranked, key=lambda statement: statement.end)
    margin = text[text.rfind("\n", 0, after.span.start) + 1 : after.span.start]
    margin = "  " if margin.strip() else margin
    ending = "\r\n" if "\r\n" in text else "\n"
    # a comment on the line belongs to the element before it
    line = text[after.end :].partition("\n")[0].removesuffix("\r")
    is_comment = re.fullmatch(r"<!--[^<]*-->", line.strip()) is not None
    at = after.end + len(line) if is_comment or not line.strip() else after.end
    place = Span(manifest, at, at)
    element = Edit(place, f"{ending}{margin}<{tag}>{escape(name, quote=False)}</{tag}>")
    is_end = not same and after.tag not in DEPENDENCIES and _BLANK_LINE.match(text, at)
    return (Edit(place, ending), element) if is_end else (element,)


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
