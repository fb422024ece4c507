"""Rules on CMakeLists.txt: rosidl generates what it names, with the packages that it finds.

What is computed there is not judged; `unknown` says so.
"""

from __future__ import annotations

import posixpath
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from fnmatch import fnmatchcase

from idlc.check.manifest import (
    IMPLICIT,
    RUNTIME_PACKAGES,
    has_gaps,
    used_packages,
)
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Edit, Label
from idlc.diagnostics.source import Source, Span
from idlc.diagnostics.text import closest
from idlc.model import catalog
from idlc.model.distros import Distro
from idlc.model.link import Model
from idlc.packaging.cmake import DEPENDENCIES, GENERATE, Call, Item, Script, section
from idlc.packaging.facts import Facts

_FILES = (".msg", ".srv", ".action", ".idl")
#: Packages without interfaces; the generators find those that all interfaces may need.
_TOOLS = ("ament_", "rosidl_")
#: The paths and names that fixes write; CMake would take others apart.
_PLAIN = re.compile(r"[\w./]+", re.ASCII)
_COMMENT = re.compile(r"[ \t]*#(?!\[=*\[)[^\r\n]*")
#: Paths are compared for hints only up to so many pairs.
_COMPARED = 10_000


def lists(facts: Facts, model: Model) -> Iterator[Diagnostic]:
    """Report differences between CMakeLists.txt and the interfaces with their dependencies."""
    if facts.cmake is None or not model.own:
        return
    script = Script(facts.cmake)
    if not script.generating:
        return
    yield from (problems := [*_named_files(facts, model, script)])
    if facts.generates and len(script.generating) == 1:
        unused = _unused(facts, model, script)
        for package, places in unused.items():
            message = f"no interface in this package uses `{package}`"
            # no edit: rosidl_generate_interfaces() exports DEPENDENCIES, so that packages that use
            # this one may find the other by it
            hint = "remove it, unless packages that depend on this package need it"
            for place in places:
                yield codes.UNUSED_CMAKE_DEPENDENCY.at(place, message, hint=hint)
        # a package that is added where a file is added would come before the file
        additions = {edit.span.start for problem in problems for edit in problem.edits}
        yield from _listed_dependencies(facts, model, script, additions)
        yield from _found_packages(facts, model, script, unused)
    if facts.generates:
        yield from _exported_runtime(script)


def unknown(facts: Facts) -> str | None:
    """Return a note if CMakeLists.txt computes which interfaces are generated."""
    if facts.cmake is None or not facts.files or Script(facts.cmake).files is not None:
        return None
    computed = f"`{facts.cmake.path}` computes the interfaces for `{GENERATE}`"
    return f"{computed}, so idlc does not compare them with the package's files"


def _named_files(facts: Facts, model: Model, script: Script) -> Iterator[Diagnostic]:
    """CMakeLists.txt names each interface file of the package, and no other."""
    if script.files is None:
        return
    named = {posixpath.normpath(item.text): item for item in script.files if not item.is_pattern}
    patterns = {item.text for item in script.files if item.is_pattern}
    unnamed = {
        key: source
        for key, source in _files_at_their_keys(facts, model).items()
        if key not in named and not any(_fits(key, pattern) for pattern in patterns)
    }
    if not script.writes:
        yield from _absent_files(facts, named, unnamed)
    call = script.generating[-1].span
    name = Span(call.source, call.start, call.start + len(GENERATE))
    last_files = _last_files(script.files)
    for key, source in unnamed.items():
        if source is not None:
            yield codes.INTERFACE_NOT_GENERATED.at(
                Span(source, 0, 0),
                f"`{call.source.path}` does not pass `{key}` to `{GENERATE}`",
                hint=f"add `{key}` to the files in this call",
                labels=(Label(name, "generates others"),),
                edits=_addition(key, last_files),
            )


def _files_at_their_keys(facts: Facts, model: Model) -> dict[str, Source | None]:
    """Return the interface files in folders such as msg/, with names that need no quotes."""
    sources = {f"{own.name.kind}/{own.name.name}.{own.name.kind}": own.source for own in model.own}
    return {
        key: source
        for key, source in sources.items()
        if facts.files.get(key) == key and _PLAIN.fullmatch(key)
    }


def _absent_files(
    facts: Facts, named: Mapping[str, Item], unnamed: dict[str, Source | None]
) -> Iterator[Diagnostic]:
    """Yield a problem for each named file that does not exist.

    Takes a file out of `unnamed` if the fix of a problem names it.
    """
    existing = facts.interfaces | {*facts.files.values()}
    absent = {
        path: item
        for path, item in named.items()
        if item.certain and path.endswith(_FILES) and path not in existing
    }
    for path, item in absent.items():
        if path.startswith(("/", "..")) or ":" in path:
            continue
        near = _nearest(path, unnamed) if len(absent) * len(unnamed) < _COMPARED else None
        hint, edits = "remove it, or create the file", _removal(item.place)
        if near and item.text in item.place.text:
            del unnamed[near]
            hint = f"did you mean `{near}`?"
            edits = (Edit(item.place, item.place.text.replace(item.text, near)),)
        message = f"no such file: `{path}`"
        yield codes.MISSING_INTERFACE_FILE.at(item.place, message, hint=hint, edits=edits)


