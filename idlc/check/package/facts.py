"""Reading what surrounds the interfaces of a package."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from idlc.check.package.cmake import GENERATE, calls
from idlc.diagnostics.report import Report
from idlc.project import lock
from idlc.project.find import CLOSING, KINDS, SKIPPED, Exclusions
from idlc.project.inputs import Inputs
from idlc.project.lock import load_lock
from idlc.project.package_xml import Facts, GeneratedOutput, statements
from idlc.project.settings import Scope

if TYPE_CHECKING:
    from idlc.diagnostics.source import Source
    from idlc.project.root import Root

#: Python packages of ROS 2 that have no interfaces.
_LIBRARIES = frozenset(
    "ament_index_python cv_bridge geometry_msgs launch launch_ros launch_testing message_filters "
    "rclpy ros2cli ros2launch rosbag2_py rosidl_runtime_py sensor_msgs_py tf2_geometry_msgs "
    "tf2_ros tf_transformations".split()
)
_SETUP_FILES = ("setup.py", "setup.cfg", "pyproject.toml")
_NATIVE = frozenset({".c", ".cc", ".cpp", ".cxx", ".h", ".hh", ".hpp"})
_NOT_NODES = frozenset({"test", "tests", "launch", "docs", "doc"})


def facts(given: Inputs, known: Callable[[], Iterable[str]], scope: Scope) -> Facts | None:
    """Return what surrounds a package's interfaces; `None` without a package.xml.

    `known` tells the names of ROS packages; it is asked only for a package with Python code.
    """
    root = scope.root
    path = root.manifest(next(iter(given.folders), given.home))
    source = root.read_source(path, root.shown(path), Report()) if path else None
    if path is None or source is None or not (said := statements(source)):
        return None
    folder = path.parent
    files = list(_files(folder))
    locks = _locks(files)
    generated = {at.parent / path for at, lock in locks.items() for path in lock.outputs}
    cmake = _optional(folder / "CMakeLists.txt", root)
    modules = dict(_modules(folder, files, generated, root))
    return Facts(
        name=given.package,
        manifest=source,
        statements=said,
        inputs=given.digests if locks else {},
        modules=modules,
        setup_py=_optional(folder / "setup.py", root),
        setup_cfg=_optional(folder / "setup.cfg", root),
        pyproject=_optional(folder / "pyproject.toml", root),
        cmake=cmake,
        generates=cmake is not None and _generates(cmake),
        native=any(file.suffix in _NATIVE for file in files),
        whole=_whole(given, files, scope.exclude),
        marker=(folder / "resource" / given.package).is_file(),
        outputs=tuple(
            GeneratedOutput(root.shown(at), one.package, one.inputs) for at, one in locks.items()
        ),
        files={
            one.file.key: place.relative_to(folder).as_posix()
            for one in given.files
            if (place := root.absolute(one.file.path)).is_relative_to(folder)
        },
        folders=_by_name(folder, files),
        known=_LIBRARIES.union(known()) if modules else _LIBRARIES,
    )


def folders(folder: Path) -> dict[str, bool]:
    """Return the folders with files, by dotted name, and whether each is a Python package."""
    return _by_name(folder, _files(folder))


def home_of(folder: Path, package: str, root: Root) -> Path:
    """Return the folder from which setup.py takes a package, or where idlc compiled it before."""
    homes = (folder / package, folder / "src" / package)
    for home in homes:
        if (home / lock.FILE).is_file():
            return home
    files = (_optional(folder / name, root) for name in _SETUP_FILES)
    setup, cfg, pyproject = files
    if setup is not None:
        from idlc.check.package.python_packages import layout
        from idlc.check.package.setup_py import Setup

        there = {"src": False} if (folder / "src").is_dir() else {}
        view = layout(Setup(setup), cfg, pyproject, there)
        if view is not None:
            return folder / view.folder(package)
    return homes[not homes[0].is_dir() and homes[1].is_dir()]


def _by_name(folder: Path, files: Iterable[Path]) -> dict[str, bool]:
    found: dict[str, bool] = {}
    for file in files:
        parts = file.relative_to(folder).parts[:-1]
        for end in range(1, len(parts) + 1):
            found.setdefault(".".join(parts[:end]), False)
        if file.name == "__init__.py" and parts:
            found[".".join(parts)] = True
    return found


def _locks(files: Iterable[Path]) -> dict[Path, lock.Lock]:
    """Return the records of generated code that can be read, by their files."""
    found = [file for file in files if file.name == lock.FILE]
    loaded = ((file, load_lock(file.parent, "", Report())) for file in found)
    return {file: lock for file, lock in loaded if lock}


def _whole(given: Inputs, files: Iterable[Path], exclude: Exclusions) -> bool:
    """Return whether a package has no interface files but those given."""
    there = {file.resolve() for file in files if file.suffix in KINDS and not exclude.has(file)}
    return bool(given.files) and there <= {one.file.path.resolve() for one in given.files}


def _generates(cmake: Source) -> bool:
    """Return whether a CMakeLists.txt generates interfaces other than for tests of its own."""
    return any(one.name == GENERATE and "SKIP_INSTALL" not in one.words for one in calls(cmake))


def _files(folder: Path) -> Iterator[Path]:
    """Yield every file below a package's folder that may be a source, other packages' excluded."""
    waiting = [folder]
    while waiting:
        here = waiting.pop()
        try:
            entries = sorted(here.iterdir())
        except OSError:
            continue
        if here != folder and any(
            one.name in CLOSING or one.name == "package.xml" for one in entries
        ):
            continue
        for entry in entries:
            if entry.name.startswith(".") or entry.name in SKIPPED:
                continue
            if entry.is_dir() and not entry.is_symlink():
                waiting.append(entry)
            elif entry.is_file():
                yield entry


def _modules(
    folder: Path, files: Iterable[Path], generated: Container[Path], root: Root
) -> Iterator[tuple[str, Source]]:
    """Yield a package's own Python files by their dotted names, without tests and the like.

    Nodes may lie in the folder that classes are generated into.
    """
    for file in files:
        parts = file.relative_to(folder).parts
        ours = file.suffix == ".py" and len(parts) > 1 and parts[0] not in _NOT_NODES
        if ours and file not in generated and (source := _optional(file, root)):
            yield ".".join((*parts[:-1], file.stem)), source


def _optional(path: Path, root: Root) -> Source | None:
    """Return a file's text, `None` if it is not there or no text, which others complain about."""
    return root.read_source(path, root.shown(path), Report()) if root.is_file(path) else None
