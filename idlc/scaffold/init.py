"""The pipeline of `idlc init`: the changes after which a folder's interfaces are compiled.

Each part is made by the code of `idlc scaffold` and `idlc check --fix`. Nothing is written before
all changes to a package are known.
"""

from __future__ import annotations

import ast
import json
import os
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import Any, NamedTuple

from idlc.check.installation import check_setup, uninstalled_marker
from idlc.check.select import selection
from idlc.compiler.compiler import models_of, stage
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError, apply
from idlc.diagnostics.source import Source, Span
from idlc.generate.package import NUMPY, Generated
from idlc.generate.python.fields import number_info
from idlc.generate.templates import code
from idlc.model import catalog, derive, ir
from idlc.model.link import Model
from idlc.packaging import dependencies
from idlc.packaging.facts import folders
from idlc.packaging.files import (
    CMAKE_LISTS,
    SETUP_CFG,
    SETUP_FILES,
    SETUP_PY,
    Edited,
    Outcome,
    Refused,
    SetupCfg,
)
from idlc.packaging.layout import layout
from idlc.packaging.setup_edits import KEYWORD, append_element, step_before_setup
from idlc.packaging.setup_py import BOM, Setup
from idlc.project import git
from idlc.project.files import entries, is_file, is_folder, read_bytes
from idlc.project.find import list_files, no_interfaces
from idlc.project.inputs import Inputs, packages
from idlc.project.lock import BUILD_STEP, Tree
from idlc.project.package_xml import declared_name
from idlc.project.prefixes import INDEX
from idlc.project.root import MANIFEST, Root
from idlc.project.settings import SETTINGS_FILE, load_settings, scope, toml
from idlc.scaffold.changes import Project, ScaffoldOptions, ScaffoldResult, marked
from idlc.scaffold.interface import implied_packages, starter
from idlc.scaffold.layouts import Layout, package_of, tool_of
from idlc.scaffold.package import LICENSES, Package, package_files
from idlc.scaffold.proof import GENERATED
from idlc.tasks.check import check_all, checkers
from idlc.tasks.gen import GenOptions, gen, in_package, with_settings

#: The folder of generated classes in a library.
_ROS = "ros"
#: What a review can leave out of the generated files.
_REVIEWED_ELSEWHERE = (
    *("_idlc/**", "_vendor/**", "_idlc_build.py", "_type_data.py"),
    *("*/_*__codec.py", "idlc.lock"),
)
#: The settings by which build backends run a file of the project.
_HOOKS = {
    "hatchling": ("tool.hatch.build.hooks.custom", "path"),
    "pdm": ("tool.pdm.build", "custom-hook"),
}
_PLAIN_SETUP = "from setuptools import setup\n\nsetup()\n"
_SETUP_TEXT = _PLAIN_SETUP.replace("()", f"({KEYWORD}=True)")
#: The file of each service at the top of a repository, and its template.
SERVICES = {
    "github": (".github/workflows/interfaces.yml", "ci/github.yml.jinja"),
    "gitlab": (".gitlab-ci.yml", "ci/gitlab.yml.jinja"),
    "pre-commit": (".pre-commit-config.yaml", "ci/pre_commit.yaml.jinja"),
}
#: A revision that pre-commit warns of, and each revision.
_MOVING, _REVISION = "rev: HEAD", re.compile(r"(?m)^ *rev: .*$")
#: Commands by which a repository gets idlc's wheel and action from a clone beside it.
_WHEEL = "python3 -I -m pip wheel --no-deps --wheel-dir wheels ../idlc"
_ACTION = (
    "mkdir -p tools/idlc && git -C ../idlc archive HEAD action.yml .ci README.md LICENSE "
    "pyproject.toml idlc templates | tar -x -C tools/idlc"
)
#: Edits of setup.py make room for others.
_ROUNDS = 3
#: The package of a field's type.
_USED = re.compile(r"(?m)^[ \t]*([a-z][a-z0-9_]*)/[A-Z]")
#: A requirement of builds that compile the interfaces.
_IDLC = re.compile(r"idlc(?![\w.-])")
_BUILD_SYSTEM = '[build-system]\nrequires = ["setuptools"]\nbuild-backend = '
_BUILD_SYSTEM += '"setuptools.build_meta"\n'
#: The start of a list in VS Code's extensions.json, up to its first element.
_RECOMMENDED = re.compile(r'[^/]*"recommendations"\s*:\s*\[(\s*)(?=["\]])')


