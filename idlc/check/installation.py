"""Rules on setup.py and its neighbours: ROS 2 finds and runs the package that colcon built."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import PurePosixPath
from typing import NamedTuple

from idlc.check.outputs import dependencies, include_options, outdated, with_dependencies
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit, Report, enumerated, first_few
from idlc.diagnostics.source import Source, Span
from idlc.model.link import Model
from idlc.packaging import setup_edits
from idlc.packaging.facts import Facts
from idlc.packaging.layout import PackageLayout, layout
from idlc.packaging.setup_py import DataFiles, Setup, defines, range_of, span_of
from idlc.project.find import KINDS
from idlc.project.lock import BUILD_STEP, Runtime

_INDEX = "share/ament_index/resource_index"


_read = lru_cache(maxsize=16)(Setup)


class _Package(NamedTuple):
    """A package that a setup.py installs; `kinds` are those of its interfaces.

    `folders` are its folders by dotted name, and whether each has an `__init__.py`.
    """

    setup: Setup
    name: str
    kinds: Sequence[str]
    folders: Mapping[str, bool]
    runtime: Runtime = "carried"


def _built_by_setup(facts: Facts) -> Setup | None:
    """Return the parsed setup.py, if it builds the package."""
    is_python = facts.build_type == "ament_python"
    return _read(facts.setup_py) if facts.setup_py and is_python else None


def check_setup(
    setup: Source,
    package: str,
    keys: Mapping[str, str],
    folders: Mapping[str, bool],
    others: tuple[Source | None, Source | None] | None = None,
    runtime: Runtime = "carried",
) -> Report:
    """Return the problems that keep a setup.py from installing interfaces and their classes.

    `keys` are the interfaces as `kind/Name.kind` with their files, `folders` the package's folders
    by dotted name, and whether each has an `__init__.py`. `others` are setup.cfg and
    pyproject.toml; without these, only the arguments of setup() are judged.
    """
    report = Report()
    read = _read(setup)
    kinds = sorted({key.split("/")[0] for key in keys})
    mine = _Package(read, package, kinds, folders, runtime)
    report.extend(_missing_interfaces(mine, keys))
    report.extend(setup_edits.unusable_entry(read, package))
    view = layout(read, *(others or (None, None)), folders)
    if view and (others or "packages" in read.arguments):
        report.extend(_missing_packages(mine, view))
    report.extend(setup_edits.unnoticed_changes(read, view.folder(package) if view else package))
    return report


def _layout(facts: Facts, setup: Setup) -> PackageLayout | None:
    return layout(setup, facts.setup_cfg, facts.pyproject, facts.folders)


def installed(facts: Facts, model: Model) -> Iterator[Diagnostic]:
    """setup.py installs interfaces, their classes, and the libraries for C++ tools."""
    setup = _built_by_setup(facts)
    if setup is not None and model.own:
        names = sorted(interface.name.file for interface in model.own)
        keys = {name: facts.files.get(name, name) for name in names}
        others = (facts.setup_cfg, facts.pyproject)
        for problem in check_setup(
            setup.source, facts.name, keys, facts.folders, others, facts.runtime
        ):
            # the next `idlc gen` writes the file that setup.py should run
            is_early = problem.code == codes.STALE_GENERATED_CODE.id and not facts.has_build_step
            if not is_early:
                yield problem
    elif setup is not None and (view := _layout(facts, setup)):
        yield from _absent_folders(_Package(setup, facts.name, (), facts.folders), view)
    if setup is not None and facts.index is not None and facts.is_known:
        yield from _outdated_index(facts.index, facts.files.keys())


def _outdated_index(index: Source, present: AbstractSet[str]) -> Iterator[Diagnostic]:
    """Yield the problem with a list of interfaces that is not the package's."""
    lines = [line.strip() for line in index.text.splitlines()]
    listed = {line for line in lines if PurePosixPath(line).suffix in KINDS}
    if listed == present:
        return
    wrong = [*(f"omits `{key}`" for key in sorted(present - listed))]
    wrong += [f"lists `{key}`, which does not exist" for key in sorted(listed - present)]
    stems = {PurePosixPath(key).with_suffix("") for key in present}
    others = {line for line in lines if PurePosixPath(line).with_suffix("") in stems} - listed
    text = "".join(f"{line}\n" for line in sorted(present | others))
    yield codes.INTERFACES_NOT_INSTALLED.at(
        Span(index, 0, len(index.lines[0]) if lines else 0),
        f"this list for ROS 2's tools {first_few(wrong, 3)}",
        hint="write a line for each interface, or run `idlc check --fix`",
        edits=(Edit(Span(index, 0, len(index.text)), text),),
    )


