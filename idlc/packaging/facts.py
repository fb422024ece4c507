"""Reading the facts about the package of interfaces."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path

import msgspec

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source, Span
from idlc.packaging.cmake import GENERATE, calls
from idlc.packaging.dependencies import Neighbours
from idlc.packaging.files import PackageFiles, read_package_files
from idlc.project.find import CLOSING, KINDS, SKIPPED
from idlc.project.inputs import Inputs
from idlc.project.lock import BUILD_STEP, FILE, Lock, Runtime, load_lock
from idlc.project.package_xml import Statement, statements
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import Scope

_NATIVE = frozenset({".c", ".cc", ".cpp", ".cxx", ".h", ".hh", ".hpp"})
_NOT_NODES = frozenset({"test", "tests", "launch", "docs", "doc", "upgrade"})


class GeneratedOutput(msgspec.Struct, frozen=True):
    """Code that idlc generated within the package: its lock, and what is recorded in it."""

    path: str
    package: str
    inputs: Mapping[str, str]
    dependencies: Mapping[str, str] = {}
    runtime: Runtime = "carried"


class Facts(msgspec.Struct, frozen=True):
    """A package with a package.xml.

    `modules` are its Python files by dotted name, tests excluded. `inputs` are the digests of its
    interface files by name within the package, empty without `outputs`; `whole` is whether the
    package has no others. `generates` is whether its CMakeLists.txt generates interfaces that are
    installed, `native` whether it has C or C++ sources, `marker` whether resource/NAME exists.
    `available` are the names of ROS packages that can be found, `providers` those that provide a
    Python module by its name. `contained` are the names of the package's modules, at any depth.
    `dependents` are the packages of the workspace that need this one.
    `files` are the paths of interface files in the package's folder by name within the package.
    `interfaces` are the paths of all, checked or not, .idl files included.
    `folders` are those with files by dotted name, and whether they are Python packages.
    `index` is the list of interfaces that a setup.py installs for ROS 2's tools.
    `include` are folders outside of the base that the command line included, if the package has
    `outputs`.
    `has_build_step` is whether idlc wrote the file that a setup.py runs where idlc is missing.
    """

    name: str
    manifest: Source
    statements: tuple[Statement, ...]
    inputs: Mapping[str, str]
    modules: Mapping[str, Source]
    setup_py: Source | None = None
    setup_cfg: Source | None = None
    pyproject: Source | None = None
    cmake: Source | None = None
    index: Source | None = None
    generates: bool = False
    native: bool = False
    marker: bool = False
    whole: bool = False
    outputs: tuple[GeneratedOutput, ...] = ()
    available: frozenset[str] = frozenset()
    providers: Mapping[str, frozenset[str]] = {}
    contained: frozenset[str] = frozenset()
    dependents: frozenset[str] = frozenset()
    files: Mapping[str, str] = {}
    interfaces: frozenset[str] = frozenset()
    folders: Mapping[str, bool] = {}
    include: tuple[str, ...] = ()
    has_build_step: bool = False

    @property
    def runtime(self) -> Runtime:
        """Return the runtime mode of the generated classes."""
        modes = [output.runtime for output in self.outputs if output.package == self.name]
        return modes[0] if modes else "carried"

    def declared(self, *tags: str) -> dict[str, Statement]:
        """Return the statements with one of these tags by their text, the first of each."""
        by_text: dict[str, Statement] = {}
        for statement in self.statements:
            if statement.tag in tags:
                by_text.setdefault(statement.text, statement)
        return by_text

    @property
    def is_known(self) -> bool:
        """Return whether all interfaces of the package are known; there may be none."""
        return self.whole or not (self.files or self.interfaces)

    @property
    def build_type(self) -> str:
        """The build type; CMake unless package.xml has another."""
        return next(iter(self.declared("build_type")), "ament_cmake")

    @property
    def place(self) -> Span:
        """The span for problems with the whole package.xml: its name."""
        named = self.declared("name")
        return next(iter(named.values())).span if named else Span(self.manifest, 0, 0)


def facts(
    package: Inputs,
    ros_packages: Callable[[], Iterable[str]],
    neighbours: Neighbours,
    scope: Scope,
) -> Facts | None:
    """Return the facts about a package; `None` without a package.xml.

    `ros_packages` returns the names of ROS packages; it is called only with Python code.
    """
    root = scope.root
    path = root.manifest(next(iter(package.folders), package.home))
    source = root.read_source(path, root.shown(path), Report()) if path else None
    if path is None or source is None or not (declared := statements(source)):
        return None
    folder = path.parent
    files = list(_files(folder))
    locks = _locks(files)
    generated = {at.parent / path for at, record in locks.items() for path in record.outputs}
    texts = _package_files(folder, root)
    modules = _modules(folder, [file for file in files if file not in generated], root)
    available = frozenset(ros_packages() if modules else ())
    present = folders(folder, files)
    return Facts(
        name=package.package,
        manifest=source,
        statements=declared,
        inputs=package.digests if locks else {},
        modules=modules,
        **texts._asdict(),
        index=_optional(folder / "resource/rosidl_interfaces" / package.package, root),
        generates=texts.cmake is not None and _generates(texts.cmake),
        native=any(file.suffix in _NATIVE for file in files),
        whole=_is_whole(package, files, scope),
        marker=(folder / "resource" / package.package).is_file(),
        outputs=tuple(
            GeneratedOutput(
                root.shown(at),
                record.package,
                record.inputs,
                record.dependencies,
                record.runtime,
            )
            for at, record in locks.items()
        ),
        files=_files_by_key(package, folder, root),
        interfaces=frozenset(
            file.relative_to(folder).as_posix() for file in files if file.suffix in (*KINDS, ".idl")
        ),
        folders=present,
        include=scope.typed_outside if locks else (),
        has_build_step=any(file.name == BUILD_STEP for file in files),
        available=available,
        providers=neighbours.providers(available) if modules else {},
        contained=_contained(files, present),
        dependents=neighbours.dependents(package.package) if modules else frozenset(),
    )


def _locks(files: Iterable[Path]) -> dict[Path, Lock]:
    records = {file: load_lock(file.parent, "", Report()) for file in files if file.name == FILE}
    return {file: record for file, record in records.items() if record}


def _files_by_key(package: Inputs, folder: Path, root: Root) -> dict[str, str]:
    """Return the paths of the inputs in a package's folder by their names within the package."""
    places = {entry.file.key: root.absolute(entry.file.path) for entry in package.files}
    return {
        key: place.relative_to(folder).as_posix()
        for key, place in places.items()
        if place.is_relative_to(folder)
    }


