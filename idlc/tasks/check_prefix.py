"""The pipeline of `idlc check --ament`: can C++ tools load the installed libraries."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from idlc.compiler.compiler import models_of, stage
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, first_few
from idlc.generate.native import library as native
from idlc.generate.native.library import inspect
from idlc.generate.native.platforms import LAYOUTS
from idlc.model import derive, ir
from idlc.model.link import Model
from idlc.project import inputs, prefixes
from idlc.project.files import is_file, read_bytes
from idlc.project.find import list_files
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.tasks.check import CheckResult

_AGAIN = "install idlc and build the package again, or run `idlc gen SOURCES --ament PREFIX`"


def check_prefix(folder: str, root: Root, report: Report) -> CheckResult:
    """Report each package in a prefix, or in the prefixes in a folder, that stops recorders."""
    folders = prefixes.prefixes(root.absolute(folder))
    if not folders:
        message = f"no packages in `{folder}`: share/ament_index is missing"
        hint = "pass a folder from AMENT_PREFIX_PATH, or colcon's `install` folder"
        report.add(codes.NO_SUCH_PATH.of(folder, message, hint=hint))
    for prefix in folders:
        for package, why in prefixes.inconsistencies(prefix):
            message = f"`{package}` {why}"
            place = root.shown(prefix / prefixes.INDEX)
            report.add(codes.INCONSISTENT_INDEX.of(place, message, hint=_AGAIN))
    files = []
    for prefix, package in ((at, name) for at in folders for name in prefixes.with_interfaces(at)):
        model = _model(prefix, package, root)
        for identifier in (native.OWN, native.FIELDS_CPP):
            name = f"lib{package}__{identifier}.so"
            path = prefix / "lib" / name
            files.append(root.shown(path))
            with stage("check library", files[-1]):
                data = read_bytes(path, files[-1], Report()) if is_file(path) else None
                why = next(_problems(data, prefix, identifier, model), "")
            if why:
                message = f"`{name}` {why}, so C++ tools fail on the types in `{package}`"
                report.add(codes.UNUSABLE_LIBRARY.of(files[-1], message, hint=_AGAIN))
    if folders and not files and not len(report):
        message = f"no package with interfaces is registered in `{folder}`"
        hint = "build a package with idlc, or pass the prefix that contains it"
        report.add(codes.NO_SUCH_PATH.of(folder, message, hint=hint))
    return CheckResult(tuple(files), len(files))


def _model(prefix: Path, package: str, root: Root) -> Model | None:
    """Return the model of a package's installed interfaces; `None` after errors."""
    dropped = Report()
    home = prefix / "share" / package
    files = list_files((root.shown(home),), root, dropped).files
    package_inputs = inputs.load(package, files, home, root, dropped)
    scope = Scope(root, include=(str(prefix),))
    models = list(models_of((package_inputs,), scope, dropped))
    return None if dropped.had_errors or not files else models[0][1]


def _problems(
    data: bytes | None, prefix: Path, identifier: str, model: Model | None
) -> Iterator[str]:
    """Yield the problems of a library, the gravest first, in words that follow its name."""
    library = data and inspect(data)
    if data is None:
        if identifier == native.OWN:
            yield "is missing"
        return
    if not library:
        yield "is not a complete shared library"
        return
    own = native.MACHINES.get(prefixes.machine())
    if own is not None and library.machine != own.number:
        yield f"is for a different processor than {prefixes.machine()}"
    if model is None:
        return
    messages = [message for own in model.own for message in derive.messages(own)]
    expected = [message.name for message in messages]
    if library.stamp is None:
        # older distributions have no events
        expected = [name for name in expected if not name.name.endswith("_Event")]
    missing = [
        f"`{name}`" for name in expected if native.symbol(identifier, name) not in library.symbols
    ]
    if missing:
        yield f"lacks {first_few(missing, 3)}"
    if library.stamp is not None:
        yield from _stale(data, library.stamp, prefix, messages, model)


def _stale(
    data: bytes, stamp: bytes, prefix: Path, messages: Iterable[ir.Message], model: Model
) -> Iterator[str]:
    """Yield how a complete library differs from the interfaces and from the distribution."""
    hashes = {str(message.name): model.describer.hash(str(message.name)) for message in messages}
    stale = [f"`{name}`" for name, hash_ in hashes.items() if native.hash_bytes(hash_) not in data]
    if stale:
        yield f"is out of date: {first_few(stale, 3)} changed since"
    local = prefixes.distribution((prefix, *prefixes.ament_prefixes()))
    layout = LAYOUTS.get(local.name)
    if layout is not None and stamp != native.identity_stamp(layout):
        yield f"is for a different ROS 2 distribution than {local.name} ({local.why})"
