"""The folder that a generated package is written to."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from contextlib import suppress
from functools import cached_property, lru_cache
from pathlib import Path
from typing import NamedTuple

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.model import catalog, ir
from idlc.model.ir import TypeName
from idlc.model.link import Model
from idlc.project import inputs, prefixes, write
from idlc.project.files import is_file, is_folder
from idlc.project.find import KINDS, Exclusions, InterfaceFile, find
from idlc.project.inputs import accept_name, by_home, output_folders, separate_homes
from idlc.project.library import Library
from idlc.project.lock import (
    FILE,
    Lock,
    Runtime,
    Tree,
    Vendoring,
    digest,
    encode,
    load_lock,
    meaning,
)
from idlc.project.package_xml import declared_name
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.project.write import Change, Plan, plan
from idlc.version import __version__


def requested_packages(
    paths: Sequence[str], named: Sequence[inputs.Inputs], out: str, scope: Scope, report: Report
) -> tuple[inputs.Inputs, ...]:
    """Return the packages at paths, and the named ones; empty after a problem.

    Reports IDL607 for names that cannot be imported, IDL608 for folders that are no packages.
    """
    files = find(paths, scope.root, report, scope.exclude) if paths else ()
    packages = list(named)
    for package in named:
        accept_name(package.package, "the command line", report)
    if files and not report.had_errors:
        packages += _from_files(files, "" if packages else out, scope, report)
    usage = [diagnostic for diagnostic in report if diagnostic.code in codes.USAGE]
    return () if usage else inputs.without_duplicates(packages, scope.root, report)


def _from_files(
    files: tuple[InterfaceFile, ...], out: str, scope: Scope, report: Report
) -> tuple[inputs.Inputs, ...]:
    """Return files by package: as one, by default with the name of the folder `out`."""
    root = scope.root
    homes = by_home(files, root)
    apart = [] if scope.package else separate_homes(homes, root)
    loose = [home for home in apart if not root.manifest(home)]
    if any(set(home.parents) & set(apart) for home in loose):
        names = first_few((f"`{root.shown(home)}`" for home in apart), 5)
        report.add(
            codes.SEVERAL_PACKAGES.of(
                root.shown(apart[0]),
                f"these folders can be one package or {len(apart)} packages: {names}",
                hint="use --package NAME for one package, or add a package.xml to each folder",
            )
        )
        return ()
    if apart or not out:
        packages = inputs.packages(files, scope, report)
        folders = (package.home for package in packages)
        origins = ["package.xml" if root.manifest(folder) else "its folder" for folder in folders]
    else:
        home, name, origins = min(homes), scope.package, ["--package"]
        declared = next((path for home in homes if (path := root.manifest(home))), None)
        if name is None and declared:
            name, origins = declared_name(declared, root, report), ["package.xml"]
        if name is None:
            name, origins = root.absolute(out).name, ["the folder given with -o"]
            if catalog.is_standard(name) and home.name != name:
                report.add(
                    codes.UNIMPORTABLE_PACKAGE.of(
                        "",
                        f"`{name}` (from {origins[0]}) would hide the ROS 2 package",
                        hint=f"choose another folder, or confirm the name with `--package {name}`",
                    )
                )
            # other commands cannot know that name
            if name != home.name and root.absolute(out).parent not in output_folders(home, root):
                report.notes.append(
                    f"the package is named `{name}`, after the output folder; other commands "
                    f"need `--package {name}`, or a package.xml next to the interfaces"
                )
        packages = (inputs.load(name, files, home, root, report),)
    if out and any(root.absolute(file.path.parent) == root.absolute(out) for file in files):
        report.add(
            codes.FOREIGN_FILE.of(
                out,
                f"`{out}` contains interface files; idlc does not write generated code among them",
                hint="choose another folder with -o",
            )
        )
    for package, origin in zip(packages, origins, strict=True):
        accept_name(package.package, origin, report)
    return packages


def borrowed(types: Iterable[ir.TypeName], library: Library) -> inputs.Inputs:
    """Return types of one package, found in a library, as its input."""
    names = sorted(types)
    home = library.home(names[0].package)
    return inputs.Inputs(
        names[0].package,
        tuple(_borrowed(name, library) for name in names),
        (home,) if home else (),
        borrowed=True,
    )


def completed(
    packages: Collection[inputs.Inputs], needed: AbstractSet[ir.TypeName], library: Library
) -> list[inputs.Inputs]:
    """Return packages with the needed interfaces that partial packages lack; empty for none.

    Packages import the ones that are written beside them.
    """
    extended = []
    for package in packages:
        missing = {name for name in needed if name.package == package.package} - package.names
        more = (_borrowed(name, library) for name in missing if package.borrowed)
        files = sorted((*package.files, *more), key=lambda each: each.file.key)
        extended.append(msgspec.structs.replace(package, files=tuple(files)))
    return [] if extended == [*packages] else extended


def unread_idl(folders: Iterable[Path], exclude: Exclusions) -> list[str]:
    """Return the .idl files of a package without a .msg, .srv or .action file beside, sorted."""
    unread = []
    for folder in folders:
        for kind in KINDS:
            inside = folder / kind[1:]
            try:
                names = {entry.name for entry in os.scandir(inside)}
            except OSError:
                continue
            unread += [
                f"{kind[1:]}/{name}"
                for name in names
                if name.endswith(".idl")
                and f"{name.removesuffix('.idl')}{kind}" not in names
                and not exclude.has(str(inside / name))
            ]
    return sorted(unread)


def _borrowed(name: ir.TypeName, library: Library) -> inputs.Input:
    source = library.source(name)
    assert source is not None, name
    file = InterfaceFile(Path(source.path), source.path, name.kind, name.name, str(name), Path())
    return inputs.Input(file, source.text.encode())


def folder_targets(
    packages: Sequence[inputs.Inputs], out: str, output: Output
) -> tuple[Target, ...]:
    """Return the folder of each package: OUT for one, a folder of its name in OUT for several.

    Reports IDL608 where a package of an earlier run is in the way, IDL612 for other files.
    """
    top = output.root.absolute(out)
    names = [each.package for each in packages]
    if len(packages) == 1:
        beside_others = is_file(top / names[0] / FILE) and not is_file(top / FILE)
        targets = [Target(f"{out}/{names[0]}" if beside_others else out, names[0], output)]
    elif is_file(top / FILE):
        message = f"`{out}` is a single package, but you are compiling {len(packages)} packages"
        hint = "choose another folder with -o; idlc writes each package to its own subfolder"
        output.report.add(codes.SEVERAL_PACKAGES.of(out, message, hint=hint))
        return ()
    else:
        base = out.rstrip("/") or out
        targets = [Target(f"{base}/{name}", name, output) for name in names]
    return tuple(targets) if all(target.usable() for target in targets) else ()


_PACKAGE = Path(__file__).parents[1]
#: The sources of idlc that affect the output: a change counts although the version stays.
_ROOMS = ("check", "diagnostics", "generate", "language", "model", "runtime", "wire")
_MAKERS = (
    *(_PACKAGE / room for room in _ROOMS),
    _PACKAGE / "templates",
    _PACKAGE.parent / "templates",
)


def dependencies(names: Iterable[TypeName], library: Library) -> dict[str, str]:
    """Return the digests by which interfaces of other packages are recorded."""
    return {str(name): _dependency(str(name), library) for name in names}


def _dependency(name: str, library: Library) -> str:
    try:
        parsed = TypeName.parse(name)
    except ValueError:
        return ""
    source = library.source(parsed)
    return meaning(source.text, parsed.package) if source else ""


def _outputs_stand(out: Path, lock: Lock) -> bool:
    tree = Tree(out)
    contents = ((tree.read(path), expected) for path, expected in lock.outputs.items())
    return all(
        isinstance(content, bytes) and digest(content) == expected for content, expected in contents
    )


def _carries_this_runtime(lock: Lock) -> bool:
    """Return whether the copy of the runtime is this idlc's, or there is none.

    Its version does not say so: those of two builds between two releases are equal.
    """
    copy = {
        path.rpartition("_idlc/")[2]: content
        for path, content in lock.outputs.items()
        if "/_idlc/" in f"/{path}"
    }
    return not copy or copy == _runtime()


@lru_cache(maxsize=1)
def _runtime() -> dict[str, str]:
    runtime = _PACKAGE / "runtime"
    return {
        path.relative_to(runtime).as_posix(): digest(path.read_bytes())
        for path in runtime.rglob("*.py")
    }


@lru_cache(maxsize=1)
def _newest_maker() -> int:
    """Return the time at which idlc was last changed: by a developer, or installed."""
    files = (path for folder in _MAKERS for path in folder.rglob("*.*") if path.suffix != ".pyc")
    return max(path.stat().st_mtime_ns for path in files)


class Output(NamedTuple):
    """The manner in which packages are written: with `force` over files that were edited.

    With `check` they are only compared, and edited files are among the changes. Without `runtime`,
    each package keeps its own. `distros` are those that were chosen. With `enums`, classes have
    enums for all fields. `again` is the command for hints that writes them.
    """

    root: Root
    report: Report
    force: bool = False
    runtime: Runtime | None = None
    distros: tuple[str, ...] = ()
    check: bool = False
    enums: bool = False
    again: str = "idlc gen"


class Target:
    """A package folder, existing or not; `name` is its name in reports."""

    #: The folder of the lock, below the package folder; empty, or with a slash at its end.
    home = ""
    #: The folder of the package's modules, in the same form.
    modules = ""

    def __init__(self, name: str, package: str, output: Output) -> None:
        self.name = name
        self.package = package
        self.path = output.root.absolute(name)
        self.report = output.report
        self._output = output

    def beside(self, package: str) -> Target:
        """Return the folder of another package next to this one."""
        name = (Path(self.name).parent / package).as_posix()
        return Target(name, package, self._for_others)

    @property
    def _for_others(self) -> Output:
        return self._output._replace(runtime=self.runtime, enums=False)

    @cached_property
    def lock(self) -> Lock | None:
        """The lock of the last run; reports IDL615 unless everything is to be replaced."""
        report = Report() if self._output.force else self.report
        name, again = f"{self.name}/{self.home}".rstrip("/"), self._output.again
        return load_lock(self.path / self.home, name, report, again)

    @property
    def runtime(self) -> Runtime:
        """Return the chosen runtime mode, or else the mode of the last run."""
        return self._output.runtime or (self.lock.runtime if self.lock else "carried")

    @property
    def enums(self) -> bool:
        """True if classes have enums for all fields, not only for those that ask for one."""
        return self._output.enums

    def usable(self) -> bool:
        """Return whether this is or can become a folder; reports IDL612."""
        for path in (self.path, *self.path.parents):
            if is_folder(path):
                return True
            if os.path.lexists(path):
                message = f"cannot write to `{self.name}`: `{path.name}` is not a folder"
                self.report.add(codes.CANNOT_WRITE.of(self.name, message))
                return False
        return False

    def unchanged(
        self, inputs: Mapping[str, str], library: Library, vendoring: Vendoring = ""
    ) -> bool:
        """Return whether compiling the inputs would change nothing.

        `inputs` are the digests of the input files by name within the package. In a prefix they
        do not show it: libraries depend on the installed distribution, too.
        """
        lock = None if self.home else self.lock
        is_unchanged = (
            lock is not None
            and (lock.idlc, lock.package) == (__version__, self.package)
            and lock.runtime == self.runtime
            and lock.enums == self.enums
            and lock.vendors_as(vendoring)
            and bool(lock.converts_values) == library.distro.converts_values
            and lock.inputs == inputs
            and _outputs_stand(self.path, lock)
            and _carries_this_runtime(lock)
            and _newest_maker() <= (self.path / FILE).stat().st_mtime_ns
            and all(_dependency(name, library) == old for name, old in lock.dependencies.items())
        )
        if is_unchanged:
            write.sweep(self.path)
        return is_unchanged

    def missing(self) -> list[str]:
        """Return the packages that the generated code needs and this Python cannot import."""
        lacking = set()
        for name in self.lock.imports if self.lock else ():
            package, kind = name.split(".")
            inside = f"{kind}/__init__.py"
            if not is_file((self.path / self.modules).parent / package / inside) and not any(
                is_file(place / inside) for place in prefixes.python_folders(package)
            ):
                lacking.add(package)
        return sorted(lacking)

    def is_at_home(self) -> bool:
        """Return whether this Python is one that the generated code is imported with.

        It is if nodes run in it, or if some package that the code needs is installed.
        """
        needed = {name.split(".")[0] for name in (self.lock.imports if self.lock else ())}
        return prefixes.runs_nodes() or any(map(prefixes.python_folders, needed))

    def plan(self, files: Mapping[str, bytes]) -> Plan | None:
        """Return the changes that make the folder hold `files`; `None` if it must not."""
        outputs = self.lock.outputs if self.lock else {}
        owned = write.owned_files(outputs)
        force, record = self._output.check or self._output.force, self.home + FILE
        again = f"{self._output.again} --force"
        return plan(
            self.path, self.name, files, owned, self.report, record=record, force=force, again=again
        )

    def apply(self, changes: Plan, record: Lock) -> bool:
        """Make planned changes and write the lock; report IDL612 and return `False` otherwise."""
        self.lock = record

        def render(outputs: dict[str, str]) -> bytes:
            return encode(msgspec.structs.replace(record, outputs=outputs))

        return write.apply(changes, self.name, self.report, render)

    def remove(self, changes: Plan) -> bool:
        """Remove planned files and the lock; report IDL612 and return `False` otherwise."""
        lock = Change(FILE, changes.recorded, None)
        whole = Plan(self.path, (*changes.changes, lock), {})
        is_done = write.apply(whole, self.name, self.report)
        with suppress(OSError):  # other files stay
            self.path.rmdir()
        return is_done

    def drift(self, changes: Plan, record: Lock, again: str) -> None:
        """Report IDL616 for each file that is not what the command `again` would write."""
        hint = f"run `{again}`"
        if self.lock is None:
            if self.report.had_errors:
                return
            message = f"`{self.name}` has no {self.home}{FILE} to compare with"
            self.report.add(codes.DRIFT.of(self.name, message, hint=hint))
            return
        why = _reasons(self.lock, record) or "idlc itself changed"
        for change in changes.changes:
            path = f"{self.name}/{change.path}"
            wrote = self.lock.outputs.get(change.path)
            advice = hint
            if change.new is None:
                message = f"`{path}` is no longer generated: {why}"
            elif change.old is None:
                message = f"`{path}` is missing" + ("" if wrote else f": {why}")
            elif wrote is None or digest(change.old) not in wrote.split():
                event = "not written by idlc" if wrote is None else "edited after idlc wrote it"
                message = f"`{path}` was {event}"
                advice = f"`{again} --force` replaces it, and keeps a copy"
            else:
                message = f"`{path}` is out of date: {self.cause(change) or why}"
            self.report.add(codes.DRIFT.of(path, message, hint=advice))
        # a dependency found elsewhere that compiles to the same is no drift
        if not changes.changes and (why := _reasons(self.lock, record, dependencies=False)):
            path = f"{self.name}/{self.home}{FILE}"
            self.report.add(codes.DRIFT.of(path, f"`{path}` is out of date: {why}", hint=hint))

    def placed(self, model: Model, modules: Mapping[str, bytes]) -> dict[str, bytes]:
        """Return the files to write for a model: its modules."""
        del model
        return {**modules}

    def cause(self, change: Change) -> str:
        """Return why a file is out of date; empty where only locks show it."""
        del change
        return ""


def _reasons(old: Lock, new: Lock, *, dependencies: bool = True) -> str:
    """Return the differences between the last run and one now; empty without any."""
    pairs = [(old.inputs, new.inputs)]
    if dependencies:
        pairs.append((old.dependencies, new.dependencies))
    reasons = []
    if old.idlc != new.idlc:
        reasons.append(f"idlc {old.idlc} wrote it, and this is idlc {new.idlc}")
    if old.converts_values != new.converts_values:
        reasons.append("idlc wrote it for a different ROS 2 distribution")
    if old.runtime != new.runtime:
        reasons.append(f"its runtime was {old.runtime}, and is now {new.runtime}")
    if old.enums != new.enums:
        reasons.append(f"it was written {'with' if old.enums else 'without'} `enums = true`")
    if old.package != new.package:
        reasons.append(f"the package had the name `{old.package}`")
    if old.vendoring != new.vendoring:
        modes = {
            "": "without `--vendor-deps`",
            "private": "with `--vendor-deps`",
            "beside": "with `--vendor-deps=beside`",
        }
        reasons.append(f"it was written {modes[old.vendoring]}")
    for before, after in pairs:
        reasons += [f"`{name}` was added" for name in sorted(after.keys() - before.keys())]
        reasons += [f"`{name}` was removed" for name in sorted(before.keys() - after.keys())]
        common = sorted(before.keys() & after.keys())
        reasons += [f"`{name}` changed" for name in common if before[name] != after[name]]
    return first_few(reasons, 3)
