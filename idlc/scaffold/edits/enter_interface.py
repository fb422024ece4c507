"""Entering an interface in its package: the files that must list it or what it depends on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from idlc.model import catalog, derive
from idlc.model.link import Model
from idlc.scaffold import new_interface
from idlc.scaffold.edits import cmake, data_files, package_xml
from idlc.scaffold.edits.outcome import Edited, Outcome

CMAKE = "CMakeLists.txt"
MANIFEST = "package.xml"
SETUP = "setup.py"


def enter(
    model: Model,
    texts: Mapping[str, str],
    keys: Iterable[str],
    folders: Mapping[str, bool],
    *,
    tested: bool,
) -> dict[str, Outcome]:
    """Return the edits of a package that has got the interfaces of a model.

    `texts` are those of the package's files that exist, `keys` all its interfaces as
    `kind/Name.kind`, `folders` those that there are by dotted name, and whether each is a Python
    package. The package needs pytest if it is `tested`.
    """
    needed = depends(model)
    tests = ["python3-pytest"] if tested else []
    edits: dict[str, Outcome] = {
        MANIFEST: package_xml.add(texts.get(MANIFEST, ""), depends=needed, tests=tests, group=True)
    }
    if CMAKE in texts:
        edits[CMAKE] = cmake.add_dependencies(texts[CMAKE], needed)
        return edits
    if SETUP in texts:
        wired = data_files.add_interfaces(texts[SETUP], model.package, keys, folders)
        edits[SETUP] = Edited(wired)
    return edits


def index(model: Model, texts: Mapping[str, str], keys: Iterable[str]) -> dict[str, str]:
    """Return the index of interfaces, for a package that no CMake installs."""
    return {} if CMAKE in texts else dict([new_interface.index(model.package, set(keys))])


def depends(model: Model) -> list[str]:
    """Return the packages that a package depends on for its own interfaces."""
    implied = {p for one in model.own for p in derive.IMPLICIT_PACKAGES[one.name.kind]}
    implied &= {*catalog.packages(model.distro)}  # older distributions lack some
    used = {target.package for one in model.own for target in derive.references(one)}
    return sorted((implied | used) - {model.package})
