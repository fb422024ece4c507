"""Versions of types: of a class, of a recording's topic, and of what `--to` names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from idlc.compiler.compiler import Compiler
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.model import catalog, derive, ir
from idlc.model.distros import NEWEST
from idlc.model.from_description import model_of_description
from idlc.project.library import InterfaceTexts, Library
from idlc.project.root import Root
from idlc.recordings.definitions import interface_of
from idlc.runtime.names import owner_of
from idlc.runtime.typeinfo import Structure, structure_of
from idlc.versions.conversion import Version
from idlc.wire.layout import report_oversized


def version_of(kind: Any) -> Version:
    """Return the version of a generated class, with comments where its package has its files."""
    owner = owner_of(kind)
    structure = structure_of(owner)

    def find(name: str) -> Any:
        return owner if name == structure.name else structure.types.find_class(name)

    texts: dict[ir.TypeName, Source] = {}
    for part in _parts(structure):
        for written, text in part.types.sources.items():
            own = ir.TypeName.parse(written)
            texts.setdefault(own, Source(f"{own.package}/{own.file}", text))
    name = ir.TypeName.parse(structure.name)
    version = version_of_texts(texts, name)
    if version is not None and version.key.hash == structure.hash:
        return Version(version.models, name, find)
    described = [structure.types.descriptions[each.name] for each in _referenced(structure)]
    description: Any = {
        "type_description": described[0],
        "referenced_type_descriptions": described[1:],
    }
    model = model_of_description(description, structure.name, structure.hash, "a class")
    return Version({name.package: model}, name, find)


def _referenced(structure: Structure) -> list[Structure]:
    """Return a structure and all that it refers to, each once."""
    found = {structure.name: structure}
    queue = [structure]
    for each in queue:
        for field in each.members:
            if field.nested and field.nested.name not in found:
                found[field.nested.name] = field.nested
                queue.append(field.nested)
    return list(found.values())


def _parts(structure: Structure) -> Iterator[Structure]:
    """Yield a structure of each package that describes a part of one."""
    packages: set[str] = set()
    for each in _referenced(structure):
        package = each.name.partition("/")[0]
        if package in packages:
            continue
        packages.add(package)
        if each.is_own:
            yield each
            continue
        try:
            yield structure_of(each.find_class())
        except (AttributeError, ImportError, KeyError, TypeError, ValueError):
            continue  # a class of rosidl, which has no description


#: The packages of the types that services and actions imply.
_IMPLIED = {
    *("builtin_interfaces", "unique_identifier_msgs"),
    *(package for packages in derive.IMPLICIT_PACKAGES.values() for package in packages),
}


class _Texts(Library):
    """Texts, and the standard types that services and actions imply."""

    def source(self, name: ir.TypeName) -> Source | None:
        """Return the text of an interface."""
        if name not in self.texts and name.package in _IMPLIED:
            return catalog.source(name, NEWEST)
        return self.texts.get(name)


def version_of_texts(texts: InterfaceTexts, name: ir.TypeName) -> Version | None:
    """Return the version of a type that texts define; `None` after errors, or over a limit."""
    report = Report()
    library = _Texts((), Root.here(), report, distro=NEWEST, texts=texts)
    compiler = Compiler(library)
    models = compiler.models(compiler.reached([interface_of(name)]), report)
    model = models.get(name.package)
    report_oversized(models.values(), report)
    if report.had_errors or model is None or name not in model.messages:
        return None
    return Version(models, name)
