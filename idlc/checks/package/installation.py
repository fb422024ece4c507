"""Rules on setup.py and its neighbours: what colcon builds can be found and run afterwards."""

from __future__ import annotations

import shlex
from fnmatch import fnmatchcase
from functools import lru_cache
from typing import TYPE_CHECKING

import msgspec

from idlc.checks.package.facts import Facts
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit, Report, enumerated, first_few
from idlc.diagnostics.source import Source, Span
from idlc.model.link import Model

if TYPE_CHECKING:
    import ast
    from collections.abc import Iterator, Mapping, Sequence

    from idlc.checks.package.setup_py import DataFiles, Setup

_INDEX = "share/ament_index/resource_index"
#: What keeps interfaces and their classes from being installed.
CODES = (
    codes.INTERFACES_NOT_INSTALLED,
    codes.NO_LIBRARY_INSTALLED,
    codes.CLASSES_NOT_INSTALLED,
)
_FINDERS = ("find_packages", "find_namespace_packages")
_FIND = "find_packages(exclude=['test'])"


@lru_cache(maxsize=16)
def _read(source: Source) -> Setup:
    from idlc.checks.package.setup_py import Setup  # what has no setup.py needs no ast

    return Setup(source)


def _built_by_setup(facts: Facts) -> Setup | None:
    """Return what setup.py says, if it builds the package."""
    is_python = facts.setup_py is not None and facts.build_type == "ament_python"
    return _read(facts.setup_py) if facts.setup_py is not None and is_python else None


def wiring(setup: Source, package: str, keys: Sequence[str], folders: Mapping[str, bool]) -> Report:
    """Return what keeps a setup.py from installing interfaces and their classes.

    `keys` are the interfaces as `kind/Name.kind`, `folders` those of the package by dotted name,
    and whether each has an `__init__.py`.
    """
    from idlc.checks.package.libraries import unusable_entry

    report = Report()
    read = _read(setup)
    report.extend(_missing_interfaces(read, package, keys))
    report.extend(unusable_entry(read, package))
    report.extend(_missing_packages(read, package, keys, folders))
    return report


def installed(facts: Facts, model: Model, report: Report) -> None:
    """setup.py installs interfaces, their classes, and what C++ tools load."""
    setup = _built_by_setup(facts)
    if setup is not None and model.own:
        keys = sorted(f"{one.name.kind}/{one.name.name}.{one.name.kind}" for one in model.own)
        report.extend(wiring(setup.source, facts.name, keys, facts.folders))
    elif setup is not None:
        report.extend(_absent_folders(setup, facts.name, (), facts.folders))


def _missing_interfaces(setup: Setup, package: str, keys: Sequence[str]) -> Iterator[Diagnostic]:
    """Yield the problem with interface files that `ros2 interface show` will not find."""
    entries = setup.data_files
    if entries is None:
        return
    share = f"share/{package}"
    kinds = sorted({key.partition("/")[0] for key in keys})
    missing = [kind for kind in kinds if _lacks(entries, f"{share}/{kind}", keys, kind)]
    index = _lacks(entries, f"{_INDEX}/rosidl_interfaces", ())
    if not missing and not index:
        return
    what = [f"the {enumerated([f'.{kind}' for kind in missing])} files"] if missing else []
    what += ["the index entry of the interfaces"] if index else []
    lines = [f"('{share}/{kind}', glob('{kind}/*.{kind}'))" for kind in missing]
    if index:
        lines.append(f"('{_INDEX}/rosidl_interfaces', glob('resource/rosidl_interfaces/*'))")
    problem = codes.INTERFACES_NOT_INSTALLED.at(
        _place(setup, "data_files"),
        f"{enumerated(what)} {'are' if missing else 'is'} not among the `data_files`",
    )
    yield _with_data_files(problem, setup, lines, uses_glob=True)


