"""Reading a CMakeLists.txt: its commands, and the lists that it gives to rosidl.

Nothing is run. A value that is not literal is unknown: it is computed, set elsewhere, or changed by
a command that is not known here. Reading takes linear time.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import NamedTuple

from idlc.diagnostics.source import Source, Span

#: The command that generates interfaces, and its keywords.
GENERATE = "rosidl_generate_interfaces"
DEPENDENCIES = "DEPENDENCIES"
OPTIONS = frozenset({"ADD_LINTER_TESTS", "SKIP_GROUP_MEMBERSHIP_CHECK", "SKIP_INSTALL"})
_NAME = "LIBRARY_NAME"
_KEYWORDS = OPTIONS | {DEPENDENCIES, _NAME}

_TOKEN = re.compile(
    r"(?P<blank>[\s;]+)|(?P<comment>#)|(?P<open>\()|(?P<close>\))|(?P<quote>\")"
    r"|(?P<bracket>\[=*\[)|(?P<word>(?:[^\s;()#\"\\]|\\.)+)",
    re.DOTALL,
)
_QUOTED = re.compile(r'"[^"\\]*(?:\\.[^"\\]*)*"', re.DOTALL)
_BRACKET = re.compile(r"\[=*\[")
_LINE = re.compile(r"[^\r\n]*")


class Call(NamedTuple):
    """A command, its words without quotes, and the range of each."""

    name: str
    words: tuple[str, ...]
    places: tuple[Span, ...]
    span: Span


def calls(source: Source) -> Iterator[Call]:
    """Yield the commands of a CMakeLists.txt, up to where CMake would refuse it."""
    text, at, depth = source.text, 0, 0
    name: Span | None = None
    words: list[tuple[str, Span]] = []
    while token := _TOKEN.match(text, at):
        kind, start, at = token.lastgroup, at, token.end()
        if kind == "comment":
            end = _bracket_end(text, at)
            at = _LINE.match(text, at).end() if end is None else end  # type: ignore[union-attr]
        elif kind == "quote":
            quoted = _QUOTED.match(text, start)
            at = quoted.end() if quoted else 0
            words.append((text[start + 1 : at - 1], Span(source, start, at)))
        elif kind == "bracket":
            at = _bracket_end(text, start) or 0
            size = token.end() - start
            words.append((text[start + size : at - size], Span(source, start, at)))
        elif kind == "word" and depth:
            words.append((token[0], Span(source, start, at)))
        elif kind == "word":
            name = Span(source, start, at)
        elif kind == "open":
            depth += 1
            words = words if depth > 1 else []
        elif kind == "close":
            depth -= 1
            if depth == 0 and name:
                span = Span(source, name.start, at)
                named = name.text.lower().lstrip("\ufeff")
                yield Call(
                    named, tuple(word for word, _ in words), tuple(at for _, at in words), span
                )
                name = None
        if at == 0 or depth < 0:
            return


def _bracket_end(text: str, start: int) -> int | None:
    """Return where a bracket that begins here ends; 0 if it does not, `None` without one."""
    opening = _BRACKET.match(text, start)
    if not opening:
        return None
    closing = opening[0].replace("[", "]")
    at = text.find(closing, opening.end())
    return at + len(closing) if at >= 0 else 0


class Item(NamedTuple):
    """A literal element of a list: its text, and where it is written.

    `certain` is whether no condition surrounds it, `is_pattern` whether it stands for the files
    that it fits.
    """

    text: str
    place: Span
    certain: bool = True
    is_pattern: bool = False


#: What a list or argument holds; `None`: unknown.
Items = list[Item] | None
_VARIABLE = re.compile(r"\$\{(\w+)\}")
_HERE = re.compile(r"\$\{(?:CMAKE_CURRENT|CMAKE|PROJECT)_SOURCE_DIR\}[:/]")
_BLOCKS = frozenset({"if", "foreach", "while", "block"})
_ROUTINES = frozenset({"function", "macro"})
#: Commands that change no list that they name.
_HARMLESS = ("ament_", "cmake_minimum", "else", "end", "find_", "install", "message", "target_")
#: Commands that may write files before rosidl looks for them.
_WRITING = frozenset({"configure_file", "execute_process", "file"})
#: Words and values are followed up to these lengths, lists up to so many elements together.
_LONGEST_WORD, _LONGEST_VALUE, _MOST = 1024, 256, 1_000_000


def _runs_another_file(call: Call) -> bool:
    """Return whether a command runs commands that the file does not contain."""
    if call.name == "include":
        return re.search(r"[/$.]", " ".join(call.words)) is not None
    return call.name in ("add_subdirectory", "cmake_language")


class Script:
    """The arguments that a CMakeLists.txt passes to rosidl and ament.

    `files` are the interfaces of all calls of `GENERATE`, `dependencies` the packages of the last;
    `found` what `find_package` finds, in `finding` those calls that no condition surrounds;
    `exported` what `ament_export_dependencies` names. `writes` is whether CMake may write files.
    `unconditional` are the commands that always run; `reads_others`: so do some of other files.
    """

    def __init__(self, source: Source) -> None:
        self.commands = tuple(calls(source))
        self.generating: list[Call] = []
        self.finding: list[Call] = []
        self.unconditional: list[Call] = []
        self.files: Items = []
        self.dependencies: Items = []
        self.found: Items = []
        self.exported: Items = []
        self.writes = False
        self._lists: dict[str, Items] = {}
        self._changed: set[str] = set()  # by functions and macros
        self._open: list[str] = []
        self._routines = 0  # that are open
        self.reads_others = False  # they may set lists
        self._left = _MOST
        for call in self.commands:
            self._run(call)

    @cached_property
    def found_names(self) -> frozenset[str]:
        """The packages that `find_package` finds, as far as they are known."""
        return frozenset(item.text for item in self.found or ())

    @cached_property
    def last_found(self) -> Span | None:
        """The last `find_package` before interfaces are generated, if all are literal."""
        named = [
            call.words[0] for call in self.commands if call.name == "find_package" and call.words
        ]
        if self.found is None or "$" in "".join(named):
            return None
        start = self.generating[-1].span.start
        return next((call.span for call in self.finding[::-1] if call.span.start < start), None)

    def _run(self, call: Call) -> None:
        name, words = call.name, call.words
        self.unconditional += [] if self._open or name == "return" else [call]
        if name.startswith("end") and self._open:
            self._routines -= self._open.pop() in _ROUTINES
        elif self._routines:
            self._changed.update(words)
            if name == GENERATE:
                self.generating.append(call)
                self.files = self.dependencies = None
        elif name == GENERATE:
            self.generating.append(call)
            files, packages = (self._picked(call, word) for word in ("", DEPENDENCIES))
            self.files, self.dependencies = self._added(self.files, files), packages
        elif name in ("set", "list", "file", "foreach", "project"):
            self._assign(call)
        elif name == "find_package":
            self.found = self._added(self.found, self._expanded(words[:1], call.places))
            self.finding += [] if self._open else [call]
        elif name == "ament_export_dependencies":
            self.exported = self._added(self.exported, self._expanded(words, call.places))
        elif name.startswith("ament_auto_"):
            self.found = self.exported = None
        elif _runs_another_file(call):
            self.files = self.found = self.exported = None
            self._lists, self.reads_others = {}, True
        elif name not in _BLOCKS and not name.startswith(_HARMLESS):
            self._lists.update(dict.fromkeys(words))
        self.writes |= name in _WRITING and words[:1] != ("GLOB",)
        if name in _BLOCKS | _ROUTINES:
            self._open.append(name)
            self._routines += name in _ROUTINES

    def _picked(self, call: Call, keyword: str) -> Items:
        """Return what is after a keyword of `GENERATE`; without one, the interfaces."""
        places = section(call, keyword)
        return self._expanded([call.words[at] for at in places], [call.places[at] for at in places])

    def _assign(self, call: Call) -> None:
        """Follow a command that sets a list."""
        words, places, items = call.words, call.places, None
        keep = bool(self._open)
        match call.name, *words:
            case "project", _, *_:
                name, items = "PROJECT_NAME", self._expanded(words[:1], places)
            case "set", name, *rest if not {"CACHE", "PARENT_SCOPE"} & set(rest):
                items = self._expanded(words[1:], places[1:])
            case "foreach", name, *_:
                items = self._looped(call)
            case "list", "APPEND" | "PREPEND", name, *_:
                items, keep = self._expanded(words[2:], places[2:]), True
            case "file", "GLOB", name, *_:
                items = self._globbed(call)
            case "list", "FIND" | "GET" | "JOIN" | "LENGTH" | "SUBLIST", *_, name:
                pass
            case "list" | "file", *_:  # one of the words names the result
                self._lists.update(dict.fromkeys(words))
                return
            case _, name, *_:
                pass
            case _:
                return
        unset: Items = None if self.reads_others else []
        before = self._lists.get(name, unset) if keep else []
        self._lists[name] = None if name in self._changed else self._added(before, items)

    def _looped(self, call: Call) -> Items:
        """Return what the variable of a loop stands for, one after the other."""
        words, places = call.words[1:], call.places[1:]
        if words[:2] == ("IN", "LISTS") and "ITEMS" not in words:
            looped: Items = []
            for name in words[2:]:
                looped = self._added(looped, self._lists.get(name))
            return looped
        if words[:2] == ("IN", "ITEMS") and "LISTS" not in words:
            return self._expanded(words[2:], places[2:])
        return None if {"IN", "RANGE"} & set(words) else self._expanded(words, places)

    def _globbed(self, call: Call) -> Items:
        """Return the patterns of a `file(GLOB)` that is relative to the package's folder."""
        patterns, is_relative = [], False
        words = iter(zip(call.words[2:], call.places[2:], strict=True))
        for word, place in words:
            if word in ("RELATIVE", "LIST_DIRECTORIES"):
                value = next(words, ("", place))[0]
                is_relative |= word == "RELATIVE" and bool(_HERE.fullmatch(f"{value}/"))
            elif word != "CONFIGURE_DEPENDS":
                patterns.append((word, place))
        items = self._expanded([word for word, _ in patterns], [place for _, place in patterns])
        known = items if is_relative else None
        return known and [item._replace(is_pattern=True) for item in known]

    def _expanded(self, words: Sequence[str], places: Sequence[Span]) -> Items:
        """Return words with the values of variables in place of them."""
        items: Items = []
        for word, place in zip(words, places, strict=False):
            text, variable = word, _VARIABLE.fullmatch(word)
            if not place.text.startswith(("[[", "[=")):
                if variable:
                    items = self._added(items, self._lists.get(variable[1]))
                    continue
                if len(word) <= _LONGEST_WORD:
                    text = _VARIABLE.sub(self._single, _HERE.sub("", word, count=1))
                if len(word) > _LONGEST_WORD or re.search(r"[$@\\]", text):
                    return None
            if items is not None:
                items += (Item(part, place) for part in text.split(";") if part)
        if items and self._open:
            return [item._replace(certain=False) for item in items]
        return items

    def _single(self, variable: re.Match[str]) -> str:
        """Return the value of a variable within a word; the variable if it has not just one."""
        values = self._lists.get(variable[1])
        if not values or len(values) > 1 or values[0].is_pattern:
            return variable[0]
        return values[0].text if len(values[0].text) <= _LONGEST_VALUE else variable[0]

    def _added(self, items: Items, more: Items) -> Items:
        if items is None or more is None or len(items) + len(more) > self._left:
            return None
        self._left -= len(items) + len(more)
        return [*items, *more]


def section(call: Call, keyword: str) -> list[int]:
    """Return the places of the words after a keyword of `GENERATE`; without one, of interfaces."""
    places, current = [], ""
    for at, word in enumerate(call.words[1:], 1):
        if word in _KEYWORDS:
            current = "" if word in OPTIONS else word
        elif current == keyword:
            places.append(at)
        current = "" if current == _NAME and word != _NAME else current
    return places
