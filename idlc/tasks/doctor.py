"""The examination by `idlc doctor`: programs, the installation of ROS 2, and packages."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from importlib.machinery import PathFinder
from pathlib import Path
from typing import NamedTuple

from idlc.check.select import RuleSelection
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, enumerated, first_few
from idlc.diagnostics.terminal import counted
from idlc.packaging.facts import home_of
from idlc.packaging.files import SETUP_PY
from idlc.project import inputs, prefixes
from idlc.project.files import entries, is_file, is_folder
from idlc.project.find import list_files
from idlc.project.lock import load_lock
from idlc.project.package_xml import declared_version
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import Scope
from idlc.tasks.check import CheckOptions, check
from idlc.tasks.check_prefix import check_prefix
from idlc.version import __version__

#: Where ROS 2's installers put a distribution, each with a `setup.bash`.
_SYSTEM = Path("/opt/ros")
_PYTHON = f"python{sys.version_info.major}.{sys.version_info.minor}"
_TAG = f"cpython-{sys.version_info.major}{sys.version_info.minor}"


class Finding(NamedTuple):
    """One line: what was examined, its state, and what to do; a `hint` says that it is not good."""

    subject: str
    text: str
    hint: str = ""


def examine(scope: Scope, program: Callable[[], str]) -> Iterator[Finding]:
    """Yield the state of everything that idlc depends on; `program` finds its name on PATH."""
    yield from _idlc(program())
    yield from _python()
    yield from _ros()
    yield from _middleware()
    yield from _installed(scope.root)
    yield from _packages(scope)


def _idlc(program: str) -> Iterator[Finding]:
    yield Finding("idlc", f"{__version__} in {Path(__file__).parents[1]}")
    other = shutil.which("idlc")
    if program != "idlc" and other:
        hint = f"run this idlc as `{program}`"
        yield Finding("command", f"another program on PATH has the name `idlc`: {other}", hint)
    elif program == "idlc":
        yield Finding("command", f"`idlc` is {other}")
    else:
        hint = f"put {Path(sys.executable).parent} on PATH, or call `{program}`"
        yield Finding("command", "`idlc` is not on PATH", hint)
    server = shutil.which("rosidlc")
    if server:
        yield Finding("editors", f"start `rosidlc lsp`, which is {server}")
    else:
        hint = "put the folder with `rosidlc` on PATH, or set its path in the editor's settings"
        yield Finding("editors", "cannot start `rosidlc lsp`: it is not on PATH", hint)


def _python() -> Iterator[Finding]:
    version = ".".join(map(str, sys.version_info[:3]))
    environment = ", a virtual environment" if sys.prefix != sys.base_prefix else ""
    yield Finding("python", f"{version} in {sys.prefix}{environment}")
    for prefix in prefixes.ament_prefixes():
        pythons = [path.parents[1].name for path in prefix.glob("lib/python3*/site-packages/rclpy")]
        if pythons and _PYTHON not in pythons:
            hint = (
                f"install idlc for {pythons[0]}, or create an environment with both idlc and rclpy"
            )
            yield Finding("python", f"rclpy in {prefix} is for {pythons[0]}", hint)


def _ros() -> Iterator[Finding]:
    distribution = prefixes.distribution()
    setups = [path for path in entries(_SYSTEM) if is_file(path / "setup.bash")]
    if prefixes.runs_nodes():
        yield Finding("ros", f"{distribution.name or 'unknown'}, from {distribution.why}")
    elif setups:
        names = first_few((path.name for path in setups), 3)
        hint = f"`source {setups[-1]}/setup.bash` before you run nodes"
        yield Finding("ros", f"{names} in {_SYSTEM}, but this Python has no rclpy", hint)
    else:
        text = f"idlc compiles for {distribution.name}; the classes work without rclpy"
        yield Finding("ros", text)
    requested = os.environ.get("ROS_DISTRO", "")
    if requested and requested != distribution.name:
        hint = "`unset ROS_DISTRO`, or source the right distribution"
        text = f"ROS_DISTRO is {requested}, but {distribution.name} is installed"
        yield Finding("ros", text, hint)


def _middleware() -> Iterator[Finding]:
    installed = {
        path.name: declared_version(prefix / "share" / path.name / MANIFEST)
        for prefix in reversed(prefixes.ament_prefixes())
        for path in entries(prefix / prefixes.INDEX / "rmw_typesupport")
        if path.name != "rmw_implementation"
    }
    if not installed:
        return
    requested = os.environ.get("RMW_IMPLEMENTATION", "")
    if requested and requested not in installed:
        hint = f"install it, or `export RMW_IMPLEMENTATION={next(iter(installed))}`"
        yield Finding("middleware", f"{requested}, which is not installed", hint)
    else:
        names = ", ".join(f"{name} {version or ''}".strip() for name, version in installed.items())
        yield Finding("middleware", names)


def _installed(root: Root) -> Iterator[Finding]:
    owners: dict[str, list[Path]] = {}
    for prefix in prefixes.ament_prefixes():
        if not is_folder(prefix):
            hint = "build it again, or open a new terminal and source the other prefixes"
            yield Finding("prefix", f"{prefix} on AMENT_PREFIX_PATH is not a folder", hint)
        elif is_folder(prefix / prefixes.INDEX):
            packages = list(prefixes.with_interfaces(prefix))
            for package in packages:
                owners.setdefault(package, []).append(prefix)
            report = Report()
            check_prefix(str(prefix), root, report)
            problems = [problem for problem in report if problem.code != codes.NO_SUCH_PATH.id]
            text = f"{prefix}: {counted(len(packages), 'package')} with interfaces"
            details = f"`idlc check --ament {shlex.quote(str(prefix))}` shows the details"
            hint = details if problems else ""
            reason = f"; {problems[0].message}" if problems else ""
            yield Finding("prefix", text + reason, hint)
    for package, places in owners.items():
        if len(places) > 1:
            others = first_few(map(str, places[1:]), 3)
            text = f"{package} in {places[0]} hides the package in {others}"
            yield Finding("prefix", text)


def _packages(scope: Scope) -> Iterator[Finding]:
    report = Report()
    check(
        CheckOptions((".",), scope, RuleSelection(select=(codes.STALE_GENERATED_CODE.id,))), report
    )
    for problem in report:
        if problem.code in (codes.STALE_GENERATED_CODE.id, codes.DUPLICATE_PACKAGE.id):
            yield Finding("package", f"{problem.where[0]}: {problem.message}", problem.hint or "")
    listing = list_files((".",), scope.root, Report(), scope.exclude)
    for package in inputs.packages(listing.files, scope, Report(), listing.packages):
        manifest = scope.root.manifest(package.home)
        if manifest is not None:
            yield from _importable(package, manifest.parent, scope.root)
        for folder, digests in _copies(package, scope):
            if digests == package.digests:
                yield Finding("package", f"{package.package} in {folder} has these interfaces")
            else:
                text = f"{package.package} in {folder} was built from different interface files"
                yield Finding("package", text, "build and install it again")


def _importable(package: inputs.Inputs, home: Path, root: Root) -> Iterator[Finding]:
    """Yield the reason why this Python does not find a package of ROS 2, or finds another one."""
    name, kinds = package.package, sorted({file.file.kind for file in package.files})
    if is_file(home / SETUP_PY):
        yield from _ungenerated(name, kinds, home, root)
    elif not kinds:
        return  # Python need not find it
    built = [path for place in (home, *home.parents) for path in _built(place / "install", name)]
    folders = _folders(name)
    if not folders:
        yield _unfound(name, built, root.shown(home))
        return
    first, *others = folders
    lacking = [kind for kind in kinds if not is_file(first / kind / "__init__.py")]
    hidden = [folder for folder in others if _is_of(folder, built, home)]
    if hidden and not _is_of(first, built, home):
        hint = f"uninstall the other copy, or put {hidden[0].parent} before it on PYTHONPATH"
        yield Finding("package", f"{name} in {first} hides the package in {hidden[0]}", hint)
    elif lacking:
        text = f"Python finds {name} in {first}, which has no `{name}.{lacking[0]}`"
        yield Finding("package", text, "build and install it again")
    # rosidl's extension modules, named as in `demo_s__rosidl_typesupport_c.cpython-311-...so`
    tags = {path.name.split(".")[1] for path in first.glob("*_s__*.cpython-*")}
    pythons = sorted("-".join(tag.split("-")[:2]) for tag in tags)
    if pythons and _TAG not in pythons:
        text = f"{name} in {first} was built with {pythons[0]}, and this is {_TAG}"
        yield Finding("package", text, "build it again in an environment of this Python")


def _ungenerated(name: str, kinds: Sequence[str], home: Path, root: Root) -> Iterator[Finding]:
    """Yield a problem if a package that setup.py builds lacks classes in its folder."""
    classes = home_of(home, name, root)
    absent = [f".{kind}" for kind in kinds if not is_file(classes / kind / "__init__.py")]
    if absent:
        hint = f"`idlc gen {shlex.quote(root.shown(home))}` writes them"
        yield Finding("package", f"{name} has no classes for its {enumerated(absent)} files", hint)


def _unfound(name: str, built: Sequence[Path], home: str) -> Finding:
    """Return the reason why this Python finds no package of a name."""
    if not built:
        hint = (
            f"`colcon build --packages-select {name}` in the workspace, then source its "
            f"install/setup.bash; or `pip install -e {shlex.quote(home)}`"
        )
        return Finding("package", f"{name} is not built, so Python cannot import it", hint)
    prefix = built[0]
    places = (
        place for top in ("", "local/") for place in prefix.glob(f"{top}lib/python3*/*-packages")
    )
    pythons = [place.parent.name for place in places]
    if pythons and _PYTHON not in pythons:
        text = f"{name} in {prefix} is for {pythons[0]}, and this is {_PYTHON}"
        return Finding("package", text, f"build it with {_PYTHON}, or use {pythons[0]}")
    scripts = (place / "setup.bash" for place in (prefix.parent, prefix))
    script = next(filter(is_file, scripts), prefix / "setup.bash")
    text = f"{name} is built in {prefix}, but not sourced, so Python cannot import it"
    if prefix in prefixes.ament_prefixes():
        text = f"{name} is in {prefix}, which is on AMENT_PREFIX_PATH, but not on PYTHONPATH"
    return Finding("package", text, f"`source {shlex.quote(str(script))}`")


def _built(install: Path, name: str) -> list[Path]:
    """Return the prefix of a package in colcon's folder of installed packages."""
    return [place for place in (install / name, install) if is_folder(place / "share" / name)][:1]


