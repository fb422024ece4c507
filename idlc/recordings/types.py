"""The types of recorded topics, compiled; what a recording does not define is looked up here."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from collections.abc import Set as AbstractSet
from functools import cached_property
from typing import NamedTuple

from idlc.check.compiler import Compiler
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report, Severity, first_few
from idlc.diagnostics.source import Source
from idlc.diagnostics.text import including
from idlc.model import derive, ir
from idlc.model.describe import Describer
from idlc.model.link import Model
from idlc.project import inputs
from idlc.project.library import Library
from idlc.project.settings import Scope
from idlc.recordings.definitions import ENCODINGS, Recorded
from idlc.recordings.versions import Contents, Version
from idlc.wire.layout import Extents, oversized

#: Names that are told in a sentence.
NAMED = 5
#: What to do where another definition is used than the recording's.
BORROWED = "see to it that it is what was recorded, or point -I to it"
#: Why a definition is not the recording's.
ABSENT, UNREADABLE = "there is no definition of", "there are errors in the definition of"
WRONG = "the recorded hash is not that of the definition of"


class Typed(NamedTuple):
    """A topic of a type that is known, by the recording or by what is around here."""

    recorded: Recorded
    name: ir.TypeName
    interface: ir.TypeName


class Around:
    """The types that are known here without any recording."""

    def __init__(self, scope: Scope, report: Report) -> None:
        self.near = inputs.near(scope.root)
        self.library = Library(
            scope.include, scope.root, report, own=self.near, distro=scope.distro
        )
        self._compiler = Compiler(self.library)
        self._hashes: dict[ir.TypeName, str | None] = {}

    def model(self, package: str, names: Iterable[ir.TypeName]) -> Model:
        """Return the model of those of a package's interfaces that are known and sound."""
        found = self._compiler.reached(names)
        report = Report()
        model = self._compiler.model(package, list(found.values()), report)
        return model.sound({one.where[0] for one in report if one.severity is Severity.ERROR})

    def hash(self, name: ir.TypeName, interface: ir.TypeName) -> str | None:
        """Return the hash of a type, which an interface implies; `None` if it is not known."""
        if name not in self._hashes:
            model = self.model(interface.package, [interface])
            known = has(model, name)
            self._hashes[name] = model.describer.hash(str(name)) if known else None
        return self._hashes[name]


def has(model: Model, name: ir.TypeName) -> bool:
    """Return whether a structure or interface is in a model."""
    return name in model.messages or name in model.interfaces


def recorded_types(version: Version, around: Around, scope: Scope, report: Report) -> RecordedTypes:
    """Return what the topics of a version mean; reports IDL652 for what it does not define.

    What is known here stands in for definitions that have errors or another hash than the recorded
    one, unless a recorded hash says that something else was recorded. Then these are in `errors`.
    """
    told, others = Report(), Report()
    types = RecordedTypes(version, around, scope, told)
    broken = {
        **dict.fromkeys(types.empty, ABSENT),
        **dict.fromkeys(types.wrong, WRONG),
        **dict.fromkeys(types.broken, UNREADABLE),
    }
    broken = {name: why for name, why in broken.items() if around.library.source(name) is not None}
    if broken:
        trial = RecordedTypes(version, around, scope, others, broken)
        if trial.may_stand_in(version.topics, broken.keys()):
            types, told = trial, others
    report.extend(told)
    return types