def _lacks(entries: Sequence[DataFiles], folder: str, keys: Sequence[str], kind: str = "") -> bool:
    """Return whether entries are known not to install files into a folder of the prefix."""
    there = [one for one in entries if one.folder is None or one.folder.rstrip("/") == folder]
    patterns = [pattern for one in there for pattern in _files(one)]
    wanted = [key.rpartition("/")[2] for key in keys if key.startswith(f"{kind}/")] or [""]
    names = [pattern.rpartition("/")[2] for pattern in patterns]
    # a file is looked for by name only, where patterns for all of its kind are usual
    return not all(any(not one or fnmatchcase(one, name) for name in names) for one in wanted)


def _files(entry: DataFiles) -> tuple[str, ...]:
    return ("*",) if entry.files is None else entry.files  # what cannot be seen may be anything


def _with_data_files(
    problem: Diagnostic, setup: Setup, lines: Sequence[str], *, uses_glob: bool = False
) -> Diagnostic:
    """Return a problem with the hint and the edits that add entries to `data_files`."""
    from idlc.checks.package.setup_edits import appended, argument, imported

    glob, imports = imported(setup, "glob", "glob") if uses_glob else ("glob", ())
    new = [line.replace("glob(", f"{glob}(") for line in lines]
    listed = setup.list_of("data_files")
    edits: tuple[Edit, ...] = ()
    if listed is not None:
        edits = appended(setup.source, listed, new)
    elif "data_files" not in setup.arguments and uses_glob:  # one problem adds the argument
        edits = argument(setup, f"data_files=[{', '.join(new)}]")
    text = enumerated([f"`{line}`" for line in new])
    also = ", with `from glob import glob`" if imports else ""
    hint = f"add {text}{also}" + ("; --fix does" if edits else "")
    return msgspec.structs.replace(problem, hint=hint, edits=(*imports, *edits) if edits else ())


def _place(setup: Setup, argument: str) -> Span:
    """Return where an argument of setup() is, or the call."""
    from idlc.checks.package.python_files import span_of

    node: ast.AST | None = setup.arguments.get(argument, setup.call)
    listed = setup.list_of(argument)
    if listed is not None and listed.elts:
        node = listed.elts[0]
    return span_of(setup.source, node) if node else Span(setup.source, 0, 0)


def _missing_packages(
    setup: Setup, package: str, keys: Sequence[str], folders: Mapping[str, bool]
) -> Iterator[Diagnostic]:
    """Yield the problem with generated packages that `packages` leaves out."""
    kinds = sorted({key.partition("/")[0] for key in keys})
    support = f"{package}._idlc"
    wanted = [package, *(f"{package}.{kind}" for kind in kinds), support]
    wanted += sorted(name for name in folders if name.startswith(f"{support}."))
    if "packages" not in setup.arguments:
        return
    parts = setup.items(setup.arguments["packages"])
    covered = set()
    for part in parts:
        text = setup.text(part.node) if part.is_element else None
        found = {text} if text else _covered(setup, part.node, wanted)
        if found is None:
            return
        covered |= found
    missing = [name for name in wanted if name not in covered]
    if missing:
        listed = enumerated([f"`{name}`" for name in missing])
        verb = "is" if len(missing) == 1 else "are"
        problem = codes.CLASSES_NOT_INSTALLED.at(
            _place(setup, "packages"),
            f"{listed} {verb} not among the `packages`: the classes of "
            "the interfaces are not installed",
        )
        yield _with_packages(problem, setup, package, folders)
    else:
        yield from _absent_folders(setup, package, keys, folders)


def _covered(setup: Setup, node: ast.expr, wanted: Sequence[str]) -> set[str] | None:
    """Return which packages a call of find_packages finds; `None` if that cannot be seen."""
    import ast

    from idlc.checks.package.setup_py import name_of_call

    call = setup.value(node)
    if not isinstance(call, ast.Call) or name_of_call(call) not in _FINDERS:
        return None
    given = dict(zip(("where", "exclude", "include"), call.args, strict=False))
    given |= {one.arg: one.value for one in call.keywords if one.arg}
    chosen = []
    for name in ("include", "exclude"):
        items = setup.items(given.get(name))
        texts = [setup.text(item.node) for item in items]
        if None in texts or not all(item.is_element for item in items):
            return None
        chosen.append([text for text in texts if text is not None])
    include, exclude = chosen
    return {
        one
        for one in wanted
        if any(fnmatchcase(one, pattern) for pattern in include or ["*"])
        and not any(fnmatchcase(one, pattern) for pattern in exclude)
    }


