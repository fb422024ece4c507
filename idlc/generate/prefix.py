"""A prefix that ROS 2 and its tools read, with several packages and files of others in it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from shlex import quote
from typing import NamedTuple

from idlc.compiler.compiler import stage
from idlc.diagnostics.report import Report
from idlc.generate.native.elf import Machine
from idlc.generate.native.library import MACHINES, inspect, libraries
from idlc.generate.native.platforms import LAYOUTS, StructLayout
from idlc.generate.target import Output, Target
from idlc.model.idl_text import file_text, idl
from idlc.model.link import Model
from idlc.project import prefixes, write
from idlc.project.library import Library
from idlc.project.lock import Tree
from idlc.project.prefixes import DEFAULT, INDEX, Distribution, distribution
from idlc.project.write import FileChange, WritePlan


class Libraries(NamedTuple):
    """The libraries of a package by their paths in a prefix, such as `lib/libNAME.so`.

    `missing` says why a package with interfaces has none. Such a package must not be registered in
    the index of ROS 2: recorders stop at it. `build_tag` is part of the name of the package's
    wheel, so that wheels for different distributions have different names.
    """

    files: Mapping[str, bytes]
    missing: str = ""
    build_tag: str = ""


def libraries_of(model: Model, distro: Distribution | None = None) -> Libraries:
    """Return the libraries of a model without errors, by default for the installed distribution.

    Write them elsewhere and move them into place: programs may have the old ones open.
    """
    distro = distro or distribution()
    target = target_of(distro)
    if not model.own or isinstance(target, str):
        missing = target if model.own and isinstance(target, str) else ""
        return Libraries({}, missing, build_tag(model))
    with stage("libraries", model.package):
        files = libraries(model, *target)
    placed = {f"lib/{name}": content for name, content in files.items()}
    return Libraries(placed, build_tag=build_tag(model, distro.name))


def build_tag(model: Model, *libraries: str) -> str:
    """Return a wheel's build tag; `libraries` is the distribution that it has libraries for."""
    names = dict.fromkeys((model.distro.name, *libraries))
    return "" if list(names) == [DEFAULT] else f"1{'_'.join(names)}"


def target_of(distro: Distribution) -> tuple[Machine, StructLayout] | str:
    """Return the processor and layout of libraries on this machine, or why there are none."""
    machine = MACHINES.get(prefixes.machine())
    layout = LAYOUTS.get(distro.name)
    if machine is None:
        return f"idlc only generates libraries for Linux on {' and '.join(MACHINES)}"
    if layout is None:
        return f"idlc does not support this ROS 2 distribution ({distro.why})"
    return machine, layout


#: The list of the packages that have interfaces, each a file with their names.
INTERFACES = f"{INDEX}/rosidl_interfaces"


def shared(
    model: Model, manifest: str | bytes | None, libraries: Libraries, report: Report
) -> dict[str, bytes]:
    """Return libraries, package.xml, interfaces and entries in the index, in the order to write.

    Files come after those that they refer to. Without libraries the package is registered neither
    as a package nor as one with interfaces: recorders stop at the first, `ros2 interface list` at
    the second without the first.
    """
    name = model.package
    files: dict[str, str | bytes] = {**libraries.files}
    if manifest is not None:
        files[f"share/{name}/package.xml"] = manifest
    interfaces = {}
    for own in model.own:
        key = f"{own.name.kind}/{own.name.name}"
        interfaces[f"{key}.{own.name.kind}"] = file_text(own)
        interfaces[f"{key}.idl"] = idl(own)
        described = model.describer.installed(str(own.name))
        files[f"share/{name}/{key}.json"] = json.dumps(described, indent=2)
    files |= {f"share/{name}/{path}": text for path, text in interfaces.items()}
    files[f"{INDEX}/package_run_dependencies/{name}"] = ";".join(dependencies(model))
    if libraries.missing:
        report.notes.append(
            f"idlc does not add `{name}` to ROS 2's index, because recorders stop at a package "
            f"without a library: {libraries.missing}"
        )
    else:
        files[f"{INTERFACES}/{name}"] = "\n".join(sorted(interfaces))
        files[f"{INDEX}/packages/{name}"] = ""
    return {
        path: content.encode() if isinstance(content, str) else content
        for path, content in files.items()
    }