class RecordedTypes:
    """What the topics of a version mean, and all that these types refer to."""

    def __init__(
        self,
        version: Version,
        around: Around,
        scope: Scope,
        report: Report,
        broken: Mapping[ir.TypeName, str] | None = None,
    ) -> None:
        """Look the types up; reports IDL652 for what the recording does not define.

        Definitions that are `broken` are none; it says why.
        """
        self._broken = broken = broken or {}
        self._around = around
        self._names: dict[ir.TypeName, set[ir.TypeName]] = {}
        texts = {name: one for name, one in version.texts.items() if name not in broken}
        texts |= _empty_ones(version.topics, texts, around)
        self.library = Library(
            scope.include,
            scope.root,
            Report(),
            own=around.near,
            distro=scope.distro,
            texts=texts,
        )
        self.topics = tuple(_typed(version.topics, texts, around, report))
        self._compiler = Compiler(self.library)
        self.interfaces = self._compiler.reached(one.interface for one in self.topics)
        report.extend(self._doubts())

    @property
    def texts(self) -> Mapping[ir.TypeName, Source]:
        """The definitions that are the recording's."""
        return self.library.texts

    @property
    def names(self) -> dict[str, set[ir.TypeName]]:
        """The names of all that is needed, by package."""
        found: dict[str, set[ir.TypeName]] = {}
        for name in self.interfaces:
            found.setdefault(name.package, set()).add(name)
        return found

    def _doubts(self) -> Iterator[Diagnostic]:
        """Yield IDL652 or IDL654 for definitions that are not the recording's.

        If none is there, and the recorded hash confirms the other, nothing is to be said.
        """
        doubtful: dict[tuple[str, str, bool], set[ir.TypeName]] = {}
        for one in self.topics:
            missing = {name for name in self.names_of(one) if name not in self.texts}
            sure = bool(missing) and one.recorded.topic.hash == self.hash(one)
            for name in missing:
                why = self._broken.get(name, ABSENT)
                if why != ABSENT or not sure:
                    doubtful.setdefault((one.recorded.recording, why, sure), set()).add(name)
        for (recording, why, sure), found in doubtful.items():
            names = first_few((f"`{name}`" for name in sorted(found)), NAMED)
            which = "has the recorded hash and" if sure else "by that name"
            code = codes.RECORDED_HASH_DIFFERS if why == WRONG else codes.MISSING_DEFINITION
            yield code.of(
                recording,
                f"{why} {names}; what is known here {which} is used",
                hint=None if sure else BORROWED,
            )

    def names_of(self, topic: Typed) -> set[ir.TypeName]:
        """Return the interfaces that a topic's type is made of."""
        name = topic.interface
        if name not in self._names:
            self._names[name] = _explicit([name], self.interfaces)
        return self._names[name]

    @property
    def models(self) -> dict[str, Model]:
        """The model of each package, without what has errors."""
        return self._compiled[0]

    @property
    def errors(self) -> Report:
        """What is wrong with the definitions."""
        return self._compiled[1]

    @cached_property
    def _compiled(self) -> tuple[dict[str, Model], Report]:
        found = Report()
        models = {
            package: self._compiler.model(
                package, [self.interfaces[name] for name in sorted(names)], found
            )
            for package, names in sorted(self.names.items())
        }
        if not found.had_errors:
            extents: Extents = {}
            for model in models.values():
                found.extend(oversized(model, extents))
        errors = Report()
        errors.extend(one for one in found if one.severity is Severity.ERROR)
        broken = {one.where[0] for one in errors}
        if broken:
            models = {name: one.sound(broken) for name, one in models.items()}
        return models, errors

    @property
    def broken(self) -> set[ir.TypeName]:
        """The definitions of the recording that have errors."""
        wrong = {one.where[0] for one in self.errors}
        return {name for name, one in self.texts.items() if one.path in wrong}

    @property
    def wrong(self) -> set[ir.TypeName]:
        """The definitions of the recording that are others here, where the recorded hash is."""
        contents = Contents()
        found: set[ir.TypeName] = set()
        seen: set[tuple[ir.TypeName, str | None]] = set()
        for one in self.topics:
            digest = one.recorded.topic.hash
            if (one.name, digest) in seen or digest in (None, self.hash(one)):
                continue
            seen.add((one.name, digest))
            if digest == self._around.hash(one.name, one.interface):
                for name in self.names_of(one) & self.texts.keys():
                    here = self._around.library.source(name)
                    if here is None or not contents.same(name, self.texts[name], here):
                        found.add(name)
        return found

    @property
    def empty(self) -> set[ir.TypeName]:
        """The empty definitions of types that have fields here, unless a recorded hash agrees."""
        found: set[ir.TypeName] = set()
        contents = Contents()
        for name, one in self.texts.items():
            here = None if one.text else self._around.library.source(name)
            if here is not None and not contents.same(name, one, here):
                found.add(name)
        for topic in self.topics if found else ():
            if topic.recorded.topic.hash and topic.recorded.topic.hash == self.hash(topic):
                found -= self.names_of(topic)
        return found

    def may_stand_in(self, topics: Iterable[Recorded], broken: AbstractSet[ir.TypeName]) -> bool:
        """Return whether no recorded hash says that broken definitions were others than here."""
        typed = {id(one.recorded): one for one in self.topics}
        for one in topics:
            found = typed.get(id(one))
            if found is None and one.interface in broken:
                return False
            if found is None or not one.topic.hash or broken.isdisjoint(self.names_of(found)):
                continue
            if self.hash(found) != one.topic.hash:
                return False
        return True

    def hash(self, topic: Typed) -> str | None:
        """Return the hash of the type that definitions make; `None` if these have errors."""
        model = self.models[topic.name.package]
        return model.describer.hash(str(topic.name)) if has(model, topic.name) else None


