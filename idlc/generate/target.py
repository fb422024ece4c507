"""The folder that a generated package is written to."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.model.link import Model
from idlc.packaging.files import SETUP_PY
from idlc.project import inputs, prefixes, write
from idlc.project.files import is_file, is_folder
from idlc.project.lock import BUILD_STEP, COPY_HEAD, FILE, Lock, Runtime, Tree, encode, load_lock
from idlc.project.package_xml import declared_name
from idlc.project.root import Root
from idlc.project.settings import SETTINGS_FILE
from idlc.project.step import digest
from idlc.project.write import FileChange, WritePlan, plan


def build_step() -> bytes:
    """Return the file that builds without idlc run."""
    source = Path(__file__).parents[1] / "project" / "step.py"
    return (COPY_HEAD + source.read_text(encoding="utf-8")).encode()


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

    @cached_property
    def step(self) -> Mapping[str, bytes]:
        """The file that the package's build runs; empty if there is no such build."""
        root = self._output.root
        manifest = root.manifest(self.path)
        if manifest is not None and is_file(manifest.parent / SETUP_PY):
            is_run = declared_name(manifest, root, Report()) == self.package
        else:
            is_run = self._is_step_named()
        return {BUILD_STEP: build_step()} if is_run else {}

    def _is_step_named(self) -> bool:
        """Return whether a setup.py or pyproject.toml above the package names the file."""
        root = self._output.root
        for folder in self.path.parents:
            named = f"{self.path.relative_to(folder).as_posix()}/{BUILD_STEP}"
            files = [folder / name for name in (SETUP_PY, SETTINGS_FILE)]
            sources = [root.read_source(file, "", Report()) for file in files if is_file(file)]
            if any(named in source.text for source in sources if source):
                return True
        return False

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

    def plan(self, files: Mapping[str, bytes]) -> WritePlan | None:
        """Return the changes that make the folder hold `files`; `None` if it must not."""
        outputs = self.lock.outputs if self.lock else {}
        if self.step and BUILD_STEP not in outputs:
            outputs = {**outputs, **self._scaffolded()}
        owned = write.owned_files(outputs)
        force, record = self._output.check or self._output.force, self.home + FILE
        again = f"{self._output.again} --force"
        return plan(
            self.path, self.name, files, owned, self.report, record=record, force=force, again=again
        )

    def _scaffolded(self) -> dict[str, str]:
        """Return the digest of the file that another idlc scaffolded, as for a lock."""
        content = Tree(self.path).read(BUILD_STEP)
        if isinstance(content, bytes) and content.startswith(COPY_HEAD.encode()):
            return {BUILD_STEP: digest(content)}
        return {}

    def apply(self, changes: WritePlan, record: Lock) -> bool:
        """Make planned changes and write the lock; report IDL612 and return `False` otherwise."""
        self.lock = record

        def render(outputs: dict[str, str]) -> bytes:
            return encode(msgspec.structs.replace(record, outputs=outputs))

        return write.apply(changes, self.name, self.report, render)

    def remove(self, changes: WritePlan) -> bool:
        """Remove planned files and the lock; report IDL612 and return `False` otherwise."""
        lock = FileChange(FILE, changes.recorded, None)
        whole = WritePlan(self.path, (*changes.changes, lock), {})
        is_done = write.apply(whole, self.name, self.report)
        with suppress(OSError):  # other files stay
            self.path.rmdir()
        return is_done

    def drift(self, changes: WritePlan, record: Lock, again: str) -> None:
        """Report IDL616 for each file that is not what the command `again` would write."""
        hint = f"run `{again}`"
        if self.lock is None:
            if self.report.had_errors:  # the lock may be damaged
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
        return {**modules, **self.step}

    def cause(self, change: FileChange) -> str:
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
