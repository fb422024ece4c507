"""The packages that a command is asked for: files by package, and interfaces of a library."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from collections.abc import Set as AbstractSet
from pathlib import Path

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError, first_few
from idlc.diagnostics.text import worded
from idlc.model import catalog, ir
from idlc.project import inputs
from idlc.project.find import InterfaceFile, find
from idlc.project.inputs import accept_name, by_home, output_folders, separate_homes
from idlc.project.library import Library
from idlc.project.package_xml import declared_name
from idlc.project.settings import Scope


def requested_packages(
    paths: Sequence[str], named: Sequence[inputs.Inputs], out: str, scope: Scope, report: Report
) -> tuple[inputs.Inputs, ...]:
    """Return the packages at paths, and the named ones.

    Reports IDL607 for names that cannot be imported, IDL608 for folders that are no packages. Files
    without errors may still follow, so only problems with the words raise ReportedError.
    """
    files = find(paths, scope.root, report, scope.exclude) if paths else ()
    packages = list(named)
    for package in named:
        accept_name(package.package, "the command line", report)
    if files and not report.had_errors:  # not all files may be known
        packages += _from_files(files, "" if packages else out, scope, report)
    if any(diagnostic.code in codes.USAGE for diagnostic in report):
        raise ReportedError
    return inputs.without_duplicates(packages, scope.root, report)


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
                hint=worded("use --package NAME for one package, or ", "")
                + "add a package.xml to each folder",
            )
        )
        return ()
    if apart or not out:
        packages = inputs.packages(files, scope, report)
        folders = (package.home for package in packages)
        origins = ["package.xml" if root.manifest(folder) else "its folder" for folder in folders]
    else:
        name, origin = _name_of_all(homes, out, scope, report)
        origins = [origin]
        packages = (inputs.load(name, files, min(homes), root, report),)
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


def _name_of_all(
    homes: Collection[Path], out: str, scope: Scope, report: Report
) -> tuple[str, str]:
    """Return the name of the package that all files make up, and where it comes from."""
    root = scope.root
    if scope.package is not None:
        return scope.package, "--package"
    declared = next((path for home in homes if (path := root.manifest(home))), None)
    name = declared_name(declared, root, report) if declared else None
    if name is not None:
        return name, "package.xml"
    home, name, origin = min(homes), root.absolute(out).name, "the folder given with -o"
    if catalog.is_standard(name) and home.name != name:
        report.add(
            codes.UNIMPORTABLE_PACKAGE.of(
                "",
                f"`{name}` (from {origin}) would hide the ROS 2 package",
                hint=f"choose another folder, or confirm the name with `--package {name}`",
            )
        )
    # other commands cannot know that name
    if name != home.name and root.absolute(out).parent not in output_folders(home, root):
        report.notes.append(
            f"the package is named `{name}`, after the output folder; other commands "
            f"need `--package {name}`, or a package.xml next to the interfaces"
        )
    return name, origin


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


def _borrowed(name: ir.TypeName, library: Library) -> inputs.Input:
    source = library.source(name)
    assert source is not None, name
    file = InterfaceFile(Path(source.path), source.path, name.kind, name.name, str(name), Path())
    return inputs.Input(file, source.text.encode())
