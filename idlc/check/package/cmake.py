"""The commands of a CMakeLists.txt, and rules on one that generates interfaces."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from idlc.check.package.manifest import used_packages
from idlc.diagnostics import codes
from idlc.diagnostics.report import Edit, Report
from idlc.diagnostics.source import Source, Span
from idlc.model.link import Model
from idlc.project.package_xml import Facts

_COMMAND = re.compile(r'\b([A-Za-z_]\w*)[ \t]*\(([^()"]*(?:"[^"]*"[^()"]*)*)\)')
#: The command that generates interfaces.
GENERATE = "rosidl_generate_interfaces"
_KEYWORD = "DEPENDENCIES"
_OPTIONS = {"ADD_LINTER_TESTS", "LIBRARY_NAME", "SKIP_GROUP_MEMBERSHIP_CHECK", "SKIP_INSTALL"}
_VARIABLE = re.compile(r"\$\{(\w+)\}")


class Call(NamedTuple):
    """A command, its words and the range of each."""

    name: str
    words: tuple[str, ...]
    places: tuple[Span, ...]
    span: Span


def calls(source: Source) -> Iterator[Call]:
    """Yield the commands of a CMakeLists.txt, except nested ones."""
    code = re.sub(r"#[^\r\n]*", lambda comment: " " * len(comment[0]), source.text)
    for command in _COMMAND.finditer(code):
        places = [
            Span(source, command.start(2) + word.start(), command.start(2) + word.end())
            for word in re.finditer(r"[^\s;]+", command[2])
        ]
        words = tuple(place.text.strip('"') for place in places)
        yield Call(command[1].lower(), words, tuple(places), Span(source, *command.span()))


def listed_dependencies(facts: Facts, model: Model, report: Report) -> None:
    """CMakeLists.txt names each package whose messages are used; without it, rosidl stops."""
    if facts.cmake is None or not (facts.generates and model.own):
        return
    commands = list(calls(facts.cmake))
    generating = [command for command in commands if command.name == GENERATE]
    if len(generating) != 1:
        return
    (call,) = generating
    lists = {
        command.words[0]: command for command in commands if command.name == "set" and command.words
    }
    others = {
        command.words[1]
        for command in commands
        if command.name == "list" and len(command.words) > 1
    }
    first, end = _dependencies(call)
    words = call.words[first:end]
    named = [variable[1] for word in words if (variable := _VARIABLE.fullmatch(word))]
    seen = {word for word in words if word.isidentifier()}
    for name in named:
        if name not in lists or name in others:
            return  # computed
        seen |= {*lists[name].words[1:]}
    if any("$" in word for word in seen) or len(seen) < len(words) - len(named):
        return
    target = lists[named[0]] if named else call._replace(places=call.places[:end])
    for package, span in used_packages(model).items():
        if package not in seen and package != facts.name:
            problem = codes.MISSING_CMAKE_DEPENDENCY.at(
                span,
                f"`{facts.cmake.path}` does not give `{package}` to `{GENERATE}`",
                hint=f"add `{package}` {_where(named)}, and `find_package({package} REQUIRED)`",
            )
            edits = (
                dependency_edit(target, package, listed=bool(words)),
                *_find_package_edits(commands, package),
            )
            report.add(msgspec.structs.replace(problem, edits=edits))


def _dependencies(call: Call) -> tuple[int, int]:
    """Return the range of a call's words that are its dependencies."""
    count = len(call.words)
    first = call.words.index(_KEYWORD) + 1 if _KEYWORD in call.words else count
    return first, next((at for at in range(first, count) if call.words[at] in _OPTIONS), count)


def _where(named: list[str]) -> str:
    return f"to `set({named[0]} ...)`" if named else "to its `DEPENDENCIES`"


def dependency_edit(target: Call, package: str, *, listed: bool) -> Edit:
    """Return the edit that adds a package to a list, in the layout of its last word.

    A command without such a list gets the keyword as well, unless it is `set()`.
    """
    last = target.places[-1]
    text = last.source.text
    margin = re.search(r"(?:\r\n?|\n)[ \t]*\Z", text[: last.start])
    if len(target.places) == 1 and target.name == "set":
        margin = re.match(r"[ \t]*((?:\r\n?|\n))", text[last.end :])
        return _insert(last, f"{margin[1]}  {package}" if margin else f" {package}")
    between = margin[0] if margin else " "
    return _insert(last, f"{between}{package}" if listed else f"{between}{_KEYWORD} {package}")


def _find_package_edits(commands: list[Call], package: str) -> tuple[Edit, ...]:
    """Return the edit that finds a package, unless a loop or a command does so."""
    finding = [command for command in commands if command.name == "find_package" and command.words]
    if not finding or any(
        command.words[0] == package or "$" in command.words[0] for command in finding
    ):
        return ()
    last = finding[-1].span
    text = last.source.text
    line_end = "\r\n" if "\r\n" in text else "\n"
    indent = text[text.rfind("\n", 0, last.start) + 1 : last.start]
    indent = "" if indent.strip() else indent
    return (_insert(last, f"{line_end}{indent}find_package({package} REQUIRED)"),)


def _insert(after: Span, text: str) -> Edit:
    return Edit(Span(after.source, after.end, after.end), text)
