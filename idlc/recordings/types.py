"""The types of recorded topics, compiled; missing definitions are looked up locally."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

import msgspec

from idlc.compiler.compiler import Compiler
from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Report, ReportedError, first_few
from idlc.diagnostics.source import Source
from idlc.diagnostics.text import did_you_mean, including, worded
from idlc.language.parse import parse_any
from idlc.model import derive, ir
from idlc.model.describe import Describer
from idlc.model.ir import content
from idlc.model.link import Model
from idlc.model.lowering.lower import lower
from idlc.project import inputs
from idlc.project.files import missing
from idlc.project.library import Folders, InterfaceTexts, Library
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.project.words import is_there
from idlc.recordings.containers.container import open_recording
from idlc.recordings.containers.file import CDR, Topic, UnreadTopic
from idlc.recordings.containers.source import RecordingError, is_local
from idlc.recordings.damage import Damage
from idlc.recordings.definitions import (
    ENCODINGS,
    RECORDING,
    Origin,
    RecordedDefinition,
    TextCache,
    read_definition,
)
from idlc.wire.layout import report_oversized

#: The number of versions that a topic is compared with.
TRIED = 16


class RecordingTopics(NamedTuple):
    """The topics of a recording."""

    topics: tuple[RecordedDefinition, ...]
    unread: tuple[UnreadTopic, ...] = ()
    damage: tuple[Damage, ...] = ()
    summary: RecordingSummary | None = None


class RecordingSummary(NamedTuple):
    """The times of the first and last message, the bytes of the files, and of each topic."""

    span: tuple[int, int] | None
    size: int
    sizes: dict[Topic, int]


#: Reports list so much damage of a recording.
LISTED = 20


def damage_problems(path: str, damage: Sequence[Damage]) -> Iterator[Diagnostic]:
    """Yield IDL656 for the damage of a recording."""
    for each in damage[:LISTED]:
        yield codes.DAMAGED_RECORDING.of(path, str(each))
    if len(damage) > LISTED:
        message = f"{len(damage) - LISTED:,} more parts of the recording are damaged"
        yield codes.DAMAGED_RECORDING.of(path, message)


#: Returns the topics of a recording by its path, and maybe those of a robot by its address.
TypesReader: TypeAlias = "Callable[[str, Root, Report], RecordingTopics | None]"


class TopicsVersion(msgspec.Struct):
    """Topics whose definitions do not contradict each other, and these definitions."""

    topics: list[RecordedDefinition]
    texts: dict[ir.TypeName, Source]


def read_topics(
    path: str, root: Root, report: Report, *, check: bool = False, verify: bool = False
) -> RecordingTopics | None:
    """Return the topics of a recording; report IDL651 and return `None` for other files.

    Reports name it by `path`, as the user wrote it. With `check`, topics that cannot be read are in
    `unread`, and there is a summary. With `verify`, all messages are read, so that all damage is
    known.
    """
    place = root.path(path) if is_local(path) else path
    if not is_there(place):
        report.add(missing(path, Path(place)))
        return None
    try:
        with open_recording(place, check=True if verify else None) as container:
            if verify:
                container.verify()
            report.notes += container.notes
            cache: TextCache = {}
            topics = tuple(read_definition(topic, path, cache) for topic in container.topics)
            unread = tuple(container.unread()) if check else ()
            summary = None
            if check:
                size = sum(file.size for file in container.files)
                summary = RecordingSummary(container.span(), size, container.sizes())
            damage = tuple(
                msgspec.structs.replace(each, file=each.file.replace(place, path))
                for each in container.damage
            )
            return RecordingTopics(topics, unread, damage, summary)
    except RecordingError as error:
        message = error.message.replace(place, path)
        hint = error.hint.replace(place, path) if error.hint else None
        report.add(codes.UNREADABLE_RECORDING.of(path, message, hint=hint))
        return None


def topics_of(
    read: TypesReader, paths: Sequence[str], selected: Sequence[str], root: Root, report: Report
) -> list[RecordedDefinition]:
    """Return the topics of what `read` reads, or the selected ones.

    Reports IDL655 for a topic that is in none of them, and raises ReportedError.
    """
    recordings = [read(path, root, report) for path in paths]
    if None in recordings:
        raise ReportedError
    topics = [topic for recording in recordings if recording for topic in recording.topics]
    names = dict.fromkeys(topic.topic.name for topic in topics)
    missing = [name for name in selected if name not in names]
    for name in missing:
        near = did_you_mean(name, names) or did_you_mean(f"/{name}", names)
        hint = near or f"`idlc show {shlex.quote(paths[0])}` lists the topics"
        message = f"no topic `{name}` in {' or '.join(f'`{path}`' for path in paths)}"
        report.add(codes.NO_SUCH_TOPIC.of("", message, hint=hint))
    if missing:
        raise ReportedError
    return [topic for topic in topics if not selected or topic.topic.name in selected]


def versions(topics: Iterable[RecordedDefinition]) -> list[TopicsVersion]:
    """Return topics in as few groups as they have different definitions of one name.

    Definitions that differ in comments only are equal.
    """
    groups: list[TopicsVersion] = []
    contents = Contents()
    placed: dict[int, TopicsVersion] = {}  # topics of one definition share their texts
    for topic in topics:
        if id(topic.texts) not in placed:
            # real recordings have few versions; of many, not all are tried
            some = (each for each in groups[-TRIED:] if contents.agree(topic.texts, each.texts))
            version = next(some, None) or TopicsVersion([], {})
            if not version.topics:
                groups.append(version)
            for name, source in topic.texts.items():
                version.texts.setdefault(name, source)
            placed[id(topic.texts)] = version
        placed[id(topic.texts)].topics.append(topic)
    return groups


def contradictions(groups: Sequence[TopicsVersion]) -> Iterator[tuple[ir.TypeName, Source, Source]]:
    """Yield each name that has several definitions, with the first two of them."""
    contents = Contents()
    seen: dict[ir.TypeName, Source] = {}
    reported: set[ir.TypeName] = set()
    for version in groups:
        every = {id(topic.repeated): topic.repeated for topic in version.topics}
        repeated = (pair for pairs in every.values() for pair in pairs)
        for name, source in (*version.texts.items(), *repeated):
            first = seen.setdefault(name, source)
            if name not in reported and not contents.same(name, first, source):
                reported.add(name)
                yield name, first, source


class Contents:
    """Compares definitions by what they mean without comments; each is read once."""

    def __init__(self) -> None:
        self._contents: dict[tuple[ir.TypeName, str, bool], Hashable] = {}

    def agree(self, some: InterfaceTexts, others: InterfaceTexts) -> bool:
        """Return whether no name has different definitions in both."""
        return all(
            self.same(name, source, others[name]) for name, source in some.items() if name in others
        )

    def same(self, name: ir.TypeName, source: Source, other: Source) -> bool:
        """Return whether two definitions mean the same."""
        return source.text == other.text or self._of(name, source) == self._of(name, other)

    def _of(self, name: ir.TypeName, source: Source) -> Hashable:
        key = (name, source.text, source.is_idl)
        if key not in self._contents:
            report = Report()
            read = lower(parse_any(source), name, report)
            # a definition that cannot be parsed equals no other
            self._contents[key] = source.text if report.had_errors else content(read)
        return self._contents[key]


#: Names that are listed in a sentence.
NAMED = 5
#: Reasons why a definition is not the recording's.
ABSENT, UNREADABLE = "{0.name} does not define", "there are errors in the definition of"
WRONG = "{0.hash} does not match the definition of"
_RECORDERS = "the recorder and the publisher used different versions of the interface files"


def borrowed(origin: Origin = RECORDING, option: str = "") -> str:
    """Return the hint where a local definition is used, and which `option` chooses another."""
    options = worded("`--distro NAME` or `-I DIR`", "`distro=NAME` or `include=[DIR]`")
    return f"check that it equals {origin.type}; {option or options} chooses another"


class _Substitution(NamedTuple):
    """Definitions of a recording, or of another origin, for which idlc uses local ones, and why.

    They are `sure` to be equal if the hash says so.
    """

    recording: str
    origin: Origin
    why: str
    is_sure: bool
    used: str


def _substituted(
    substitution: _Substitution, undefined: Iterable[ir.TypeName], option: str
) -> Diagnostic:
    """Return IDL652 or IDL654; an `option` chooses other definitions."""
    recording, origin, why, is_sure, used = substitution
    which = origin.hash if is_sure else "the same name"
    message = f"{why.format(origin)} {_named(undefined)}; idlc uses {used}, which has {which}"
    code, hint = codes.MISSING_DEFINITION, None
    if why == WRONG:
        code, hint = codes.RECORDED_HASH_DIFFERS, _RECORDERS
    hint = hint if is_sure else borrowed(origin, option)
    return code.of(recording, message, hint=hint)


def _named(names: Iterable[ir.TypeName]) -> str:
    return first_few((f"`{name}`" for name in sorted(names)), NAMED)


class DefinedTopic(NamedTuple):
    """A topic of a type that is defined, in the recording or locally."""

    recorded: RecordedDefinition
    name: ir.TypeName
    interface: ir.TypeName


class LocalTypes:
    """The types that are defined locally, without any recording; `texts` take precedence.

    Hints name the `option` with which a command finds others, instead of the common ones.
    """

    def __init__(
        self,
        scope: Scope,
        report: Report,
        texts: InterfaceTexts = MappingProxyType({}),
        option: str = "",
    ) -> None:
        self.scope = scope
        self.option = option
        self.library = Library(
            scope.include,
            scope.root,
            report,
            own=lambda: self.near,
            distro=scope.distro,
            texts=texts,
            idl=True,
        )
        self._compiler = Compiler(self.library)
        self._hashes: dict[ir.TypeName, str | None] = {}

    @cached_property
    def near(self) -> Folders:
        """The packages around here, which complete recordings do not need."""
        return inputs.nearby_packages(self.scope.root)

    def model(self, package: str, names: Iterable[ir.TypeName]) -> Model:
        """Return the model of the interfaces of a package that are known and sound."""
        interfaces = self._compiler.reached(names)
        report = Report()
        model = self._compiler.model(package, list(interfaces.values()), report)
        return model.sound({error.where[0] for error in report.errors})

    def origin(self, name: ir.TypeName) -> str:
        """Return the words for a type that is defined locally: it may be of a distribution."""
        if name in self.library.texts:
            return "the type of `--from`"
        is_built_in = self.library.path(name) is None
        return f"the type of ROS 2 {self.library.distro.title}" if is_built_in else "the local type"

    def hash(self, name: ir.TypeName, interface: ir.TypeName) -> str | None:
        """Return the hash of a type that an interface defines; `None` if it is not known."""
        if name not in self._hashes:
            self._hashes[name] = self.model(interface.package, [interface]).hash(name)
        return self._hashes[name]


def recorded_types(version: TopicsVersion, local: LocalTypes, report: Report) -> RecordedTypes:
    """Return the types of the topics of a version; reports IDL652 for undefined ones.

    Local definitions replace those that have errors or another hash than the recorded one, unless
    a recorded hash says that something else was recorded. Then the errors are in `errors`.
    """
    problems, others = Report(), Report()
    types = RecordedTypes(version, local, problems, {})
    faulty = {diagnostic.where[0] for diagnostic in types.errors}
    broken = {
        **{name: ABSENT for name, own in types.texts.items() if own.is_incomplete},
        **dict.fromkeys(types.empty, ABSENT),
        **dict.fromkeys(types.wrong, WRONG),
        **{name: UNREADABLE for name, own in types.texts.items() if own.path in faulty},
    }
    broken = {name: why for name, why in broken.items() if local.library.source(name) is not None}
    if broken:
        trial = RecordedTypes(version, local, others, broken)
        if trial.fit_locally(version.topics, broken.keys()):
            types, problems = trial, others
    report.extend(problems)
    return types


class RecordedTypes:
    """The types of the topics of a version, and all that these refer to."""

    def __init__(
        self,
        version: TopicsVersion,
        local: LocalTypes,
        report: Report,
        broken: Mapping[ir.TypeName, str],
    ) -> None:
        """Look the types up; reports IDL652 for types that the recording does not define.

        Definitions in `broken` are ignored; its values say why.
        """
        self._broken = broken
        self._local = local
        self._names: dict[ir.TypeName, set[ir.TypeName]] = {}
        #: The topics without a definition, for each problem that says so.
        self.undefined: dict[Diagnostic, list[str]] = {}
        texts = {name: source for name, source in version.texts.items() if name not in broken}
        for topic in version.topics:
            name = topic.interface
            if name is None or name.kind != "msg" or name in texts:
                continue
            # it may be empty because it has no fields, as its hash says, or else the local
            # definition; otherwise it may be one that the recorder did not find
            empty = Describer({name: ir.Message(name=name)}).hash(str(name))
            if (topic.topic.hash or local.hash(name, name)) == empty:
                path = f"{topic.recording}: topic {topic.topic.name}: {name}.msg"
                texts[name] = Source(path, "", topic.recording)
        self.texts = texts
        scope, texts = local.scope, {**local.library.texts, **texts}
        self.library = Library(
            scope.include,
            scope.root,
            Report(),
            own=lambda: local.near,
            distro=scope.distro,
            texts=texts,
            idl=True,
        )
        self.topics = tuple(self._typed(version, report))
        compiler = Compiler(self.library)
        self.interfaces = compiler.reached(typed.interface for typed in self.topics)
        every = Report()
        self.models = compiler.models(self.interfaces, every)
        report_oversized(self.models.values(), every)
        self.errors = Report()
        self.errors.extend(every.errors)
        faulty = {diagnostic.where[0] for diagnostic in self.errors}
        if faulty:
            self.models = {name: model.sound(faulty) for name, model in self.models.items()}
        report.extend(self._substitutions())

    def _typed(self, version: TopicsVersion, report: Report) -> Iterator[DefinedTopic]:
        """Yield the topics whose types are known; report the others."""
        missing: dict[tuple[str, str], list[str]] = {}
        for topic in version.topics:
            recorded, name, interface = topic.topic, topic.name, topic.interface
            schema = recorded.schema
            reason = f" ({topic.problem})" if topic.problem else ""
            if recorded.encoding != CDR:
                why = f"its messages are written as `{recorded.encoding}`, not as ROS 2 writes them"
            elif not recorded.type:
                why = "its type is not a ROS 2 type"
            elif name is None or interface is None:
                encoding = schema.encoding if schema else ""
                what = f"; its encoding is {encoding}" if encoding not in ENCODINGS else ""
                why = f"`{recorded.type}` is not a ROS 2 type{what}"
            elif interface not in self.texts and self._local.library.source(interface) is None:
                why = f"{ABSENT.format(topic.origin)} `{interface}`{reason}"
            elif (
                interface not in self.texts
                and recorded.hash
                and recorded.hash != self._local.hash(name, interface)
            ):
                why = f"{ABSENT.format(topic.origin)} `{interface}`{reason}"
                why += ", and the local type differs"
            else:
                yield DefinedTopic(topic, name, interface)
                continue
            missing.setdefault((topic.recording, why), []).append(recorded.name)
        for (recording, why), names in missing.items():
            listed = first_few((f"`{name}`" for name in names), NAMED)
            advice = f"{including('DIR')}, where DIR contains the package's sources"
            if self._local.option:
                advice = f"give the publisher's version with {self._local.option}"
            is_undefined = "does not define" in why
            message = f"idlc does not read {listed}: {why}"
            hint = advice if is_undefined else None
            problem = codes.MISSING_DEFINITION.of(recording, message, hint=hint)
            report.add(problem)
            if is_undefined:
                self.undefined[problem] = names

    def _substitutions(self) -> Iterator[Diagnostic]:
        """Yield IDL652 or IDL654 for definitions that are not the recording's.

        A local definition that replaces a missing one and has the recorded hash is not reported.
        """
        doubtful: dict[_Substitution, set[ir.TypeName]] = {}
        for typed in self.topics:
            missing = {name for name in self.names_of(typed) if name not in self.texts}
            sure = bool(missing) and typed.recorded.topic.hash == self.hash(typed)
            for name in missing:
                why = self._broken.get(name, ABSENT)
                if why != ABSENT or not sure:
                    where = typed.recorded.recording, typed.recorded.origin
                    key = _Substitution(*where, why, sure, self._local.origin(name))
                    doubtful.setdefault(key, set()).add(name)
        for key, undefined in doubtful.items():
            yield _substituted(key, undefined, self._local.option)
        partial: dict[str, set[ir.TypeName]] = {}
        for typed in self.topics:
            texts = ((name, self.texts.get(name)) for name in self.names_of(typed))
            names_of_partial = {name for name, own in texts if own and own.is_incomplete}
            partial.setdefault(typed.recorded.recording, set()).update(names_of_partial)
        for recording, incomplete in partial.items():
            if incomplete:
                yield codes.MISSING_DEFINITION.of(
                    recording,
                    f"constants, default values and comments may be missing in {_named(incomplete)}"
                    ", because nodes of ROS 2 sent incomplete texts",
                    hint=f"{including('DIR')}, where DIR contains the package's sources",
                )

    def names_of(self, topic: DefinedTopic) -> set[ir.TypeName]:
        """Return the interfaces that a topic's type is made of, without those that ROS 2 adds."""
        name = topic.interface
        if name not in self._names:
            known = self.interfaces.keys()
            self._names[name] = derive.closure(
                {name} & known, lambda each: known & derive.references(self.interfaces[each])
            )
        return self._names[name]

    @property
    def wrong(self) -> set[ir.TypeName]:
        """The definitions that differ from the local ones, where these have the recorded hash."""
        contents = Contents()
        names: set[ir.TypeName] = set()
        seen: set[tuple[ir.TypeName, str | None]] = set()
        for typed in self.topics:
            digest = typed.recorded.topic.hash
            if (typed.name, digest) in seen or digest in (None, self.hash(typed)):
                continue
            seen.add((typed.name, digest))
            if digest == self._local.hash(typed.name, typed.interface):
                for name in self.names_of(typed) & self.texts.keys():
                    local_source = self._local.library.source(name)
                    if not (local_source and contents.same(name, self.texts[name], local_source)):
                        names.add(name)
        return names

    @property
    def empty(self) -> set[ir.TypeName]:
        """The empty definitions of types with fields locally, unless a recorded hash agrees."""
        names: set[ir.TypeName] = set()
        contents = Contents()
        for name, source in self.texts.items():
            local_source = None if source.text else self._local.library.source(name)
            if local_source is not None and not contents.same(name, source, local_source):
                names.add(name)
        for topic in self.topics if names else ():
            if topic.recorded.topic.hash and topic.recorded.topic.hash == self.hash(topic):
                names -= self.names_of(topic)
        return names

    def fit_locally(
        self, topics: Iterable[RecordedDefinition], broken: AbstractSet[ir.TypeName]
    ) -> bool:
        """Return whether no recorded hash contradicts the local `broken` definitions."""
        typed = {id(typed.recorded): typed for typed in self.topics}
        for wanted in topics:
            topic, digest = typed.get(id(wanted)), wanted.topic.hash
            if topic is None:
                if wanted.interface in broken:
                    return False
            elif digest and broken & self.names_of(topic) and digest != self.hash(topic):
                return False
        return True

    def hash(self, topic: DefinedTopic) -> str | None:
        """Return the hash of the type that definitions make; `None` if these have errors."""
        return self.models[topic.name.package].hash(topic.name)
