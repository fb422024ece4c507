"""The pipelines of the commands that answer: hash and describe."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from idlc.disk import inputs
from idlc.disk.find import find, is_path
from idlc.disk.library import Library
from idlc.driver.stages import compile_package, derived_names, models_of, stage
from idlc.model import ir
from idlc.text import codes
from idlc.text.diagnostics import Report
from idlc.text.suggest import did_you_mean

if TYPE_CHECKING:
    from idlc.model.link import Model


def hashes(
    wanted: Sequence[str], package: str | None, include: Sequence[str], report: Report
) -> list[tuple[str, str]]:
    """Return type hash and full name of what paths and type names mean, derived types included."""
    found: list[tuple[str, str]] = []
    for model, names in wanted_models(wanted, package, include, report):
        with stage("describe", model.package):
            found += [(model.describer.hash(name), name) for name in names]
    return list(dict.fromkeys(found))


def describe(
    wanted: str, package: str | None, include: Sequence[str], report: Report
) -> dict[str, object] | None:
    """Return the content of the JSON file that ROS 2 installs for one interface or derived type."""
    found = list(wanted_models((wanted,), package, include, report))
    if report.had_errors or not found:
        return None
    (model, names) = found[0]
    tops = [str(own.name) for own in model.own if str(own.name) in names] or names
    if len(found) > 1 or len(tops) > 1:
        hint = f"name one of them, such as `idlc describe {tops[0]}`"
        message = f"`{wanted}` holds several interfaces"
        report.add(codes.NO_SUCH_TYPE.of(wanted, message, hint=hint))
        return None
    with stage("describe", tops[0]):
        return {**model.describer.installed(tops[0])}


def wanted_models(
    wanted: Sequence[str], package: str | None, include: Sequence[str], report: Report
) -> Iterator[tuple[Model, list[str]]]:
    """Yield, for paths and type names, sound models and the names in them that are meant."""
    paths = [one for one in wanted if is_path(one)]
    library = Library(include, report)
    for one in wanted:
        if one not in paths:
            found = Report()
            yield from _named(one, library, found)
            report.extend(found)
    if paths:
        files = find(paths, report)
        for model, names in models_of(inputs.packages(files, package, report), include, report):
            if not report.had_errors:
                yield model, names


def _named(text: str, library: Library, report: Report) -> Iterator[tuple[Model, list[str]]]:
    """Yield the model of one type and the names meant: a derived type alone, or all of a file."""
    package, _, rest = text.partition("/")
    full = f"{package}/msg/{rest}" if rest and "/" not in rest else text
    try:
        name = ir.TypeName.parse(full)
    except ValueError:
        message = f"`{text}` is neither a path nor a type such as `std_msgs/msg/Header`"
        report.add(codes.NO_SUCH_TYPE.of("", message))
        return
    base, source = name, library.source(name)
    while source is None and "_" in base.name and base.kind != "msg":
        base = base._replace(name=base.name.rpartition("_")[0])
        source = library.source(base)
    model = source and compile_package(package, [(base, source)], library, report)
    if model and not report.had_errors:
        names = [n for own in model.own if own.name == base for n in derived_names(own)]
        if base == name:
            yield model, names
            return
        if full in names:
            yield model, [full]
            return
    if not report.had_errors:
        near = did_you_mean(full, (str(known) for known in library.interfaces(package)))
        hint = near or did_you_mean(package, library.packages())
        report.add(codes.NO_SUCH_TYPE.of("", f"no such type: `{text}`", hint=hint))
