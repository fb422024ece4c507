"""The rule on generated code that is kept: it belongs to the interfaces of today."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path, PurePosixPath

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report, first_few
from idlc.diagnostics.source import Source
from idlc.model import ir
from idlc.model.catalog import is_standard
from idlc.model.link import Model
from idlc.packaging.files import SETUP_FILES
from idlc.packaging.layout import build_backend
from idlc.project.files import is_file
from idlc.project.find import CLOSING, SKIPPED
from idlc.project.inputs import Inputs
from idlc.project.lock import FILE, Lock, load_lock
from idlc.project.settings import SETTINGS_FILE, Scope, toml
from idlc.project.step import meaning

#: The tools of build backends that run nothing of the project, and so notice nothing.
_UNAWARE = {"flit_core": "flit", "poetry": "poetry", "uv_build": "uv"}


def outdated(
    path: str,
    before: Mapping[str, str],
    now: Mapping[str, str],
    words: Sequence[str],
    project: Source | None,
) -> Iterator[Diagnostic]:
    """Yield the problem of generated code whose lock at `path` records other interfaces.

    `words` are the arguments of idlc that generate it again, `project` is the pyproject.toml of
    what contains the code.
    """
    changed = []
    for name in sorted(before.keys() | now.keys()):
        if name not in before:
            changed.append(f"`{name}` was added")
        elif name not in now:
            changed.append(f"`{name}` was removed")
        elif before[name] != now[name]:
            changed.append(f"`{name}` changed")
    if changed:
        message = f"the generated code is out of date: {first_few(changed, 3)}"
        hint = f"run `idlc {shlex.join(words)}`"
        with suppress(ValueError):
            backend = build_backend(toml(project.text)) if project else ""
            if tool := _UNAWARE.get(backend.partition(".")[0]):
                hint += f"; until then, {tool} builds wheels with the old classes"
        yield codes.STALE_GENERATED_CODE.of(path, message, hint=hint)


def dependencies(model: Model) -> dict[str, str]:
    """Return the digests of the interfaces of other packages that a model uses, as in a lock.

    Standard ones are left out, because they differ between distributions.
    """
    used = _used(model)
    return {str(name): meaning(source.text, name.package) for name, source in used.items()}


def include_options(model: Model, included: Sequence[str]) -> list[str]:
    """Return the options by which `idlc gen` finds the packages that a model uses.

    Packages with absolute paths are installed, found by settings, or in folders outside of the base
    that the command line `included`.
    """
    paths = [PurePosixPath(source.path) for source in _used(model).values()]
    folders = {path.parent.parent.as_posix() for path in paths if not path.is_absolute()}
    outside = included if any(path.is_absolute() for path in paths) else ()
    return [word for folder in (*outside, *sorted(folders)) for word in ("-I", folder)]


def _used(model: Model) -> dict[ir.TypeName, Source]:
    """Return the interfaces of packages, other than standard ones, that a model uses."""
    used = (each for each in model.interfaces.values() if each.name.package != model.package)
    sources = {each.name: each.source for each in used if not is_standard(each.name.package)}
    return {name: source for name, source in sources.items() if source}


def with_dependencies(
    inputs: Mapping[str, str], recorded: Mapping[str, str], now: Mapping[str, str]
) -> dict[str, str]:
    """Return the digests of files with those of dependencies that are known then and now."""
    return {**inputs, **{name: recorded[name] for name in recorded.keys() & now.keys()}}


def outputs(package: Inputs, scope: Scope) -> dict[Path, Lock]:
    """Return the generated code of a package outside of its folder, or of one without package.xml.

    It is where `[tool.idlc] out` says. Without this setting, the project is searched.
    """
    root = scope.root
    is_ros = root.manifest(package.home) is not None
    folders: Iterable[Path] = ()
    if scope.out:
        out = root.absolute(scope.out)
        folders = (out, out / package.package)
    elif not is_ros:
        folders = _generated(package.home)
    records = {folder: load_lock(folder, "", Report()) for folder in folders}
    return {
        folder: record
        for folder, record in records.items()
        if record and (record.package == package.package or (not is_ros and _fits(record, package)))
    }


def _fits(record: Lock, package: Inputs) -> bool:
    """Return whether a lock seems to be of these interfaces, under another package name."""
    now = package.digests
    return record.inputs.keys() == now.keys() or bool(record.inputs.items() & now.items())


def _generated(home: Path) -> Iterator[Path]:
    """Yield the folders of generated code in the Python project around a folder."""
    places = (home, *home.parents)
    projects = (place for place in places if any(is_file(place / mark) for mark in SETUP_FILES))
    project = next(projects, None)
    for place, folders, names in os.walk(project) if project else ():
        if not CLOSING.isdisjoint((*folders, *names)):
            folders.clear()
            continue
        folders[:] = [name for name in folders if name[0] != "." and name not in SKIPPED]
        if FILE in names:
            yield Path(place)


def current_outputs(
    package: Inputs, model: Model, records: Mapping[Path, Lock], scope: Scope
) -> Iterator[Diagnostic]:
    """Yield a problem for each folder of generated code that does not match a package."""
    root = scope.root
    is_whole, used = package.is_whole(root), dependencies(model) if records else {}
    for folder, record in records.items():
        manifest = root.manifest(package.home)
        if manifest is not None and folder.is_relative_to(manifest.parent):
            continue  # the rules of packages judge it
        before, now = record.inputs, package.digests
        if not is_whole:  # the other files are not known
            before = {name: before[name] for name in before.keys() & now.keys()}
            now = {name: now[name] for name in before}
        before = with_dependencies(before, record.dependencies, used)
        now = with_dependencies(now, used, record.dependencies)
        words = ["gen"]
        if not (scope.paths and scope.out and folder.is_relative_to(root.absolute(scope.out))):
            words += [root.shown(package.home), "-o", root.shown(folder)]
            words += include_options(model, scope.typed_outside)
            words += [] if manifest else ["--package", record.package]
            words += {"": [], "private": ["--vendor-deps"], "beside": ["--vendor-deps=beside"]}[
                record.vendoring
            ]
        around = (place / SETTINGS_FILE for place in folder.parents)
        file = next(filter(is_file, around), None)
        project = root.read_source(file, root.shown(file), Report()) if file else None
        yield from outdated(root.shown(folder / FILE), before, now, words, project)