class Draft:
    """The files of a package as `idlc init` leaves them, with the reason for each change."""

    def __init__(self, project: Project) -> None:
        self.project = project
        self.path = project.path
        self.reasons: dict[str, str] = {}
        self._texts: dict[str, str] = {}
        self._before: dict[str, str | None] = {}

    def text(self, path: str) -> str | None:
        """Return a file's text as it will be, `None` without one."""
        return self._texts[path] if path in self._texts else self.project.text(path)

    def put(self, path: str, outcome: Outcome | str, reason: str) -> None:
        """Give a file its text, which may be what it has; a refusal is reported."""
        outcome = Edited(outcome) if isinstance(outcome, str) else outcome
        with suppress(ReportedError):  # so that a plan reports all refusals
            text = self.project.accepted({path: outcome})[path]
            if text != self.text(path):
                self._before.setdefault(path, self.project.text(path))
                self._texts[path] = text
                self.reasons.setdefault(path, reason)

    def _source(self, path: str) -> Source | None:
        """Return a file as it will be, with its name for reports."""
        text = self.text(path)
        return None if text is None else Source(path, text)

    def configs(self) -> tuple[Source | None, Source | None]:
        """Return setup.cfg and pyproject.toml."""
        return self._source(SETUP_CFG), self._source(SETTINGS_FILE)

    def root(self) -> Root:
        """Return a root that sees the changes."""
        files = Tree(self.path)
        texts = {}
        for path, text in self._texts.items():
            old = files.read(path)
            texts[self.path / path] = marked(text, old if isinstance(old, bytes) else b"")
        return Root(self.path, texts)

    def write(self, report: Report, *, dry_run: bool = False) -> ScaffoldResult:
        """Write all files or none, or only show the changes. Raises ReportedError.

        Reports IDL612 for a file that was edited since the changes were planned.
        """
        settings = ScaffoldOptions(Root(self.path), dry_run=dry_run)
        project = Project(".", settings, report, self.project.package)
        for path, before in self._before.items():
            if project.text(path) != before:
                message = f"`{path}` was changed while idlc was running"
                report.add(codes.CANNOT_WRITE.of(path, message, hint="run it again"))
        report.raise_errors()
        new = {path: text for path, text in self._texts.items() if not project.has(path)}
        return project.write(new, {p: text for p, text in self._texts.items() if p not in new})


class Preparation(NamedTuple):
    """The planned changes to one package; `classes` are the generated ones, in the folder `out`.

    `notes` are on what idlc cannot see or prevent. Where `is_packed` is false, a report said by
    which line of yours the build takes the classes.
    """

    layout: Layout
    draft: Draft
    out: str
    classes: tuple[str, ...]
    notes: tuple[str, ...] = ()
    is_packed: bool = True

    def source(self) -> Path:
        """Return the folder from which the generated code is imported as it is."""
        parts = len(PurePosixPath(self.classes[0].replace(".", "/")).parts) - 2
        return (self.layout.folder / self.out).parents[parts - 1]

    def compares(self) -> bool:
        """Return whether `idlc breaking` knows what to compare with."""
        return bool(load_settings(Root(self.layout.folder), Report()).breaking)


def siblings(layout: Layout) -> dict[str, Path]:
    """Return the folders of the packages with interfaces around a package, by name.

    These are the packages of its repository, and those beside it or beside the repository.
    """
    top = git.repository_of(layout.folder)
    above = {layout.folder.parent, *((top.parent,) if top else ())}
    places = {path for folder in above for path in entries(folder) if is_file(path / MANIFEST)}
    if top and top != layout.folder:
        places.update(list_files((".",), Root(top), Report()).packages)
    found: dict[str, Path] = {}
    for place in sorted(places - {layout.folder}):
        name = declared_name(place / MANIFEST, Root(place), Report())
        if name and any(is_folder(place / kind) for kind in ir.KINDS):
            found.setdefault(name, place)
    return found


def _included(inner: Root, paths: Sequence[str], around: Mapping[str, Path]) -> list[str]:
    """Return the folders of siblings whose messages a package uses, directly or through others."""
    needed: dict[str, Path] = {}
    waiting = [file.path for file in list_files(paths, inner, Report()).files]
    while waiting:
        source = inner.read_source(waiting.pop(), "", Report())
        for package in _USED.findall(source.text if source else ""):
            if package in around and package not in needed and not catalog.is_standard(package):
                needed[package] = around[package]
                files = list_files((str(around[package]),), inner, Report()).files
                waiting += [file.path for file in files]
    return sorted(
        Path(os.path.relpath(folder, inner.base)).as_posix() for folder in needed.values()
    )