def _missing_interfaces(package: _Package, keys: Mapping[str, str]) -> Iterator[Diagnostic]:
    """Yield the problem with interface files that `ros2 interface show` will not find."""
    setup, share = package.setup, f"share/{package.name}"
    entries = setup.data_files
    if entries is None:
        return
    missing = [kind for kind in package.kinds if _lacks(entries, f"{share}/{kind}", keys, kind)]
    index = _lacks(entries, f"{_INDEX}/rosidl_interfaces", ())
    if not missing and not index:
        return
    subjects = [f"the {enumerated([f'.{kind}' for kind in missing])} files"] if missing else []
    subjects += ["the index entry for the interfaces"] if index else []
    patterns = set()
    for key, file in keys.items():
        folder, kind = file.rpartition("/")[0], key.split("/")[0]
        is_plain = re.fullmatch(r"[\w./ -]+", folder)  # it becomes part of a program
        patterns.add(f"{folder if is_plain else kind}/*.{kind}")
    lines = [
        f"('{share}/{kind}', glob('{pattern}'))"
        for kind in missing
        for pattern in sorted(patterns)
        if pattern.endswith(f".{kind}")
    ]
    if index:
        lines.append(f"('{_INDEX}/rosidl_interfaces', glob('resource/rosidl_interfaces/*'))")
    message = f"{enumerated(subjects)} {'are' if missing else 'is'} not in `data_files`"
    yield _data_files_problem(codes.INTERFACES_NOT_INSTALLED, message, setup, lines, uses_glob=True)


def _lacks(entries: Sequence[DataFiles], folder: str, keys: Iterable[str], kind: str = "") -> bool:
    """Return whether entries certainly do not install files into a folder of the prefix."""
    names = [
        pattern.rpartition("/")[2]
        for entry in entries
        if entry.folder is None or entry.folder.rstrip("/") == folder
        for pattern in (("*",) if entry.files is None else entry.files)  # computed files may be any
    ]
    needed = [key.rpartition("/")[2] for key in keys if key.startswith(f"{kind}/")] or [""]
    # only the file's name is compared, because patterns for all files of a kind are usual
    return not all(any(not file or fnmatchcase(file, name) for name in names) for file in needed)


def _data_files_problem(
    code: codes.DiagnosticCode,
    message: str,
    setup: Setup,
    lines: Sequence[str],
    *,
    uses_glob: bool = False,
) -> Diagnostic:
    """Return a problem with the hint and the edits that add entries to `data_files`."""
    glob, imports = setup_edits.imported(setup, "glob", "glob") if uses_glob else ("glob", ())
    new = [line.replace("glob(", f"{glob}(") for line in lines]
    listed = setup.list_of("data_files")
    edits: tuple[Edit, ...] = ()
    if listed is not None:
        edits = setup_edits.append_elements(setup.source, listed, new)
    elif "data_files" not in setup.arguments and uses_glob:  # one problem adds the argument
        edits = setup_edits.argument(setup, f"data_files=[{', '.join(new)}]")
    text = enumerated([f"`{line}`" for line in new])
    also = ", with `from glob import glob`" if imports else ""
    return code.at(
        setup.place("data_files"),
        message,
        hint=f"add {text}{also}" + (", or run `idlc check --fix`" if edits else ""),
        edits=(*imports, *edits) if edits else (),
    )


def _missing_packages(package: _Package, view: PackageLayout) -> Iterator[Diagnostic]:
    """Yield the problem with generated packages that setuptools leaves out."""
    name = package.name
    if view.installed is None or any(root.startswith(f"{name}.") for root in view.roots):
        return
    support = f"{name}._idlc"
    needed = [name, *(f"{name}.{kind}" for kind in package.kinds)]
    needed += [support] if package.runtime == "carried" else []
    existing = view.packages(package.folders)
    vendored = [f"{name}._vendor", f"{name}.vendor"] if f"{name}._vendor" in existing else []
    inside = tuple(f"{generated}." for generated in (support, *vendored))
    needed += [*vendored, *sorted(other for other in existing if other.startswith(inside))]
    missing = [name for name in needed if not view.installed.covers(name, view.folder(name))]
    if not missing:
        yield from _absent_folders(package, view)
        return
    listed = enumerated([f"`{name}`" for name in missing])
    reason = f"{listed} {'is' if len(missing) == 1 else 'are'} not in `packages`"
    if view.installed.is_nothing:
        reason = "`packages` is not set, and setuptools does not choose among several folders"
    message = f"{reason}, so the build does not install the interface classes"
    yield _packages_problem(view.installed.place, message, package, view, missing)


