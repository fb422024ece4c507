"""The pipeline of `idlc scaffold interface`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from idlc.check.compiler import compile_package
from idlc.check.package.facts import folders
from idlc.check.package.manifest import calls, dependency_edit
from idlc.diagnostics.report import Report, apply
from idlc.diagnostics.source import Source
from idlc.model import catalog, derive, ir, names
from idlc.model.link import Model
from idlc.project import package_xml
from idlc.project.edits import Edited, Outcome, Refused
from idlc.scaffold import package
from idlc.scaffold.changes import (
    Project,
    Result,
    Settings,
    accepted,
    find_package,
    generation,
    keys_of,
    library_around,
    rendering,
    templates,
    write,
)
from idlc.scaffold.edits import setup_py
from idlc.scaffold.templates import Templates

SEPARATOR = "---"
#: The folder of files that only tools of ROS 2 read.
RESOURCE = "resource"


def check_interface_name(name: str) -> str:
    """Return an interface's name if it can be one."""
    if not names.is_message_name(name) or "_" in name:
        raise ValueError(f"`{name}` cannot be an interface: {names.MESSAGE_HINT}")
    return name


def interface_text(kind: str, fields: Sequence[str], comment: str = "") -> str:
    """Return the text of an interface file; without fields, all parts are empty."""
    parts: list[list[str]] = [[]]
    for field in fields:
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
    head = "".join(f"# {line}".rstrip() + "\n" for line in comment.splitlines())
    gap = "\n" if head and parts[0] else ""
    body = f"{SEPARATOR}\n".join("".join(f"{line}\n" for line in part) for part in parts)
    return head + gap + body


#: The first content of a new file.
_STARTERS = {
    "msg": ("float32 speed  # forwards [m/s]",),
    "srv": ("bool enable  # what is wanted", "---", "bool enabled  # what is so now"),
    "action": (
        "uint32 count  # how many times",
        "---",
        "uint32 total  # how many times it was",
        "---",
        "uint32 done  # how many times until now",
    ),
}


def starter(word: str) -> tuple[str, str]:
    """Return path and text of a new interface file, named like `Drive` or `srv/Ask`."""
    kind, _, name = word.rpartition("/")
    kind = kind or "msg"
    if kind not in _STARTERS:
        raise ValueError(f"`{word}` is no interface: write `Drive`, `srv/Ask` or `action/Walk`")
    comment = "An example: say here what it is for."
    return f"{kind}/{check_interface_name(name)}.{kind}", interface_text(
        kind, _STARTERS[kind], comment
    )


def interface_index(package: str, keys: Iterable[str]) -> tuple[str, str]:
    """Return path and text of the file by which ROS 2's tools know a package's interfaces.

    `keys` are the interface files, such as `msg/Drive.msg`. Source: language 9.
    """
    return f"{RESOURCE}/rosidl_interfaces/{package}", "".join(f"{key}\n" for key in sorted(keys))


def check_fields(fields: Sequence[str]) -> None:
    """Raise ValueError for a field that would be more than one line of the file."""
    for field in fields:
        if len(field.splitlines()) > 1:
            raise ValueError(f"a field is one line, not {field!r}")


WHERE = "to the packages that rosidl_generate_interfaces() depends on, and find_package() it"
_LIST = "dependencies"


def add_cmake_dependencies(text: str, names: Sequence[str]) -> Outcome:
    """Return the file with packages added to its list of dependencies."""
    commands = list(calls(Source("CMakeLists.txt", text)))
    words = {word for command in commands for word in command.words}
    missing = [name for name in names if name not in words]
    if not missing:
        return Edited(text)
    assigned = (command for command in commands if command.name == "set")
    lists = [command for command in assigned if command.words[:1] == (_LIST,)]
    if len(lists) != 1:
        why = f"there is no `set({_LIST} ...)`, or more than one"
        return Refused(why, " ".join(missing), WHERE)
    return Edited(
        apply(text, (dependency_edit(lists[0], name, listed=True) for name in missing))[0]
    )


CMAKE = "CMakeLists.txt"
MANIFEST = "package.xml"
SETUP = "setup.py"


def interface_edits(
    model: Model,
    texts: Mapping[str, str],
    keys: Iterable[str],
    folders: Mapping[str, bool],
    *,
    tested: bool,
) -> dict[str, Outcome]:
    """Return the edits of a package that gets the interfaces of a model.

    `texts` are those of the package's files that exist, `keys` all its interfaces as
    `kind/Name.kind`, `folders` those that there are by dotted name, and whether each is a Python
    package. The package needs pytest if it is `tested`.
    """
    needed = implied_packages(model)
    tests = ["python3-pytest"] if tested else []
    edits: dict[str, Outcome] = {
        MANIFEST: package_xml.add_dependencies(
            texts.get(MANIFEST, ""), depends=needed, tests=tests, group=True
        )
    }
    if CMAKE in texts:
        edits[CMAKE] = add_cmake_dependencies(texts[CMAKE], needed)
        return edits
    if SETUP in texts:
        wired = setup_py.add_interfaces(texts[SETUP], model.package, keys, folders)
        edits[SETUP] = Edited(wired)
    return edits


def index_interface(model: Model, texts: Mapping[str, str], keys: Iterable[str]) -> dict[str, str]:
    """Return the index of interfaces, for a package that no CMake installs."""
    return {} if CMAKE in texts else dict([interface_index(model.package, set(keys))])


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
    comment: str,
    settings: Settings,
    report: Report,
) -> Result | None:
    """Write an interface file into the package that the working folder belongs to."""
    located = find_package(settings, report)
    if located is None:
        return None
    project, own = located
    path = f"{kind}/{name}.{kind}"
    text = interface_text(kind, fields, comment)
    used = templates(settings, report)
    model = _model(project, ir.TypeName(own, kind, name), path, text, settings, report)
    if report.had_errors:
        return None
    added = {path: text}
    with rendering(name, report):
        added |= _test_of_interfaces(project, own, used)
    read = {file: project.text(file) for file in (CMAKE, MANIFEST, SETUP)}
    texts = {file: text for file, text in read.items() if text is not None}
    keys, present = {*keys_of(project), path}, folders(project.path)
    edits = interface_edits(model, texts, keys, present, tested=len(added) > 1)
    edited = accepted(project, edits, report)
    if edited is None:
        return None
    edited |= index_interface(model, texts, keys)
    result = write(project, added, edited, settings, report)
    after = () if CMAKE in texts else generation(project, own, settings)
    return result and result._replace(following=after)


def _model(
    project: Project, name: ir.TypeName, path: str, text: str, settings: Settings, report: Report
) -> Model:
    """Return the model of a package with only the new interface; report its problems."""
    library = library_around(name.package, project, settings, report)
    problems = Report()
    source = Source(project.shown(path), text)
    model = compile_package(name.package, [(name, source)], library, problems)
    report.extend(problems)
    return model


def _test_of_interfaces(project: Project, own: str, used: Templates) -> dict[str, str]:
    """Return the test that `colcon test` runs, for a package with [tool.idlc]."""
    path = "test/test_interfaces.py"
    if "[tool.idlc]" not in (project.text("pyproject.toml") or "") or project.has(path):
        return {}
    template = "package/test_interfaces.py.jinja"
    return {path: package.rendered_for(own, template, used)}