def prepare(
    layout: Layout,
    settings: ScaffoldOptions,
    report: Report,
    around: Mapping[str, Path] = MappingProxyType({}),
) -> Preparation:
    """Plan the changes to the package of a root. Raises ReportedError.

    `around` are the folders of other packages by name, which may define types that it uses.
    """
    draft = Draft(Project(".", settings, report, layout.name))
    if layout.kind == "empty":
        _new_package(layout, draft)
    config = load_settings(draft.root(), report)
    report.raise_errors()
    # settings of a folder around this one are for other packages
    chosen = _Chosen()
    if config.folder == layout.folder:
        chosen = _Chosen(config.paths, config.out, is_present=True)
    out = _output_folder(layout, chosen)
    if not _is_below(layout.folder, out):
        message = f"the folder for the classes is outside this folder: `{out}`"
        hint = "set `out` in [tool.idlc] to a folder below it, then run `idlc init` again"
        raise report.refused(codes.BAD_CONFIG.of(SETTINGS_FILE, message, hint=hint))
    paths = [path for path in chosen.paths if is_folder(layout.folder / path)] or ["."]
    places = _places(draft, layout, paths, chosen.paths, report)
    if places:
        included = [] if config.include else _included(settings.root, paths, around)
        plain = {} if _is_set(draft, layout, chosen) else {"paths": places, "out": out}
        _settings(draft, layout, plain, included)
    inputs, model = _compiled(draft.root(), layout, paths, report)
    notes = _built(draft, layout, inputs, model, out, report)
    _ignored(draft, layout, out)
    with suppress(ReportedError):  # which reports links and others that are in the way
        draft.write(report, dry_run=True)
    _in_the_way(layout.folder, out, {name.kind for name in inputs.names}, report)
    module = module_of(out) if layout.kind == "library" else layout.name
    classes = tuple(f"{module}.{name.kind}.{name.name}" for name in sorted(inputs.names))
    is_packed = all(problem.code != codes.CLASSES_NOT_INSTALLED.id for problem in report)
    report.raise_errors()
    return Preparation(layout, draft, out, classes, notes, is_packed)


class _Chosen(NamedTuple):
    """The paths of interfaces and the folder of classes in the package's own settings."""

    paths: tuple[str, ...] = ()
    out: str = ""
    is_present: bool = False


def _is_set(draft: Draft, layout: Layout, chosen: _Chosen) -> bool:
    """Return whether `idlc gen` needs no more settings than there are."""
    if chosen.paths and chosen.out:
        return True
    has_table = chosen.is_present and "[tool.idlc]" in (draft.text(SETTINGS_FILE) or "")
    return has_table and layout.kind == "ament_python"


def _output_folder(layout: Layout, chosen: _Chosen) -> str:
    """Return the folder for the classes; a library gets a new one in its package."""
    if chosen.out:
        return chosen.out
    if layout.kind == "library":
        return f"{layout.home}/{_free(layout.folder / layout.home)}"
    return layout.home


def _is_below(folder: Path, path: str) -> bool:
    """Return whether a path stays in a folder, also where links lead."""
    real = Path(os.path.realpath(folder / path))
    return ".." not in PurePosixPath(path).parts and real.is_relative_to(os.path.realpath(folder))


def _compiled(
    root: Root, layout: Layout, paths: Sequence[str], report: Report
) -> tuple[Inputs, Model]:
    """Return the package with its model. Raises ReportedError, also without interfaces."""
    where = scope(load_settings(root, report))
    found = list_files(paths, root, report, where.exclude)
    report.raise_errors()
    read = packages(found.files, where, report)
    inner = [each for each in read if each.home != layout.folder and root.manifest(each.home)]
    for each in inner:  # its classes would become part of this package
        place = root.shown(each.home)
        message = f"`{place}` in this folder is another package"
        hint = f"move it next to this one, or write `exclude = {json.dumps([place])}` in "
        hint += "[tool.idlc], then run `idlc init` again"
        report.add(codes.CANNOT_EDIT.of(place, message, hint=hint))
    problems = Report()
    compiled = [*models_of(read, where, problems)] if read else []
    report.extend(problems.errors)  # `idlc check` shows the others
    report.raise_errors()
    if not compiled:
        raise ReportedError
    return next((each for each in compiled if each[0].package == layout.name), compiled[0])