def _absent_folders(package: _Package, view: PackageLayout) -> Iterator[Diagnostic]:
    """Yield the problem with packages that are listed and have no folder."""
    setup = package.setup
    if not setup.whole:
        return
    support = f"{package.name}._idlc"
    generated = {package.name, *(f"{package.name}.{kind}" for kind in package.kinds)}
    existing = view.packages(package.folders)
    for item in setup.items(setup.arguments.get("packages")):
        name = setup.text(item.node) if item.is_element else None
        if not name or name.replace("/", ".") in existing:
            continue
        is_support = support not in existing and f"{name}.".startswith(f"{support}.")
        if not (package.kinds and (is_support or name in generated)):  # or the build creates it
            # no edit: in another copy the folder may exist, as a submodule's does
            yield codes.CLASSES_NOT_INSTALLED.at(
                span_of(setup.source, item.node),
                f"`packages` names `{name}`, but `{view.folder(name)}` has no files",
                hint="remove the name, or create the folder; for a git submodule, run "
                "`git submodule update --init`",
            )


def _packages_problem(
    place: Span, message: str, package: _Package, view: PackageLayout, missing: Sequence[str]
) -> Diagnostic:
    """Return a problem with the edits that add `missing` to what setuptools installs.

    The edits keep every name and search that setup.py has.
    """
    setup, code, name = package.setup, codes.CLASSES_NOT_INSTALLED, package.name
    root = view.roots.get("", "").removesuffix(".")
    where = f"'{root}', " if root else ""
    if place.source is not setup.source:
        hint = _config_hint(place, name, view, missing)
        return code.at(place, message, hint=hint)
    find, imports = setup_edits.imported(setup, "setuptools", "find_packages")
    patterns = [f"'{name}'"] * (name in missing) + [f"'{name}.*'"]
    call = f"{find}({where}include=[{', '.join(patterns)}])"
    hint = f"add `*{call}` to `packages`"
    target = setup.value(setup.arguments.get("packages"))
    listed = setup.list_of("packages")
    edits: tuple[Edit, ...] = ()
    if "packages" not in setup.arguments:
        hint = f"write `packages={call}`"
        edits = setup_edits.argument(setup, f"packages={call}")
    elif not view.roots.keys() <= {""}:
        pass  # the search would have to begin in several folders
    elif listed is not None:
        edits = setup_edits.append_elements(setup.source, listed, [f"*{call}"])
    elif isinstance(target, ast.Call):
        hint = f"add `+ {call}` to `packages`"
        text = f" + {call}".replace("'", setup_edits.quote_of(setup.source, target))
        edits = (setup_edits.insertion(setup.source, range_of(setup.source, target)[1], text),)
    hint += ", with `from setuptools import find_packages`" if imports else ""
    hint += ", or run `idlc check --fix`" if edits else ""
    return code.at(place, message, hint=hint, edits=(*imports, *edits) if edits else ())


def _config_hint(place: Span, name: str, view: PackageLayout, missing: Sequence[str]) -> str:
    """Return what to write into a setup.cfg or pyproject.toml that omits packages."""
    root = view.roots.get("", "").removesuffix(".")
    if view.installed and view.installed.finders:
        return "change its `where`, `include` and `exclude` to match these packages"
    names = view.installed.names if view.installed else ()
    if place.source.path.endswith(".toml"):
        # setuptools takes every folder below `where` for a package, tests and sources, too
        own = f"{name.partition('.')[0]}*"
        include = [*(each for each in names if not fnmatchcase(each, own)), own]
        where = f'where = ["{root}"]' if root else f"include = {json.dumps(include)}"
        return f"write `packages.find = {{ {where} }}` in [tool.setuptools]"
    if names:
        return f"add {enumerated([f'`{each}`' for each in missing])} to this list"
    also = f", and `where = {root}` in [options.packages.find]" if root else ""
    return f"write `packages = find:`{also}"


def resource_marker(facts: Facts, _: Model) -> Iterator[Diagnostic]:
    """The package's marker, which `ros2 run` needs to find it, exists and is installed."""
    setup = _built_by_setup(facts)
    if setup is None:
        return
    if not facts.marker:
        message = f"`resource/{facts.name}` is missing; ROS 2 needs this file to find the package"
        hint = f"create it: `mkdir -p resource && touch resource/{facts.name}`"
        yield codes.NO_RESOURCE_MARKER.at(facts.place, message, hint=hint)
    else:
        yield from uninstalled_marker(setup, facts.name)