def _nearest(path: str, keys: Iterable[str]) -> str | None:
    """Return the file that a path may mean: of a similar path, or of the same name elsewhere."""
    name = posixpath.basename(path)
    return closest(path, keys) or next((key for key in keys if key.endswith(f"/{name}")), None)


def _fits(key: str, pattern: str) -> bool:
    """Return whether a file's path is one that `file(GLOB)` finds."""
    names, parts = key.split("/"), posixpath.normpath(pattern).split("/")
    return len(names) == len(parts) and all(map(fnmatchcase, names, parts))


def _last_files(items: Iterable[Item]) -> dict[str, Span]:
    """Return where the last literal file of each kind is named, and with "" that of all."""
    literal = [item for item in items if item.certain and not item.is_pattern]
    named = [item for item in literal if item.text.endswith(_FILES)]
    return {key: item.place for item in named for key in ("", item.text.partition("/")[0])}


def _addition(key: str, last_files: Mapping[str, Span]) -> tuple[Edit, ...]:
    """Return the edit that names a file after others, of its kind if there are any."""
    last = last_files.get(key.partition("/")[0]) or last_files.get("")
    if last is None:
        return ()
    return (
        _insert(last, f'{_margin(last)}"{key}"' if last.text[0] == '"' else _margin(last) + key),
    )


def _listed_dependencies(
    facts: Facts, model: Model, script: Script, avoided: Collection[int]
) -> Iterator[Diagnostic]:
    """CMakeLists.txt names each package whose messages are used; without it, rosidl stops."""
    (call,) = script.generating
    if script.dependencies is None or facts.cmake is None:
        return
    seen = {item.text for item in script.dependencies}
    at = section(call, DEPENDENCIES)
    is_listed = DEPENDENCIES in call.words
    variables = (re.fullmatch(r"\$\{(\w+)\}", call.words[place]) for place in at)
    named = next((variable[1] for variable in variables if variable), None)
    end = at[-1] + 1 if at else len(call.words)
    if not at and is_listed:
        end = call.words.index(DEPENDENCIES) + 1
    target, where = call._replace(places=call.places[:end]), "after `DEPENDENCIES`"
    for command in script.commands:
        if named and command.name == "set" and command.words[:1] == (named,):
            target, where = command, f"to `set({named} ...)`"
    for package, span in used_packages(model).items():
        if package not in seen and package != facts.name:
            edit = dependency_edit(target, package, listed=is_listed)
            edits = (edit, *_find_package_edits(script, package))
            yield codes.MISSING_CMAKE_DEPENDENCY.at(
                span,
                f"`{facts.cmake.path}` does not pass `{package}` to `{GENERATE}`",
                hint=f"add `{package}` {where}, and a line `find_package({package} REQUIRED)`",
                edits=() if edit.span.start in avoided else edits,
            )


def _found_packages(
    facts: Facts, model: Model, script: Script, unused: Collection[str]
) -> Iterator[Diagnostic]:
    """`find_package` finds each package in DEPENDENCIES; without it, rosidl stops."""
    if not script.found or not script.dependencies:
        return
    found = set(script.found_names)
    if not all(name.startswith(_TOOLS) or catalog.is_standard(name) for name in found):
        return  # which packages the others find is unknown
    found = {facts.name, *unused, *_found_with(found, model.distro)}
    for item in script.dependencies:
        if item.text not in found:
            line = f"find_package({item.text} REQUIRED)"
            yield codes.MISSING_FIND_PACKAGE.at(
                item.place,
                f"no call of `find_package` finds `{item.text}` before `{GENERATE}` needs it",
                hint=f"add `{line}`",
                edits=_find_package_edits(script, item.text),
            )


def _found_with(names: Iterable[str], distro: Distro) -> set[str]:
    """Return packages with those that each finds for its own interfaces."""
    found: set[str] = set()
    waiting = [*names]
    while waiting:
        package = waiting.pop()
        if package in found:
            continue
        found.add(package)
        if package.startswith(_TOOLS):
            waiting += [*IMPLICIT, "builtin_interfaces"] if package.startswith("rosidl_") else []
        for name in catalog.interfaces(distro):
            if name.package == package and (source := catalog.source(name, distro)):
                waiting += re.findall(r"^([a-z]\w*)/", source.text, re.MULTILINE)
    return found