def _built(
    draft: Draft, layout: Layout, inputs: Inputs, model: Model, out: str, report: Report
) -> tuple[str, ...]:
    """Have the package's build install interfaces and classes; return notes."""
    root, note, more, typed = draft.root(), "", "", ""
    files = {entry.file.key: root.shown(entry.file.path) for entry in inputs.files}
    if layout.kind in ("ament_python", "empty"):
        note = _ament_python(draft, layout, model, files, report)
    elif layout.kind == "ament_cmake":
        _ament_cmake(draft, inputs, report)
    elif layout.backend.startswith("setuptools."):
        _setuptools(draft, out, files, report)
    if layout.kind == "library" and _has_arrays(model):
        note = _numpy(draft)
    marker = f"{layout.home}/py.typed"
    if layout.kind == "library" and not is_file(layout.folder / marker):
        command = f"touch {shlex.quote(marker)}"
        typed = f"type checkers of the library's users read its types after `{command}`"
    if layout.kind != "ament_cmake":
        more = _outdated_builds(draft, layout, out)
    return tuple(filter(None, (note, more, typed)))


def _places(
    draft: Draft, layout: Layout, paths: Sequence[str], chosen: Sequence[str], report: Report
) -> list[str]:
    """Return the folders of the interfaces; a package that has none gets an example.

    `chosen` are those that the settings name, `paths` the folders in which to look.
    """
    root = draft.root()
    exclude = scope(load_settings(root, Report())).exclude
    files = list_files(paths, root, Report(), exclude).files
    named = PurePosixPath(chosen[0] if chosen else ".")
    if not files and (layout.kind == "ament_cmake" or named.is_absolute() or ".." in named.parts):
        report.add(no_interfaces(named.as_posix(), root))
        return []
    if not files:
        path, text = starter("Example")
        place = "" if layout.kind != "library" else f"{layout.home}/interfaces"
        if place.startswith("src/"):  # beside a library, setuptools would take it for a package
            place = "interfaces"
        path = ((named if chosen else PurePosixPath(place)) / path).as_posix()
        draft.put(path, text, "an example; replace it with your own interface")
        files = list_files(["."], draft.root(), Report(), exclude).files
    if layout.kind != "library":
        return ["."]
    return sorted({"." if file.root == root.base else root.shown(file.root) for file in files})


def _in_the_way(folder: Path, out: str, kinds: Iterable[str], report: Report) -> None:
    """Report modules of the user in whose place the classes would be."""
    for kind in sorted(kinds):
        for place in (f"{out}/{kind}.py", f"{out}/{kind}/__init__.py"):
            data = read_bytes(folder / place, place, report) if is_file(folder / place) else None
            if data is not None and not data.startswith(GENERATED):
                module = module_of(place.partition("/__init__")[0].removesuffix(".py"))
                message = f"`{place}` already exists, but idlc generates the module `{module}`"
                hint = "move its code to a module with another name, then run `idlc init` again"
                report.add(codes.FOREIGN_FILE.of(place, message, hint=hint))


def _free(home: Path) -> str:
    """Return a name that nothing in a folder has, or that idlc's own package there has."""
    names = (f"{_ROS}{end}" for end in ("", "_types", "_classes"))
    free = (n for n in names if (home / n / "idlc.lock").exists() or not os.path.lexists(home / n))
    return next(free, _ROS)


def _new_package(layout: Layout, draft: Draft) -> None:
    """Add the files of `idlc scaffold package`."""
    name, here = layout.name, layout.folder
    maintainer = git.setting("user.name", here) or "Your Name"
    email = git.setting("user.email", here) or "you@example.com"
    package = Package(name, f"The package {name}.", maintainer, email, LICENSES[0])
    with stage("scaffold", name):
        for path, text in package_files(package).items():
            if not draft.project.has(path):
                draft.put(path, text, "every new package contains this file")