def uninstalled_marker(setup: Setup, package: str) -> Iterator[Diagnostic]:
    """Yield the problem of a setup.py that does not install the package's marker."""
    if setup.data_files is not None and _lacks(setup.data_files, f"{_INDEX}/packages", ()):
        message = f"`resource/{package}` is not in `data_files`"
        line = f"('{_INDEX}/packages', ['resource/{package}'])"
        yield _data_files_problem(codes.NO_RESOURCE_MARKER, message, setup, [line])


def entry_points(facts: Facts, _: Model) -> Iterator[Diagnostic]:
    """Each console script names an existing function."""
    if facts.setup_py is None:
        return
    setup = _read(facts.setup_py)
    view = _layout(facts, setup)
    elsewhere = view is None or bool(view.roots) or "py_modules" in setup.arguments
    tops = {name.partition(".")[0] for name in facts.modules}
    for text, node in setup.scripts:
        script, equals, target = text.partition("=")
        module, colon, function = (part.strip() for part in target.partition(":"))
        top = module.partition(".")[0]
        source = facts.modules.get(module) or facts.modules.get(f"{module}.__init__")
        if not equals or not colon or not function:
            message = f"`{text}` is not an entry point"
            hint = f"write `{script.strip() or 'NAME'} = {facts.name}.MODULE:main`"
        elif elsewhere:  # modules may be in folders that were not searched
            continue
        elif top not in tops:
            message = f"there is no Python package `{top}` here"
            hint = f"package.xml names it `{facts.name}`"
        elif source is None:
            message = f"there is no module `{module}`"
            hint = "write the name of the file that contains the function"
        elif not defines(source, function.partition(".")[0]):
            message = f"`{source.path}` does not define `{function}`"
            hint = f"add `def {function}() -> None:`"
        else:
            continue
        yield codes.BAD_ENTRY_POINT.at(span_of(facts.setup_py, node), message, hint=hint)


def names(facts: Facts, _: Model) -> Iterator[Diagnostic]:
    """setup.py and setup.cfg have the same package name as package.xml."""
    setup = _read(facts.setup_py) if facts.setup_py else None
    name = setup.text(setup.arguments.get("name")) if setup else None
    if setup and name is not None and name.replace("-", "_") != facts.name:
        message = f"setup.py names the package `{name}`, but package.xml names it `{facts.name}`"
        hint = "use the same name in both files"
        yield codes.NAME_MISMATCH.at(setup.place("name"), message, hint=hint)
    if facts.setup_cfg is None:
        return
    for line, start in zip(facts.setup_cfg.lines, facts.setup_cfg.line_starts, strict=False):
        key, equals, value = line.partition("=")
        folder = value.strip()
        script = key.strip().replace("-", "_") in ("script_dir", "install_scripts")
        if equals and script and "/lib/" in folder and not folder.endswith(f"/lib/{facts.name}"):
            at = start + line.index(folder)
            span = Span(facts.setup_cfg, at, at + len(folder))
            message = f"`ros2 run` searches for scripts in `lib/{facts.name}`"
            yield codes.NAME_MISMATCH.at(span, message, hint=f"write `$base/lib/{facts.name}`")


def current_output(facts: Facts, model: Model) -> Iterator[Diagnostic]:
    """Generated code in the package matches the current interfaces."""
    for output in facts.outputs:
        folder = facts.manifest.path.rpartition("/")[0] or "."
        home = output.path.rpartition("/")[0]
        if output.package == facts.name and facts.is_known and not facts.files:
            # where a setup.py runs idlc's build step, the interfaces were in this package
            if facts.has_build_step and output.inputs:
                message = "the interfaces of the generated code are gone"
                hint = f"remove `idlc.lock` and the other generated files from `{home}`, "
                hint += f"except `{BUILD_STEP}`, which the build runs"
                yield codes.STALE_GENERATED_CODE.of(output.path, message, hint=hint)
        elif output.package == facts.name and facts.whole:
            words = ("gen", folder, "-o", home, *include_options(model, facts.include))
            recorded, used = output.dependencies, dependencies(model)
            before = with_dependencies(output.inputs, recorded, used)
            now = with_dependencies(facts.inputs, used, recorded)
            project = None if facts.setup_py else facts.pyproject
            yield from outdated(output.path, before, now, words, project)