def _absent_folders(
    setup: Setup, package: str, keys: Sequence[str], folders: Mapping[str, bool]
) -> Iterator[Diagnostic]:
    """Yield the problem with packages that are listed and have no folder."""
    from idlc.checks.package.python_files import span_of

    if not setup.whole or "package_dir" in setup.arguments:
        return
    support = f"{package}._idlc"
    made = {f"{package}.{key.partition('/')[0]}" for key in keys} | ({package} if keys else set())
    for item in setup.items(setup.arguments.get("packages")):
        name = setup.text(item.node) if item.is_element else None
        if not name or name in made or name.replace("/", ".") in folders:
            continue
        if keys and support not in folders and f"{name}.".startswith(f"{support}."):
            continue  # the build makes it
        problem = codes.CLASSES_NOT_INSTALLED.at(
            span_of(setup.source, item.node),
            f"`packages` names `{name}`, and there is no folder `{name.replace('.', '/')}`",
        )
        yield _with_packages(problem, setup, package, folders)


def _with_packages(
    problem: Diagnostic, setup: Setup, package: str, folders: Mapping[str, bool]
) -> Diagnostic:
    """Return a problem with the edits after which `packages` is worked out by setuptools."""
    from idlc.checks.package.python_files import range_of
    from idlc.checks.package.setup_edits import appended, imported, quote_of

    node = setup.arguments["packages"]
    listed = setup.list_of("packages")
    names = [setup.text(item.node) for item in setup.items(node) if item.is_element]
    tops = {name for name, has_init in folders.items() if has_init and "." not in name}
    known = len(names) == len(setup.items(node)) and all(
        name and name.partition(".")[0] == package for name in names
    )
    edits: tuple[Edit, ...] = ()
    find, imports = imported(setup, "setuptools", "find_packages")
    call = _FIND.replace("find_packages", find)
    hint = f"write `packages={call}`"
    if setup.list_of("packages") is listed and "package_dir" not in setup.arguments:
        target = setup.value(node)
        if target is not None and (known or listed is None) and tops <= {package, "test"}:
            start, end = range_of(setup.source, target)
            text = call.replace("'", quote_of(setup.source, target))
            edits = (*imports, Edit(Span(setup.source, start, end), text))
        elif listed is not None:
            own = f"*{find}(include=['{package}', '{package}.*'])"
            edits = (*imports, *appended(setup.source, listed, [own]))
            hint = f"add `{own}` to `packages`"
    also = ", with `from setuptools import find_packages`" if imports else ""
    return msgspec.structs.replace(
        problem, hint=hint + also + ("; --fix does" if edits else ""), edits=edits
    )


def resource_marker(facts: Facts, _: Model, report: Report) -> None:
    """The package's marker is there and installed, without which `ros2 run` does not find it."""
    setup = _built_by_setup(facts)
    if setup is None:
        return
    if not facts.marker:
        report.add(
            codes.NO_RESOURCE_MARKER.at(
                facts.place,
                f"`resource/{facts.name}` is missing, the file by which ROS 2 finds the package",
                hint=f"create it: `mkdir -p resource && touch resource/{facts.name}`",
            )
        )
    elif setup.data_files is not None and _lacks(setup.data_files, f"{_INDEX}/packages", ()):
        problem = codes.NO_RESOURCE_MARKER.at(
            _place(setup, "data_files"), f"`resource/{facts.name}` is not among the `data_files`"
        )
        line = f"('{_INDEX}/packages', ['resource/{facts.name}'])"
        report.add(_with_data_files(problem, setup, [line]))