def _settings(
    draft: Draft, layout: Layout, plain: Mapping[str, object], included: Sequence[str]
) -> None:
    """Add `[tool.idlc]`, by which commands need no words in the folder.

    A folder that has settings lacks at most those for the packages to include.
    """
    table = {**plain, **({"include": included} if included else {})}
    if plain and layout.kind == "library":
        table = {**table, "package": package_of(layout.name), "vendor-deps": True}
    for revision in ("origin/HEAD", "HEAD") if plain else ():
        if "breaking" not in table and git.commit(revision, layout.folder):
            table["breaking"] = {"against": f"git:{revision}"}
    if not table:
        return
    text = draft.text(SETTINGS_FILE)
    reason = "`idlc gen`, `check`, `fmt` and `breaking` need no arguments here"
    start = _BUILD_SYSTEM if text is None and layout.kind == "ament_python" else ""
    draft.put(SETTINGS_FILE, add_table(text or start, table), reason)


def add_table(text: str, table: Mapping[str, Any]) -> Outcome:
    """Return a pyproject.toml with `[tool.idlc]` at its end, or with the settings that it lacks."""
    ending = "\r\n" if "\r\n" in text else "\n"
    why, old = "idlc cannot extend its `tool` table", {}
    with suppress(ValueError):
        old = toml(text)
    tool = old.get("tool", {})
    present = tool.get("idlc", {}) if isinstance(tool, dict) else {}
    missing = {key: each for key, each in table.items() if key not in present}
    plain = {key: each for key, each in missing.items() if not isinstance(each, dict)}
    tables = {f"[tool.idlc.{key}]": missing[key] for key in missing.keys() - plain.keys()}
    new = text if not text or text.endswith("\n") else f"{text}{ending}"
    shown = ""
    for header, values in {"[tool.idlc]": plain, **tables}.items():
        # JSON's strings, lists and switches are TOML's
        lines = [f"{key} = {json.dumps(each)}" for key, each in values.items()]
        shown += "\n".join((header, *lines, ""))
        new = _with_values(new, header, lines, ending)
    with suppress(ValueError, TypeError):
        if toml(new) == {**old, "tool": {**tool, "idlc": {**present, **missing}}}:
            return Edited(new)
    where = "to its end, and write the values in `tool` below headers such as `[tool.idlc]`"
    return Refused(why, shown.rstrip(), where)


def _with_values(text: str, header: str, lines: Sequence[str], ending: str) -> str:
    """Return a TOML text with lines below a header, which is at its end if there was none."""
    block = ending.join((*lines, ""))
    at = re.search(rf"(?m)^{re.escape(header)}[ \t]*(?:#.*)?\r?\n", text)
    if at:
        return f"{text[: at.end()]}{block}{text[at.end() :]}"
    return f"{text}{ending if text.strip() else ''}{header}{ending}{block}"


def _ament_python(
    draft: Draft, layout: Layout, model: Model, files: Mapping[str, str], report: Report
) -> str:
    """Wire interfaces into setup.py and package.xml; return what idlc cannot see."""
    name = layout.name
    manifest = draft.text(MANIFEST) or ""
    edited = dependencies.add_dependencies(manifest, depends=implied_packages(model), group=True)
    draft.put(
        MANIFEST, edited, "the package has interfaces, and depends on the packages that they use"
    )
    if not layout.backend.startswith("setuptools."):
        tool = tool_of(layout.backend)
        return (
            f"{tool} builds the package, so idlc writes no {SETUP_PY}; for ROS 2's tools, have "
            f"{tool} install the interfaces into `share/{name}`, and a file that lists them as "
            f"`{INDEX}/rosidl_interfaces/{name}`"
        )
    marker = f"resource/{name}"
    if draft.text(marker) is None:
        draft.put(marker, "", "ROS 2 finds the package by this file")
    index = f"resource/rosidl_interfaces/{name}"
    listed = "".join(f"{key}\n" for key in sorted(files))
    draft.put(index, listed, "ROS 2 tools find the interfaces by this file")
    return _setup(draft, name, files, report)


def _is_named(cfg: Source | None, pyproject: Source | None) -> bool:
    """Return whether setup.cfg or pyproject.toml has the name of the distribution."""
    with suppress(ValueError):
        if cfg and SetupCfg(cfg.text).has("metadata", "name"):
            return True
    with suppress(ValueError):
        project = toml(pyproject.text).get("project") if pyproject else None
        return isinstance(project, dict) and "name" in project
    return False