def _modules(folder: Path, files: Iterable[Path], root: Root) -> dict[str, Source]:
    """Return the package's modules by dotted name; its tests, documents and scripts are none."""
    modules = {}  # nodes may be in the folder of generated classes
    for file in files:
        parts = file.relative_to(folder).parts
        if file.suffix == ".py" and len(parts) > 1 and parts[0] not in _NOT_NODES:
            module = _optional(file, root)
            if module:
                modules[".".join((*parts[:-1], file.stem))] = module
    return modules


def _generates(cmake: Source) -> bool:
    """Return whether a CMakeLists.txt generates interfaces that other packages can use."""
    generating = [command for command in calls(cmake) if command.name == GENERATE]
    # other interfaces are for tests of the package's own
    return any("SKIP_INSTALL" not in command.words for command in generating)


def _is_whole(package: Inputs, files: Iterable[Path], scope: Scope) -> bool:
    """Return whether the inputs are all interface files of a package."""
    inputs = {scope.root.absolute(entry.file.path) for entry in package.files}
    interfaces = [file for file in files if file.suffix in KINDS and not scope.exclude.has(file)]
    others = {file.resolve() for file in interfaces if file not in inputs}
    if others:  # the same file may have two paths
        others -= {file.resolve() for file in inputs}
    return bool(inputs) and not others


def folders(folder: Path, files: Iterable[Path] | None = None) -> dict[str, bool]:
    """Return the folders with files, by dotted name, and whether each is a Python package."""
    is_package: dict[str, bool] = {}
    for file in _files(folder) if files is None else files:
        parts = file.relative_to(folder).parts[:-1]
        for end in range(1, len(parts) + 1):
            is_package.setdefault(".".join(parts[:end]), False)
        if file.name == "__init__.py" and parts:
            is_package[".".join(parts)] = True
    return is_package


def _contained(files: Iterable[Path], present: Mapping[str, bool]) -> frozenset[str]:
    """Return the names of the modules and packages in a package's folder, at any depth."""
    code = [file for file in files if file.suffix == ".py"]
    packages = {name.rpartition(".")[2] for name, is_package in present.items() if is_package}
    # a folder without an __init__.py can be a package, too
    others = {file.parent.name for file in code} - _NOT_NODES
    return frozenset({file.stem for file in code} | packages | others)


def home_of(folder: Path, package: str, root: Root) -> Path:
    """Return the folder from which setup.py takes a package, or an earlier `idlc gen`'s."""
    homes = (folder / package, folder / "src" / package)
    for home in homes:
        if (home / FILE).is_file():
            return home
    texts = _package_files(folder, root)
    if texts.setup_py is not None:
        from idlc.packaging.layout import layout
        from idlc.packaging.setup_py import Setup

        sources = {"src": False} if (folder / "src").is_dir() else {}
        view = layout(Setup(texts.setup_py), texts.setup_cfg, texts.pyproject, sources)
        if view is not None:
            return folder / view.folder(package)
    return homes[not homes[0].is_dir() and homes[1].is_dir()]


def _files(folder: Path) -> Iterator[Path]:
    """Yield every file below a package's folder that may be a source, other packages' excluded."""
    for place, folders, names in os.walk(folder):
        current = Path(place)
        closing = any(name in CLOSING or name == MANIFEST for name in (*folders, *names))
        open_ones = [name for name in folders if name[0] != "." and name not in SKIPPED]
        folders[:] = sorted(open_ones, reverse=True)
        if current != folder and closing:
            folders.clear()
            continue
        for name in sorted(names):
            if name[0] != "." and name not in SKIPPED and (file := current / name).is_file():
                yield file


def _package_files(folder: Path, root: Root) -> PackageFiles:
    return read_package_files(lambda name: _optional(folder / name, root))


def _optional(path: Path, root: Root) -> Source | None:
    """Return a file's text, `None` if it is missing or no text, which others report."""
    return root.read_source(path, root.shown(path), Report()) if root.is_file(path) else None