def entry_points(facts: Facts, _: Model, report: Report) -> None:
    """Each console script names a function that is there."""
    if facts.setup_py is None:
        return
    from idlc.checks.package.python_files import span_of

    setup = _read(facts.setup_py)
    elsewhere = bool({"package_dir", "py_modules"} & setup.arguments.keys())
    for text, node in setup.scripts:
        problem = _problem(text, facts, elsewhere=elsewhere)
        if problem:
            place = span_of(facts.setup_py, node)
            report.add(codes.BAD_ENTRY_POINT.at(place, problem[0], hint=problem[1]))


def _problem(text: str, facts: Facts, *, elsewhere: bool) -> tuple[str, str] | None:
    """Return what is wrong with an entry point, and a hint.

    `elsewhere` is whether modules may lie where they are not looked for.
    """
    from idlc.checks.package.python_files import defines

    script, equals, target = text.partition("=")
    module, colon, function = (part.strip() for part in target.partition(":"))
    if not equals or not colon or not function:
        what = f"`{text}` is not an entry point"
        return what, f"write `{script.strip() or 'NAME'} = {facts.name}.MODULE:main`"
    if elsewhere:
        return None
    if module.partition(".")[0] not in {name.partition(".")[0] for name in facts.modules}:
        return (
            f"there is no Python package `{module.partition('.')[0]}` here",
            f"it is `{facts.name}` by the package.xml",
        )
    source = facts.modules.get(module) or facts.modules.get(f"{module}.__init__")
    if source is None:
        return f"there is no module `{module}`", "name the file that holds the function"
    if not defines(source, function.partition(".")[0]):
        return f"`{source.path}` has no `{function}`", f"define it: `def {function}() -> None:`"
    return None


def names(facts: Facts, _: Model, report: Report) -> None:
    """setup.py and setup.cfg call the package what package.xml calls it."""
    setup = _read(facts.setup_py) if facts.setup_py else None
    found = setup.text(setup.arguments.get("name")) if setup else None
    if setup and found is not None and found.replace("-", "_") != facts.name:
        report.add(
            codes.NAME_MISMATCH.at(
                _place(setup, "name"),
                f"setup.py calls the package `{found}`, package.xml `{facts.name}`",
                hint="give both the same name",
            )
        )
    if facts.setup_cfg is None:
        return
    for line, start in zip(facts.setup_cfg.lines, facts.setup_cfg.line_starts, strict=False):
        key, equals, value = line.partition("=")
        folder = value.strip()
        script = key.strip().replace("-", "_") in ("script_dir", "install_scripts")
        if equals and script and "/lib/" in folder and not folder.endswith(f"/lib/{facts.name}"):
            at = start + line.index(folder)
            report.add(
                codes.NAME_MISMATCH.at(
                    Span(facts.setup_cfg, at, at + len(folder)),
                    f"`ros2 run` looks for scripts in `lib/{facts.name}`",
                    hint=f"write `$base/lib/{facts.name}`",
                )
            )


def current_output(facts: Facts, _: Model, report: Report) -> None:
    """Code that idlc generated here is made of the interfaces as they are now."""
    for output in facts.outputs:
        if output.package != facts.name or not facts.whole:
            continue
        changed = [
            f"`{name}` {_changed(output.inputs.get(name), facts.inputs.get(name))}"
            for name in sorted(output.inputs.keys() | facts.inputs.keys())
            if output.inputs.get(name) != facts.inputs.get(name)
        ]
        if changed:
            folder = facts.manifest.path.rpartition("/")[0] or "."
            words = ("gen", folder, "-o", output.path.rpartition("/")[0])
            report.add(
                codes.STALE_GENERATED_CODE.of(
                    output.path,
                    f"the generated code is out of date: {first_few(changed, 3)}",
                    hint=f"run `idlc {shlex.join(words)}`",
                )
            )


def _changed(before: str | None, now: str | None) -> str:
    return "was added" if before is None else "was removed" if now is None else "changed"