def _setup(draft: Draft, name: str, files: Mapping[str, str], report: Report) -> str:
    """Have setup.py compile and install the interfaces; return what idlc cannot see."""
    text, others = draft.text(SETUP_PY), draft.configs()
    whole = _SETUP_TEXT.replace("(", f"(name='{name}', ")
    if text is None:
        text = _SETUP_TEXT if _is_named(*others) else whole
    try:
        ast.parse(text.removeprefix(BOM))
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        message = f"cannot edit `{SETUP_PY}`: {getattr(error, 'msg', 'it is nested too deeply')}"
        place = _place(Source(SETUP_PY, text), error)
        hint = "fix it, then run `idlc init` again"
        report.add(codes.CANNOT_EDIT.at(place, message, hint=hint))
        return ""
    existing, problems = folders(draft.path), Report()
    for _ in range(_ROUNDS):
        source = Source(SETUP_PY, text)
        problems = check_setup(source, name, files, existing, others)
        problems.extend(uninstalled_marker(Setup(source), name))
        new = apply(text, (edit for problem in problems for edit in problem.edits))[0]
        if new == text:
            break
        text = new
    setup = Setup(Source(SETUP_PY, text))
    outcome = _with_keyword(setup, whole)
    if isinstance(outcome, Edited) and outcome.text != text:
        edited = Source(SETUP_PY, outcome.text)
        again = check_setup(edited, name, files, existing, others)
        steps = (edit for problem in again for edit in problem.edits)
        outcome = Edited(apply(edited.text, steps)[0])
    draft.put(SETUP_PY, outcome, "builds compile the interfaces and install their classes")
    report.extend(problem for problem in problems if not problem.edits)
    view = layout(setup, *others, existing)
    if view is not None and view.installed is not None:
        return ""
    note = f"idlc does not run {SETUP_PY}, which computes `packages`; a build with idlc adds the "
    note += "generated packages; for builds without idlc, write "
    note += (
        f"`packages=find_packages(exclude=['test', 'test.*'])`, or add `{name}` and its subpackages"
    )
    return note


def _with_keyword(setup: Setup, whole: str) -> Outcome:
    """Return a setup.py whose call has the keyword; `whole` is the text of one without a call."""
    passed = {keyword.arg for call in setup.calls for keyword in call.keywords}
    if KEYWORD in setup.arguments or KEYWORD in passed:
        return Edited(setup.source.text)
    if setup.call is not None:
        edits = append_element(setup.source, setup.call, f"{KEYWORD}=True")
        return Edited(apply(setup.source.text, edits)[0])
    if setup.calls:
        why = f"there are {len(setup.calls)} calls of setup()"
        return Refused(why, f"{KEYWORD}=True,", "to the arguments of each")
    return Refused("there are no calls of setup()", whole.rstrip(), "to its end")


def _ament_cmake(draft: Draft, inputs: Inputs, report: Report) -> None:
    """Fix package.xml and CMakeLists.txt as `idlc check --fix` does; report why no build works."""
    reasons = {
        MANIFEST: "the package declares the packages that its interfaces use",
        CMAKE_LISTS: "rosidl receives each interface and the packages that it uses",
    }
    for _ in range(_ROUNDS):
        root = draft.root()
        config = load_settings(root, Report())
        chosen = selection(config, Report())
        problems, _models = check_all(checkers([inputs], scope(config)), [inputs], chosen)
        edits = [edit for problem in problems for edit in problem.edits]
        edits = [edit for edit in edits if edit.span.source.path in reasons]
        for path, reason in reasons.items():
            own = [edit for edit in edits if edit.span.source.path == path]
            if own:
                draft.put(path, apply(own[0].span.source.text, own)[0], reason)
        if not edits:
            break
    report.extend(each for each in problems if each.code == codes.CANNOT_BUILD.id)


def _place(source: Source, error: BaseException) -> Span:
    """Return the range of a syntax error, or the start of the file."""
    line, column = getattr(error, "lineno", None) or 1, getattr(error, "offset", None) or 1
    starts = source.line_starts
    at = min(starts[min(line, len(starts)) - 1] + column - 1, len(source.text))
    return Span(source, at, min(at + 1, len(source.text)))


def _setuptools(draft: Draft, out: str, files: Mapping[str, str], report: Report) -> None:
    """Have setuptools pack the classes, where its configuration would leave them out."""
    text = draft.text(SETUP_PY)
    source = Source(SETUP_PY, _PLAIN_SETUP if text is None else text)
    every = check_setup(source, module_of(out), files, folders(draft.path), draft.configs())
    problems = [each for each in every if each.code == codes.CLASSES_NOT_INSTALLED.id]
    if text is not None:
        edits = (edit for problem in problems for edit in problem.edits)
        reason = "the wheel contains the classes of the interfaces"
        draft.put(SETUP_PY, apply(text, edits)[0], reason)
    for problem in problems:
        if text is None and problem.span is not None and problem.span.source is source:
            top = out.partition("/")[0]
            find = f'include = ["{top}*"]' if top != "src" else 'where = ["src"]'
            hint = f"write `packages.find = {{ {find} }}` in [tool.setuptools]"
            code = codes.CLASSES_NOT_INSTALLED
            report.add(code.of(SETTINGS_FILE, problem.message, hint=hint))
        elif text is None or not problem.edits:
            report.add(problem)