def _empty_ones(
    topics: Iterable[Recorded], texts: Mapping[ir.TypeName, Source], around: Around
) -> Iterator[tuple[ir.TypeName, Source]]:
    """Yield the messages whose definitions are empty because they are.

    Their hashes say so, or what is known here where none was recorded. Otherwise an empty
    definition may be one that the recorder did not find.
    """
    for topic in topics:
        name, recorded = topic.interface, topic.topic.hash
        if name is None or name.kind != "msg" or name in texts:
            continue
        empty = Describer({name: ir.Message(name=name)}).hash(str(name))
        if (recorded or around.hash(name, name)) == empty:
            path = f"{topic.recording}: topic {topic.topic.name}: {name}.msg"
            yield name, Source(path, "", topic.recording)


def _typed(
    topics: Iterable[Recorded],
    texts: Mapping[ir.TypeName, Source],
    around: Around,
    report: Report,
) -> Iterator[Typed]:
    """Yield the topics whose types are known; report the others."""
    missing: dict[tuple[str, str], list[str]] = {}
    for one in topics:
        if one.name is None or one.interface is None:
            why = _foreign(one)
        else:
            why = "" if one.interface in texts else _why_not_around(one, around)
            if not why:
                yield Typed(one, one.name, one.interface)
        if why:
            missing.setdefault((one.recording, why), []).append(one.topic.name)
    for (recording, why), names in missing.items():
        listed = first_few((f"`{name}`" for name in names), NAMED)
        hint = None if "no type of" in why else f"{including('DIR')} with the package's sources"
        report.add(
            codes.MISSING_DEFINITION.of(recording, f"{listed} is left out: {why}", hint=hint)
        )


def _foreign(one: Recorded) -> str:
    schema = one.topic.schema
    if not one.topic.type:
        return "it has no type of ROS 2"
    what = f", but of {schema.encoding}" if schema and schema.encoding not in ENCODINGS else ""
    return f"`{one.topic.type}` is no type of ROS 2{what}"


def _why_not_around(one: Recorded, around: Around) -> str:
    """Return why what is known here does not stand in for a definition; empty if it does."""
    assert one.name is not None
    assert one.interface is not None
    if around.library.source(one.interface) is None:
        return f"there is no definition of `{one.interface}`"
    if one.topic.hash and one.topic.hash != around.hash(one.name, one.interface):
        return f"there is no definition of `{one.interface}`, and the one known here is another"
    return ""


def _explicit(
    names: Iterable[ir.TypeName], interfaces: Mapping[ir.TypeName, ir.Interface]
) -> set[ir.TypeName]:
    """Return what files name, and the files of these, without what ROS 2 adds by itself."""
    found: set[ir.TypeName] = set()
    waiting = set(names) & interfaces.keys()
    while waiting:
        found |= waiting
        named = set[ir.TypeName]().union(*(derive.references(interfaces[one]) for one in waiting))
        waiting = (named & interfaces.keys()) - found
    return found