def _is_of(folder: Path, built: Sequence[Path], home: Path) -> bool:
    """Return whether a folder of modules belongs to a package of the workspace."""
    places = [home, *built, *(prefix.parent.parent / "build" for prefix in built)]
    return any(folder.resolve().is_relative_to(place.resolve()) for place in places)


def _folders(name: str) -> list[Path]:
    """Return the folders of a package that this Python finds, without importing it.

    The first is the one that it imports. The working folder, which is on the path of `python -m`,
    does not count.
    """
    first = [] if sys.path[0] and Path(sys.path[0]) != Path.cwd() else sys.path[:1]
    path = [place for place in sys.path[len(first) :] if place]
    listed = [Path(place, name) for place in path]
    folders = [folder for folder in listed if is_file(folder / "__init__.py")]
    for finder in () if folders else sys.meta_path:  # of editable installations
        spec = finder.find_spec(name, path if finder is PathFinder else None)
        folders += map(Path, (spec and spec.submodule_search_locations) or ())
    return list(dict.fromkeys(folders))


def _copies(package: inputs.Inputs, scope: Scope) -> Iterator[tuple[Path, dict[str, str]]]:
    """Yield the folders in which a package is installed, and the digests of its files there.

    ROS 2 installs the interface files, other builds idlc's lock beside the classes.
    """
    shares = (prefix / "share" / package.package for prefix in prefixes.ament_prefixes())
    for share in [*filter(is_folder, shares)][:1]:  # the others are hidden
        files = list_files((str(share),), scope.root, Report()).files
        yield from ((share, copy.digests) for copy in inputs.packages(files, scope, Report()))
    for folder in prefixes.python_folders(package.package):
        record = load_lock(folder, str(folder), Report())
        if record and not folder.is_relative_to(scope.root.base):
            yield folder, dict(record.inputs)