def _outdated_builds(draft: Draft, layout: Layout, out: str) -> str:
    """Have the build stop at outdated classes; return a note if its tool runs nothing for that."""
    text = draft.text(SETTINGS_FILE) or ""
    system = toml(text).get("build-system", {})
    requires = system.get("requires", ()) if isinstance(system, dict) else ()
    if any(_IDLC.match(str(name)) for name in requires):
        return ""
    tool, step = tool_of(layout.backend), f"{out}/{BUILD_STEP}"
    reason = "the build stops if `idlc gen` was not run after a change"
    if tool == "setuptools" and layout.kind != "library":
        return ""  # setup.py stops the build
    if tool == "setuptools":
        own = draft.text(SETUP_PY)
        setup = Setup(Source(SETUP_PY, own or f"# mypy: ignore-errors\n{_PLAIN_SETUP}"))
        edits = step_before_setup(setup, out, is_library=True)
        if edits and step not in setup.source.text:
            edited = apply(setup.source.text, edits)[0]
            draft.put(SETUP_PY, edited if own else edited.replace("'", '"'), reason)
    elif tool in _HOOKS and (new := _with_setting(text, *_HOOKS[tool], step)):
        draft.put(SETTINGS_FILE, new, reason)
    if any(step in (draft.text(path) or "") for path in (SETUP_PY, SETTINGS_FILE)):
        return ""
    return (
        f"{tool} installs the classes that the last `idlc gen` wrote, even if the interfaces have "
        "changed since: run `idlc gen --check` before you build a wheel"
    )


def _with_setting(text: str, table: str, key: str, value: str) -> str:
    """Return a pyproject.toml with one more setting; empty if it has another value already."""
    ending = "\r\n" if "\r\n" in text else "\n"
    new = _with_values(text, f"[{table}]", [f"{key} = {json.dumps(value)}"], ending)
    with suppress(ValueError, AttributeError, TypeError):
        wanted = toml(text)
        place = wanted
        for part in table.split("."):
            place = place.setdefault(part, {})
        place[key] = value
        return new if toml(new) == wanted else ""
    return ""


def _has_arrays(model: Model) -> bool:
    """Return whether the classes need numpy: they have numeric arrays of a fixed size."""
    sections = (section for each in model.interfaces.values() for section in derive.sections(each))
    types = (field.type for section in sections for field in section.fields)
    return any(isinstance(type_, ir.Array) and number_info(type_) for type_ in types)


def _numpy(draft: Draft) -> str:
    """Have a library depend on numpy; return a note where idlc does not see its dependencies."""
    text, reason = draft.text(SETTINGS_FILE) or "", "the classes have arrays, which need numpy"
    old = toml(text)
    project = table if isinstance(table := old.get("project"), dict) else {}
    names = value if isinstance(value := project.get("dependencies"), list) else []
    if any(NUMPY.match(str(name)) for name in names):
        return ""
    head = r"(?m)^\[project\][ \t]*(?:#.*)?(\r?\n)"
    if "dependencies" in project:
        head += r"(?:(?!\[).*\n)*?dependencies[ \t]*=[ \t]*\[(\s*)"
    if match := re.search(head, text):
        blank = match[2] or " " if names else ""
        added = f'"numpy",{blank}' if match.re.groups > 1 else f'dependencies = ["numpy"]{match[1]}'
        new = f"{text[: match.end()]}{added}{text[match.end() :]}"
        wanted = {**old, "project": {**project, "dependencies": ["numpy", *names]}}
        with suppress(ValueError, TypeError):
            if toml(new) == wanted and "dependencies" not in project.get("dynamic", ()):
                draft.put(SETTINGS_FILE, new, reason)
                return ""
    elsewhere = (draft.text(path) or "" for path in SETUP_FILES)
    return (
        "" if "numpy" in "".join(elsewhere) else f"{reason}: add it to the library's dependencies"
    )


