"""The examination by `idlc doctor`: programs, the installation of ROS 2, and packages."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from idlc.check.select import Selection
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.diagnostics.terminal import counted
from idlc.project import inputs, prefixes
from idlc.project.files import entries, is_file, is_folder
from idlc.project.find import list_files
from idlc.project.lock import load_lock
from idlc.project.package_xml import declared_version
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.tasks.check import CheckOptions, check
from idlc.tasks.check_prefix import check_prefix
from idlc.version import __version__

#: Where ROS 2's installers put a distribution, each with a `setup.bash`.
_SYSTEM = Path("/opt/ros")


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
    own = f"python{sys.version_info.major}.{sys.version_info.minor}"
    for prefix in prefixes.ament_prefixes():
        pythons = [path.parents[1].name for path in prefix.glob("lib/python3*/site-packages/rclpy")]
        if pythons and own not in pythons:
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
        path.name: declared_version(prefix / "share" / path.name / "package.xml")
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
            details = f"`idlc check --prefix {shlex.quote(str(prefix))}` shows the details"
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
    check(CheckOptions((".",), scope, Selection(select=(codes.STALE_GENERATED_CODE.id,))), report)
    for problem in report:
        if problem.code in (codes.STALE_GENERATED_CODE.id, codes.DUPLICATE_PACKAGE.id):
            yield Finding("package", f"{problem.where[0]}: {problem.message}", problem.hint or "")
    listing = list_files((".",), scope.root, Report(), scope.exclude)
    for package in inputs.packages(listing.files, scope, Report(), listing.packages):
        for folder, digests in _copies(package, scope):
            if digests == package.digests:
                yield Finding("package", f"{package.package} is installed in {folder}")
            else:
                text = f"{package.package} in {folder} was built from different interface files"
                yield Finding("package", text, "build and install it again")


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
