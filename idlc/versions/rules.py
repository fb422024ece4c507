"""Files of rules: read as syntax, and run only where somebody names them."""

from __future__ import annotations

import ast
import json
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source, Span
from idlc.model import ir
from idlc.project.files import entries, is_file, is_folder, read_bytes
from idlc.project.root import Root
from idlc.versions.classes import version_of_texts
from idlc.versions.conversion import Version, VersionKey

#: The folder of the recorded classes, beside rules.
TYPES = "types"


class BadRulesError(ValueError):
    """A file of rules that cannot be read, at a place of its source."""

    def __init__(self, message: str, span: Span) -> None:
        super().__init__(message)
        self.span = span


class Rules:
    """The rules of one file, as its syntax shows them."""

    def __init__(self, source: Source, file: Path) -> None:
        """Raise BadRulesError for a file without the two versions, or with wrong syntax."""
        self.source = source
        self.file = file
        try:
            tree = ast.parse(source.text)
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            line = getattr(error, "lineno", None) or 1
            why = error.args[0] if error.args else "it is nested too deeply"
            raise BadRulesError(f"it is not Python: {why}", self._line(line)) from None
        self._head: dict[str, ast.expr] = {}
        self._functions: dict[str, list[ast.FunctionDef]] = {}
        for node in tree.body:
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                self._head[node.targets[0].id] = node.value
            elif isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                self._functions.setdefault(node.name, []).append(node)
        self.old, self.new = self._key("OLD"), self._key("NEW")

    def _line(self, line: int, column: int = 0, length: int = 1) -> Span:
        starts = self.source.line_starts
        start = starts[min(line, len(starts)) - 1] + column
        return Span(self.source, start, start + length)

    def _value(self, name: str) -> Any:
        try:
            return ast.literal_eval(self._head[name])
        except (KeyError, ValueError, TypeError, SyntaxError, RecursionError, MemoryError):
            return None

    def _key(self, name: str) -> VersionKey:
        match self._value(name):
            case (str(type_), str(digest)):
                return VersionKey(type_, digest)
        line = self._head[name].lineno if name in self._head else 1
        message = f'it needs `{name} = ("package/msg/Name", "RIHS01_…")`'
        raise BadRulesError(message, self._line(line))

    @property
    def path(self) -> str:
        """The file, as messages name it."""
        return self.source.path

    @cached_property
    def units(self) -> Mapping[str, tuple[str, str]]:
        """The units that rules convert, by the field."""
        return self._pairs("UNITS")

    @cached_property
    def constants(self) -> Mapping[str, tuple[str, str]]:
        """The renumbered constants that rules convert, by the field."""
        return self._pairs("CONSTANTS")

    def _pairs(self, name: str) -> Mapping[str, tuple[str, str]]:
        value = self._value(name)
        pairs = value.items() if isinstance(value, dict) else ()
        return {
            field: pair
            for field, pair in pairs
            if isinstance(field, str) and isinstance(pair, tuple) and len(pair) == 2
        }

    @property
    def spans(self) -> Iterator[tuple[str, Span]]:
        """Each function's name, and the place of it."""
        for name, nodes in self._functions.items():
            for node in nodes:
                # decorated or not, `def` is on this line
                yield name, self._line(node.lineno, node.col_offset + 4, len(name))

    @property
    def top(self) -> Span:
        """The place of the pair of versions."""
        node = self._head["OLD"]
        return self._line(node.lineno, 0, 3)

    @cached_property
    def fields(self) -> frozenset[str]:
        """The names of the functions."""
        return frozenset(self._functions)


class Known:
    """The rules in some files and folders, by the version that they read."""

    def __init__(self, files: Iterable[Rules]) -> None:
        self.files = tuple(files)
        self._starting: dict[VersionKey, list[Rules]] = {}
        for file in self.files:
            self._starting.setdefault(file.old, []).append(file)
        self._versions: dict[tuple[VersionKey, Path], Version | None] = {}

    def starting(self, old: VersionKey) -> list[Rules]:
        """Return the rules that read a version."""
        return self._starting.get(old, [])

    def version(self, rules: Any) -> Version | None:
        """Return the version that rules write, from the classes beside them."""
        return self.version_beside(rules, rules.new)

    def version_beside(self, rules: Rules, key: VersionKey) -> Version | None:
        """Return a version from the classes beside rules; `None` if they are not there."""
        place = key, rules.file.parent
        if place not in self._versions:
            folder = rules.file.parent / TYPES / key.short.lower()
            self._versions[place] = _version_in(folder, key)
        return self._versions[place]


def _version_in(folder: Path, key: VersionKey) -> Version | None:
    """Return the version that a folder of generated packages describes, read as syntax."""
    texts: dict[ir.TypeName, Source] = {}
    for entry in sorted(entries(folder)):
        file = entry / "_type_data.py"
        if not is_file(file):
            continue
        try:
            tree = ast.parse(read_bytes(file, file.name, Report()) or b"")
            values = [node.value for node in tree.body if isinstance(node, ast.Assign)]
            content = json.loads(ast.literal_eval(values[0]))
            for name, text in content["sources"].items():
                own = ir.TypeName.parse(name)
                texts[own] = Source(f"{folder.name}: {own}.{own.kind}", str(text))
        except (
            OSError,
            SyntaxError,
            ValueError,
            TypeError,
            LookupError,
            AttributeError,
            RecursionError,
            MemoryError,
        ):
            return None
    try:
        version = version_of_texts(texts, ir.TypeName.parse(key.type))
    except ValueError:
        return None
    return version if version is not None and version.key == key else None


def rule_files(paths: Iterable[str], root: Root) -> list[Path]:
    """Return the files of rules that paths mean, a folder all in it."""
    files: list[Path] = []
    for path in paths:
        place = Path(root.path(path))
        if not is_folder(place):
            files.append(place)
            continue
        inside = (entry for entry in sorted(entries(place)) if entry.suffix == ".py")
        files += [entry for entry in inside if entry.name != "__init__.py" and is_file(entry)]
    return files


def read_rules(
    files: Iterable[Path], root: Root, report: Report
) -> tuple[list[Rules], list[BadRulesError]]:
    """Return the rules in files, and what is wrong with the others."""
    rules: list[Rules] = []
    bad: list[BadRulesError] = []
    for file in files:
        source = root.read_source(file, root.shown(file), report)
        if source is None:
            continue
        try:
            rules.append(Rules(source, file))
        except BadRulesError as error:
            bad.append(error)
    return rules, bad


def run_rules(file: Path) -> Mapping[str, Any]:
    """Run a file of rules that somebody named, and return its functions by name.

    Relative imports find the classes beside it.
    """
    home = f"_idlc_rules_{sha256(str(file.resolve()).encode()).hexdigest()[:12]}"
    if home not in sys.modules:
        package = ModuleType(home)
        package.__path__ = [str(file.resolve().parent)]
        sys.modules[home] = package
    # not by the import system, which runs the cached bytecode of a file of the same size and second
    module = ModuleType(f"{home}.{file.stem}")
    module.__file__ = str(file)
    module.__package__ = home
    sys.modules[module.__name__] = module
    code = compile(file.read_bytes(), str(file), "exec", dont_inherit=True)
    exec(code, vars(module))  # noqa: S102 - the user named the file in order to run it
    return {name: value for name, value in vars(module).items() if callable(value)}
