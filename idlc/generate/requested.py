"""The packages that a run of `idlc gen` writes, and their folders."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Sequence
from collections.abc import Set as AbstractSet
from pathlib import Path

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.generate.target import Target
from idlc.model import catalog, ir
from idlc.project import inputs
from idlc.project.files import is_file
from idlc.project.find import KINDS, Exclusions, InterfaceFile, find
from idlc.project.inputs import accept_name, by_home, places, several
from idlc.project.library import Library
from idlc.project.lock import FILE
from idlc.project.package_xml import declared_name
from idlc.project.root import Root
from idlc.project.settings import Scope


def requested_packages(
    paths: Sequence[str],
    named: Sequence[inputs.Inputs],
    out: str,
    scope: Scope,
    report: Report,
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
    apart = [] if scope.package else several(homes, root)
    if _mixed(apart, root, report):
        return ()
    declared = next((path for home in homes if (path := root.manifest(home))), None)
    if apart or not out:
        packages = inputs.packages(files, scope, report)
        folders = (package.home for package in packages)
        origins = ["package.xml" if root.manifest(folder) else "its folder" for folder in folders]
    else:
        name, origins = scope.package, ["--package"]
        if name is None and declared:
            name, origins = declared_name(declared, root, report), ["package.xml"]
        if name is None:
            name, origins = root.absolute(out).name, ["the folder given with -o"]
            if catalog.is_standard(name) and min(homes).name != name:
                report.add(
                    codes.UNIMPORTABLE_PACKAGE.of(
                        "",
                        f"`{name}` (from {origins[0]}) would hide the ROS 2 package",
                        hint=f"choose another folder; add `--package {name}` if they are its files",
                    )
                )
            _note_name(name, min(homes), out, root, report)
        packages = (inputs.load(name, files, min(homes), root, report),)
    if out and any(root.absolute(file.path.parent) == root.absolute(out) for file in files):
        report.add(
            codes.FOREIGN_FILE.of(
                out,
                f"`{out}` holds interface files: generated code would lie among them",
                hint="choose another folder with -o",
            )
        )
    for package, origin in zip(packages, origins, strict=True):
        accept_name(package.package, origin, report)
    return packages


def _note_name(name: str, home: Path, out: str, root: Root, report: Report) -> None:
    """Note a name that other commands cannot know."""
    if name != home.name and root.absolute(out).parent not in places(home, root):
        report.notes.append(
            f"the package is called `{name}`, as the folder given with -o; other commands need "
            f"`--package {name}`, or a package.xml beside the interfaces"
        )


def _mixed(homes: Sequence[Path], root: Root, report: Report) -> bool:
    """Report nested folders of interfaces without a package.xml."""
    loose = [home for home in homes if not root.manifest(home)]
    if not any(set(home.parents) & set(homes) for home in loose):
        return False
    names = first_few((f"`{root.shown(home)}`" for home in homes), 5)
    report.add(
        codes.SEVERAL_PACKAGES.of(
            root.shown(homes[0]),
            f"these may be one package or {len(homes)}: {names}",
            hint="give --package NAME to compile them as one, or each folder a package.xml",
        )
    )
    return True


def borrowed(types: Iterable[ir.TypeName], library: Library) -> inputs.Inputs:
    """Return types of one package, found in a library, as its input."""
    names = sorted(types)
    home = library.home(names[0].package)
    return inputs.Inputs(
        names[0].package,
        tuple(_borrowed(name, str(name), library) for name in names),
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
        more = (_borrowed(name, str(name), library) for name in missing if package.borrowed)
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
            own = (name for name in names if name.endswith(".idl"))
            alone = (name for name in own if f"{name.removesuffix('.idl')}{kind}" not in names)
            included = (name for name in alone if not exclude.has(str(inside / name)))
            unread += [f"{kind[1:]}/{name}" for name in included]
    return sorted(unread)


def _borrowed(name: ir.TypeName, word: str, library: Library) -> inputs.Input:
    source = library.source(name)
    assert source is not None, name
    file = InterfaceFile(Path(source.path), source.path, name.kind, name.name, word, Path())
    return inputs.Input(file, source.text.encode())


def folder_targets(
    packages: Sequence[inputs.Inputs], out: str, root: Root, report: Report, *, force: bool
) -> tuple[Target, ...]:
    """Return the folder of each package: OUT for one, a folder of its name in OUT for several.

    Reports IDL608 where a package of an earlier run is in the way, IDL612 for other files.
    """
    top = root.absolute(out)
    if len(packages) == 1:
        package = packages[0].package
        beside_others = is_file(top / package / FILE) and not is_file(top / FILE)
        folder = f"{out}/{package}" if beside_others else out
        targets = [Target(folder, package, root, report, force=force)]
    elif is_file(top / FILE):
        message = f"`{out}` holds one package, and these are {len(packages)}"
        hint = "choose a folder for all of them with -o, each gets one of its name there"
        report.add(codes.SEVERAL_PACKAGES.of(out, message, hint=hint))
        return ()
    else:
        base = out.rstrip("/") or out
        names = [each.package for each in packages]
        targets = [Target(f"{base}/{name}", name, root, report, force=force) for name in names]
    return tuple(targets) if all(target.usable() for target in targets) else ()