def _unused(facts: Facts, model: Model, script: Script) -> dict[str, list[Span]]:
    """Return the packages that a package of interfaces alone names in vain, and where."""
    if not _is_of_interfaces_alone(facts) or has_gaps(model):
        return {}
    used = {name.package for name in model.interfaces} | IMPLICIT
    mentions = Counter(word for call in script.commands for word in call.words)
    listed = {item.text: item.place for item in script.dependencies or () if item.certain}
    found = {call.words[0]: call.span for call in script.finding if call.words}
    unused = {}
    for package in dict.fromkeys((*listed, *found)):
        places = [place for place in (listed.get(package), found.get(package)) if place]
        # what else names it may need it
        is_named = package in used or mentions[package] > len(places)
        if catalog.is_standard(package) and not is_named:
            unused[package] = places
    return unused


def _is_of_interfaces_alone(facts: Facts) -> bool:
    """Return whether a package has no code, and idlc reads all of its interfaces."""
    has_idl = any(path.endswith(".idl") for path in facts.interfaces)
    return facts.whole and not (facts.modules or facts.native or has_idl)


def _exported_runtime(script: Script) -> Iterator[Diagnostic]:
    """Packages that use the interfaces find the runtime, too."""
    is_whole = any(command.name == "ament_package" for command in script.commands)
    if script.exported is None or not is_whole:
        return
    if {item.text for item in script.exported}.isdisjoint(RUNTIME_PACKAGES):
        line = f"ament_export_dependencies({RUNTIME_PACKAGES[0]})"
        call = script.generating[-1].span
        yield codes.RUNTIME_NOT_EXPORTED.at(
            Span(call.source, call.start, call.start + len(GENERATE)),
            f"`{RUNTIME_PACKAGES[0]}` is not exported to packages that use these interfaces",
            hint=f"add `{line}`",
            edits=(_below(call, line),),
        )


# edits


def dependency_edit(target: Call, package: str, *, listed: bool) -> Edit:
    """Return the edit that adds a package to a list, in the layout of its last word.

    A command without such a list gets the keyword as well, unless it is `set()`.
    """
    last = target.places[-1]
    if len(target.places) == 1 and target.name == "set":
        margin = re.match(r"[ \t]*((?:\r\n?|\n))", last.source.text[last.end :])
        return _insert(last, f"{margin[1]}  {package}" if margin else f" {package}")
    keyword = "" if listed else f"{DEPENDENCIES} "
    return _insert(last, f"{_margin(last)}{keyword}{package}")


def _find_package_edits(script: Script, package: str) -> tuple[Edit, ...]:
    """Return the edit that finds a package, unless a loop or a command does so."""
    last = script.last_found
    if last is None or package in script.found_names or not _PLAIN.fullmatch(package):
        return ()
    return (_below(last, f"find_package({package} REQUIRED)"),)


def _removal(place: Span) -> tuple[Edit, ...]:
    """Return the edit that removes a word, with its line if nothing else is on it."""
    if ";" in place.text:
        return ()  # it is several words
    text, start = place.source.text, _blanks_before(place.source.text, place.start)
    rest = re.compile(r"[ \t]*(\r\n?|\n|\Z)").match(text, place.end)
    is_alone = rest and (not start or text[start - 1] in "\r\n")
    end = rest.end() if rest and is_alone else place.end
    return (Edit(Span(place.source, start, end), ""),)


def _blanks_before(text: str, at: int) -> int:
    """Return where the blanks before an offset begin."""
    while at and text[at - 1] in " \t":
        at -= 1
    return at


def _margin(word: Span) -> str:
    """Return what separates a word from the one before: a line end with blanks, or a blank."""
    text, start = word.source.text, _blanks_before(word.source.text, word.start)
    if not start or text[start - 1] not in "\r\n":
        return " "
    return text[start - 1 - text.startswith("\r\n", max(0, start - 2)) : word.start]


def _below(place: Span, line: str) -> Edit:
    """Return the edit that adds a line below a command, with its indentation."""
    text, start = place.source.text, _blanks_before(place.source.text, place.start)
    is_first = not start or text[start - 1] in "\r\n"
    newline = text.find("\n", place.end)
    line_end = "\r\n" if newline > 0 and text[newline - 1] == "\r" else "\n"
    indent = text[start : place.start] if is_first else ""
    return _insert(place, f"{line_end}{indent}{line}")


def _insert(after: Span, text: str) -> Edit:
    """Return the edit that adds text after a word; a new line comes after the word's comment."""
    comment = _COMMENT.match(after.source.text, after.end) if text[0] in "\r\n" else None
    at = comment.end() if comment else after.end
    return Edit(Span(after.source, at, at), text)
