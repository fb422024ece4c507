"""The pipeline of `idlc scaffold interface`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from idlc.check.cmake_lists import dependency_edit
from idlc.check.installation import check_setup
from idlc.compiler.compiler import compile_package, stage
from idlc.diagnostics.report import Report, apply
from idlc.diagnostics.source import Source
from idlc.model import catalog, derive, ir, names
from idlc.model.link import Model
from idlc.packaging import dependencies
from idlc.packaging.cmake import calls
from idlc.packaging.facts import folders
from idlc.packaging.files import CMAKE_LISTS, SETUP_PY, Edited, Outcome, Refused
from idlc.project.root import MANIFEST
from idlc.project.settings import SETTINGS_FILE, load_settings
from idlc.scaffold.changes import ScaffoldOptions, ScaffoldResult, find_package
from idlc.scaffold.package import rendered_for

SEPARATOR = "---"


def check_interface_name(name: str) -> str:
    """Return an interface's name if it can be one."""
    if not names.is_message_name(name) or "_" in name:
        raise ValueError(f"`{name}` cannot be an interface: {names.MESSAGE_HINT}")
    return name


def interface_text(kind: str, fields: Sequence[str]) -> str:
    """Return the text of an interface file; without fields, all parts are empty.

    Raises ValueError for a wrong number of parts, and for a field that is more than one line.
    """
    parts: list[list[str]] = [[]]
    for field in fields:
        if len(field.splitlines()) > 1:
            raise ValueError(f"a field must be one line, not {field!r}")
        if field.strip() == SEPARATOR:
            parts.append([])
        else:
            parts[-1].append(field.strip())
    part_count = {"msg": 1, "srv": 2, "action": 3}[kind]
    if len(parts) > part_count:
        rule = f"a .{kind} file has {part_count} part{'s' * (part_count > 1)}"
        raise ValueError(f"{rule}, here are {len(parts)}: there is one `---` too many")
    if fields and len(parts) < part_count:
        rest = {"srv": "the response", "action": "the result and the feedback"}[kind]
        raise ValueError(
            f"a .{kind} file has {part_count} parts: add `---` before the fields of {rest}"
        )
    parts += [[] for _ in range(part_count - len(parts))]
    return f"{SEPARATOR}\n".join("".join(f"{line}\n" for line in part) for part in parts)


#: The first content of a new file.
_STARTERS = {
    "msg": ("float32 speed  # forwards [m/s]",),
    "srv": ("bool enable  # desired state", "---", "bool enabled  # current state"),
    "action": (
        "uint32 count  # repetitions",
        "---",
        "uint32 total  # final count",
        "---",
        "uint32 done  # count so far",
    ),
}


def starter(word: str) -> tuple[str, str]:
    """Return path and text of a new interface file, named like `Drive` or `srv/Ask`."""
    kind, _, name = word.rpartition("/")
    kind = kind or "msg"
    if kind not in _STARTERS:
        raise ValueError(
            f"`{word}` is not an interface name; write `Drive`, `srv/Ask` or `action/Walk`"
        )
    path = f"{kind}/{check_interface_name(name)}.{kind}"
    head = ("# An example. Describe the interface here.", "")
    return path, interface_text(kind, (*head, *_STARTERS[kind]))


WHERE = "to the packages that rosidl_generate_interfaces() depends on, and find_package() it"
_LIST = "dependencies"


def add_cmake_dependencies(text: str, names: Sequence[str]) -> Outcome:
    """Return the file with packages added to its list of dependencies."""
    commands = list(calls(Source(CMAKE_LISTS, text)))
    words = {word for command in commands for word in command.words}
    missing = [name for name in names if name not in words]
    if not missing:
        return Edited(text)
    assigned = (command for command in commands if command.name == "set")
    lists = [command for command in assigned if command.words[:1] == (_LIST,)]
    if len(lists) != 1:
        why = f"there is no `set({_LIST} ...)`, or more than one"
        return Refused(why, " ".join(missing), WHERE)
    edits = (dependency_edit(lists[0], name, listed=True) for name in missing)
    return Edited(apply(text, edits)[0])


#: The test that `colcon test` runs, for a package with [tool.idlc].
TEST = "test/test_interfaces.py"


def implied_packages(model: Model) -> list[str]:
    """Return the packages that a package depends on for its own interfaces."""
    implied = {p for own in model.own for p in derive.IMPLICIT_PACKAGES[own.name.kind]}
    implied &= {*catalog.packages(model.distro)}  # older distributions lack some
    used = {target.package for own in model.own for target in derive.references(own)}
    return sorted((implied | used) - {model.package})


def interface(
    kind: ir.Kind,
    name: str,
    fields: Sequence[str],
    settings: ScaffoldOptions,
    report: Report,
) -> ScaffoldResult:
    """Write an interface file into the package of the working folder. Raises ReportedError."""
    project = find_package(settings, report)
    own = project.package
    path = f"{kind}/{name}.{kind}"
    text = interface_text(kind, fields)
    load_settings(settings.root, report)  # reports what is wrong with them
    source = Source(project.shown(path), text)
    named = [(ir.TypeName(own, kind, name), source)]
    model = compile_package(own, named, project.library(), report)
    report.raise_errors()
    added = {path: text}
    has_settings = "[tool.idlc]" in (project.text(SETTINGS_FILE) or "")
    if has_settings and not project.has(TEST):
        with stage("scaffold", name):
            added[TEST] = rendered_for(own, "package/test_interfaces.py.jinja")
    needed, tests = implied_packages(model), ["python3-pytest"] if TEST in added else []
    manifest = project.text(MANIFEST) or ""
    declared = dependencies.add_dependencies(manifest, depends=needed, tests=tests, group=True)
    edits: dict[str, Outcome] = {MANIFEST: declared}
    keys, setup = {*project.keys(), path}, project.text(SETUP_PY)
    cmake = project.text(CMAKE_LISTS)
    if cmake is not None:
        edits[CMAKE_LISTS] = add_cmake_dependencies(cmake, needed)
    elif setup is not None:
        wired = add_interfaces(setup, own, keys, folders(project.path))
        edits[SETUP_PY] = Edited(wired)
    edited = project.accepted(edits)
    if cmake is None:  # the file by which ROS 2's tools know a package's interfaces: language 9
        edited[f"resource/rosidl_interfaces/{own}"] = "".join(f"{key}\n" for key in sorted(keys))
    result = project.write(added, edited)
    after = project.generation() if cmake is None else ()
    return result._replace(following=after)


def add_interfaces(
    text: str, package: str, keys: Iterable[str], folders: Mapping[str, bool]
) -> str:
    """Return a setup.py that installs interfaces, their classes and libraries for C++ tools.

    Computed values stay; `idlc check` and the build report missing ones then.
    """
    problems = check_setup(Source(SETUP_PY, text), package, {key: key for key in keys}, folders)
    return apply(text, (edit for problem in problems for edit in problem.edits))[0]