def dependencies(model: Model) -> list[str]:
    """Return the packages whose interfaces a model has besides its own."""
    return sorted({name.package for name in model.interfaces} - {model.package})


#: The first bytes of the setup files for shells, which all packages in a prefix share.
MARK = b"# Written by idlc"


class Overlay(Target):
    """A package in a prefix. Its lock is in its share folder."""

    def __init__(self, name: str, package: str, home: Path | None, output: Output) -> None:
        super().__init__(name, package, output)
        root, report = output.root, output.report
        declared = root.manifest(home) if home else None
        #: The content of its package.xml; `None` if there is none to be copied.
        self.manifest = (
            root.read_bytes(declared, root.shown(declared), report) if declared else None
        )
        self.home = f"share/{package}/"
        self.modules = f"{prefixes.modules_folder()}/{package}/"

    @property
    def distribution(self) -> Distribution:
        """The distribution that libraries are for: the installed one, unless others are chosen."""
        installed = distribution((self.path, *prefixes.ament_prefixes()))
        if not self._output.distros or installed.name in self._output.distros:
            return installed
        chosen = self._output.distros[0]
        self.report.notes.append(
            f"`{self.name}` gets libraries for {chosen}, not for {installed.name} ({installed.why})"
        )
        return Distribution(chosen, f"--distro {chosen}")

    def beside(self, package: str) -> Overlay:
        """Return another package in the prefix."""
        home = Library((), self._output.root, Report()).home(package)
        return Overlay(self.name, package, home, self._for_others)

    def cause(self, change: FileChange) -> str:
        """Say why a library differs, if another distribution is the reason."""
        old, new = (inspect(data or b"") for data in (change.old, change.new))
        if old is None or new is None or old.stamp == new.stamp:
            return ""
        return "it is for a different ROS 2 distribution"

    def placed(self, model: Model, modules: Mapping[str, bytes]) -> dict[str, bytes]:
        """Return the files of a package by their paths in the prefix.

        They are in the order in which to write them: files come after those that they refer to.
        """
        from idlc.generate.templates import Code

        manifest = self.manifest or _rendered(
            "overlay/package.xml.jinja",
            name=Code(model.package),
            depends=[Code(name) for name in dependencies(model)],
        )
        libraries = libraries_of(model, self.distribution)
        files = {f"{self.modules}{path}": text for path, text in modules.items()}
        return {**files, **shared(model, manifest, libraries, self.report)}


def write_setup_scripts(overlay: Target) -> bool:
    """Write the setup files for shells; foreign files stay, with a note."""
    from idlc.generate.templates import EscapedText

    prefix = EscapedText(quote(overlay.path.as_posix()))
    tree, changes = Tree(overlay.path), []
    for shell in ("sh", "bash", "zsh"):
        # for shells that do not know the path of the file that they source
        new = _rendered(f"overlay/setup.{shell}.jinja", prefix=prefix).encode("utf-8")
        for path in (f"local_setup.{shell}", f"setup.{shell}"):
            old = tree.read(path)
            if old is None or (isinstance(old, bytes) and old.startswith(MARK)):
                changes += [] if old == new else [FileChange(path, old, new)]
            else:
                overlay.report.notes.append(
                    f"`{overlay.name}/{path}` was not written by idlc: add `{overlay.name}` to "
                    "AMENT_PREFIX_PATH"
                )
    return write.apply(WritePlan(overlay.path, tuple(changes), {}), overlay.name, overlay.report)


def _rendered(template: str, **variables: object) -> str:
    from idlc.generate.templates import code

    return code().get_template(template).render(**variables)