def module_of(out: str) -> str:
    """Return the name by which the package in a folder of a library is imported."""
    return ".".join(PurePosixPath(out.removeprefix("src/")).parts)


def _ignored(draft: Draft, layout: Layout, out: str) -> None:
    """Keep what builds write out of version control, and generated code out of reviews."""
    ignored = draft.text(".gitignore")
    if layout.kind == "ament_cmake":
        names = {line.strip().strip("/") for line in (ignored or "").splitlines()}
        if not names & {"build", "build*", "*"}:
            draft.put(
                ".gitignore", _with_lines(ignored, ["build/"]), "`idlc gen` writes into build/"
            )
        return
    lines = [f"{out}/{pattern} linguist-generated" for pattern in _REVIEWED_ELSEWHERE]
    if layout.kind != "library":
        del lines[1]
    step = f"{out}/{BUILD_STEP}"
    if not any(step in (draft.text(path) or "") for path in (SETUP_PY, SETTINGS_FILE)):
        lines = [line for line in lines if step not in line]
    attributes = draft.text(".gitattributes")
    reason = "reviews hide generated code"
    draft.put(".gitattributes", _with_lines(attributes, lines), reason)


def _with_lines(text: str | None, lines: Iterable[str]) -> str:
    """Return a text with the lines that it lacks at its end."""
    text = text or ""
    ending = "\r\n" if "\r\n" in text else "\n"
    present = {line.strip() for line in text.splitlines()}
    text += ending if text and not text.endswith("\n") else ""
    return text + "".join(f"{line}{ending}" for line in lines if line not in present)


def continuous(service: str, layout: Layout, report: Report) -> Draft:
    """Plan the file by which a service checks the repository. Raises ReportedError."""
    top = git.repository_of(layout.folder) or layout.folder
    path, template = SERVICES[service]
    # what CMake's packages generate for Python is not committed, and others name their folder
    is_committed = top == layout.folder and layout.kind not in ("ament_cmake", "workspace")
    text = code().get_template(template).render(is_committed=is_committed)
    draft = Draft(Project(".", ScaffoldOptions(Root(top)), report))
    if _MOVING in text and (commit := git.commit("HEAD", top.parent / "idlc")):
        text = text.replace(_MOVING, f"rev: {commit}")
    present = draft.text(path)
    if present is None or _REVISION.sub("", present) == _REVISION.sub("", text):
        text = present or text
        draft.put(path, text, "CI checks the interfaces")
        return draft
    message = f"`{path}` exists, and idlc does not edit it"
    hint = "add the missing lines"
    raise report.refused(codes.EXISTING_FILE.of(path, message, hint=hint, detail=text.rstrip()))


def obtaining(draft: Draft) -> list[str]:
    """Return the commands after which a repository contains what its CI runs."""
    text = "".join(draft.text(path) or "" for path in draft.reasons)
    if "./tools/idlc" in text:  # the action installs the wheel
        ignored = "touch tools/idlc/COLCON_IGNORE"  # by checks of this package
        return [_WHEEL, _ACTION, ignored, "git add --force wheels tools/idlc"]
    return [_WHEEL, "git add --force wheels"] if "wheels/idlc" in text else []


def recommendation(root: Root, report: Report) -> Draft:
    """Plan that VS Code recommends idlc's extension, in a folder that has settings for it."""
    draft = Draft(Project(".", ScaffoldOptions(root), report))
    path, name = ".vscode/extensions.json", '"idlc.idlc"'
    place = root.base / ".vscode"
    text = draft.text(path) if is_folder(place) and not place.is_symlink() else name
    new = text or f'{{\n  "recommendations": [{name}]\n}}\n'
    if name not in new and (match := _RECOMMENDED.match(new)):  # the file may have comments
        separator = "" if new[match.end()] == "]" else f",{match[1] or ' '}"
        new = f"{new[: match.end()]}{name}{separator}{new[match.end() :]}"
    if new != text:
        draft.put(path, new, "VS Code recommends the extension for interface files")
    return draft


def generate(preparation: Preparation, report: Report) -> tuple[Generated, ...]:
    """Compile what was prepared, as `idlc gen` without words does."""
    folder = preparation.layout.folder
    config = load_settings(Root.at(folder), report)
    start = "" if folder == Path.cwd() else f"cd {shlex.quote(Root.here().shown(folder))} && "
    options = GenOptions((), scope(config), again=f"{start}idlc gen")
    return gen(in_package(with_settings(options, config)), report)
