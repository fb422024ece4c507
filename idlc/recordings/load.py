"""Classes without generated files: compiled on request, and kept in memory."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cached_property, lru_cache
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

import msgspec

from idlc.compiler.compiler import Compiler, library_for, sources_of
from idlc.compiler.requests import requested_packages
from idlc.diagnostics import codes, terminal
from idlc.diagnostics.report import Report, ReportedError
from idlc.model import ir
from idlc.model.distros import BY_NAME, DISTROS, Distro, titles
from idlc.model.python_names import class_
from idlc.model.type_data import content, sources
from idlc.project.library import resolve
from idlc.project.root import Root
from idlc.project.settings import Config, Scope, scope
from idlc.project.words import read_word
from idlc.recordings import memory
from idlc.recordings.arguments import message_class, texts
from idlc.recordings.containers.container import Topic
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.definitions import RECORDING, Origin, read_definition
from idlc.recordings.lengths import KnownVersion, fits
from idlc.recordings.packages import check_versions
from idlc.recordings.types import (
    LocalTypes,
    RecordedTypes,
    TypesReader,
    read_topics,
    recorded_types,
    topics_of,
    versions,
)
from idlc.runtime.names import owner_of
from idlc.runtime.typeinfo import Structure, Types, structure_of

if TYPE_CHECKING:  # it imports numpy, which classes do not need
    from idlc.recordings.containers.messages import Raw


def known_spec(package: str, module: str) -> Any:
    """Return the spec of a module in a package that is known here, under its own name.

    It is `None` if the package has no such module. Other packages are imported by their own names,
    too. Raises CompileError.
    """
    if not memory.is_kept(package):
        with _compiling() as report:
            models, _ = _models_of(package, (), None, report)
        memory.keep_as_named(models[package])
    return memory.find_spec(module)


# what is loaded


class CompileError(ValueError):
    """Interfaces that cannot be loaded: they have errors, or do not exist."""


class LoadedPackages(ModuleType):
    """Packages that were compiled together; requested interfaces also by their own names."""

    def __init__(self, models: memory.ModelsByName, names: Iterable[ir.TypeName]) -> None:
        super().__init__(memory.home_of(models), "The packages that `idlc.load` compiled.")
        self._packages = {package: model.kinds for package, model in sorted(models.items())}
        self._interfaces = {str(class_(name)): name for name in names}

    def __getattr__(self, name: str) -> Any:
        if name in self._packages:
            for kind in self._packages[name]:
                import_module(f"{self.__name__}.{name}.{kind}")
            return import_module(f"{self.__name__}.{name}")
        if name in self._interfaces:
            return memory.class_in(self.__name__, self._interfaces[name])
        raise AttributeError(f"no `{name}` was loaded, but {', '.join(dir(self))}")

    def __getitem__(self, name: str) -> Any:
        """Return a class by its full name, such as "std_msgs/msg/Header"."""
        return memory.class_in(self.__name__, ir.TypeName(*name.split("/")))  # type: ignore[arg-type]

    def __dir__(self) -> list[str]:
        return [*self._packages, *sorted(self._interfaces)]

    def __repr__(self) -> str:
        return f"<loaded: {', '.join(dir(self))}>"


@contextmanager
def _compiling() -> Iterator[Report]:
    """Give a report, and raise CompileError for errors in it."""
    report = Report()
    try:
        yield report
        report.raise_errors()
    except ReportedError:
        raise CompileError("\n" + "\n".join(terminal.text(report))) from None


def loaded(
    what: str,
    *,
    include: Iterable[str] = (),
    distro: str | None = None,
    read: TypesReader = read_topics,
) -> LoadedPackages:
    """Return the classes of what `idlc.load` names; `read` reads recordings."""
    if distro is not None and not isinstance(distro, str):
        raise TypeError(f"`distro` is the name of a distribution, not {distro!r}")
    folders = texts(include, "the folders of `include`")
    with _compiling() as report:
        models, names = _models_of(str(what), folders, distro, report, read)
    return LoadedPackages(models, names)


def _models_of(
    what: str,
    include: tuple[str, ...],
    distro: str | None,
    report: Report,
    read: TypesReader = read_topics,
) -> tuple[memory.ModelsByName, Iterable[ir.TypeName]]:
    """Return the models of packages, and the requested interfaces in them."""
    where = scope(Config(root=Root.here()), None, include, distro=distro)
    meaning = read_word(what, where.root, "name")
    if meaning == "recording":
        groups = versions(topics_of(read, [what], (), where.root, report))
        check_versions(groups, report)
        if len(groups) != 1:
            return {}, ()
        types = recorded_types(groups[0], LocalTypes(where, report), Report())
        report.extend(types.errors)
        return types.models, {topic.interface for topic in types.topics}
    if meaning == "path":
        packages = requested_packages([what], [], "", where, report)
        names = [name for package in packages for name in package.names]
        compiler = Compiler(library_for(packages, where, report))
        for package in packages:
            compiler.add(sources_of(package, report), report)
    else:
        library, definitions = resolve(what, where, report)
        names = [definition.interface for definition in definitions]
        compiler = Compiler(library)
    report.raise_errors()
    every = Report()
    models = compiler.models(compiler.reached(names), every)
    report.extend(every.errors)
    return models, names


# the types of recorded messages


class TopicType:
    """The type of a topic's messages, compiled from what was recorded."""

    def __init__(self, models: memory.ModelsByName, name: ir.TypeName) -> None:
        self.models = models
        self.name = name

    @cached_property
    def structure(self) -> Structure:
        """The type, field by field, with the texts of all types in it."""
        texts: dict[str, str] = {}
        for model in self.models.values():
            texts |= sources(model)
        own = content(self.models[self.name.package])
        return Types({**own, "sources": texts})[str(self.name)]

    @cached_property
    def kind(self) -> Any:
        """The class of the messages."""
        return memory.class_in(memory.home_of(self.models), self.name)


def type_of(
    topic: Topic,
    include: tuple[str, ...] = (),
    distro: str | None = None,
    sample: Callable[[], Sequence[Raw]] = tuple,
    origin: Origin = RECORDING,
) -> TopicType:
    """Return the type of a topic's messages, in a recording or of another origin.

    Warns if something else had to be used than what was recorded, or if that is not what the
    topic's publisher said it is. Where a definition is missing and `distro` does not say of which
    distribution it is, it is the one that a `sample` of messages fits, if the local one does not.
    """
    release = BY_NAME[distro] if distro else Scope(Root.here()).distro
    topic_type, report = _type_of(topic, include, release, origin)
    borrowed = any(problem.code == codes.MISSING_DEFINITION.id for problem in report)
    distros: tuple[Distro, ...] = ()
    if borrowed and distro is None:
        raws = sample()
        if raws and not fits(topic_type.structure, raws):
            topic_type, distros = _fitting(topic, include, raws) or (topic_type, ())
    for diagnostic in report:
        message = diagnostic.message
        if distros:
            what = message.partition("; ")[0]
            message = (
                f"{what}; idlc uses the type of ROS 2 {titles(distros)}, which fits the messages"
            )
        fitting = next(iter(distros), None)
        warnings.warn(MissingDefinitionWarning(topic.name, message, fitting), stacklevel=2)
    if list(report):  # the local definitions that are used instead may change
        _type_of.cache_clear()
    if topic.hash not in (None, topic_type.structure.hash):
        message = f"`{topic.name}`: the definition of {topic.type} differs from {origin.type}"
        warnings.warn(message, OtherDefinitionWarning, stacklevel=2)
    return topic_type


def _fitting(
    topic: Topic, include: tuple[str, ...], raws: Sequence[Raw]
) -> tuple[TopicType, tuple[Distro, ...]] | None:
    """Return the type that fits messages, and its distributions; `None` if it is not the only one.

    Types are looked up in each distribution of ROS 2.
    """
    every: dict[str, tuple[TopicType, list[Distro]]] = {}
    for distro in DISTROS:
        with suppress(RecordingError):
            other, _ = _compiled(topic, include, distro)
            if fits(other.structure, raws):
                every.setdefault(other.structure.hash, (other, []))[1].append(distro)
    if len(every) != 1:
        return None
    ((fitting, distros),) = every.values()
    return fitting, tuple(distros)


def known_versions(
    topic: Topic, include: tuple[str, ...], others: Iterable[Topic]
) -> Iterator[KnownVersion]:
    """Yield other versions of a topic's type.

    They are those of `others`, that of this machine, and those of each distribution of ROS 2.
    """
    release = Scope(Root.here()).distro
    bare = msgspec.structs.replace(topic, schema=None, hash=None)
    is_undefined = topic.schema is None or topic.schema.is_blank
    candidates: list[tuple[str, Topic, Distro, Distro | None]] = [
        *(("another version in the recording", other, release, None) for other in others),
        ("the version on this machine", bare, release, None),
    ]
    for distro in DISTROS:
        words = f"the version of ROS 2 {distro.title}"
        candidates.append((words, bare, distro, distro if is_undefined else None))
    for words, candidate, distro, chosen in candidates:
        with suppress(RecordingError):
            yield KnownVersion(words, _compiled(candidate, include, distro)[0].structure, chosen)


@lru_cache(maxsize=64)
def _type_of(
    topic: Topic, include: tuple[str, ...], distro: Distro, origin: Origin
) -> tuple[TopicType, Report]:
    return _compiled(topic, include, distro, origin)


def _compiled(
    topic: Topic, include: tuple[str, ...], distro: Distro, origin: Origin = RECORDING
) -> tuple[TopicType, Report]:
    types, report = _types(topic, include, distro, origin)
    if not types.topics or types.errors or report.had_errors:
        problems = [*types.errors, *report]
        first = min(problems, key=lambda problem: problem.severity, default=None)
        why = first.message if first else "its type is unknown"
        why = why.removeprefix(f"idlc does not read `{topic.name}`: ")
        raise RecordingError(f"`{topic.name}` cannot be read: {why}", first and first.hint)
    return TopicType(types.models, types.topics[0].name), report


def _types(
    topic: Topic,
    include: tuple[str, ...],
    distro: Distro | None = None,
    origin: Origin = RECORDING,
) -> tuple[RecordedTypes, Report]:
    distros = (distro,) if distro else ()
    where, report = Scope(Root.here(), include=include, distros=distros), Report()
    (version,) = versions([read_definition(topic, topic.name)._replace(origin=origin)])
    return recorded_types(version, LocalTypes(where, report), report), report


class OtherDefinitionWarning(UserWarning):
    """The definition in a recording does not have the hash that the publisher announced."""


class MissingDefinitionWarning(UserWarning):
    """A recording does not define one of its types; the local type of that name is used.

    Or that of a `distro`, if only that fits the messages.
    """

    def __init__(self, topic: str, message: str, distro: Distro | None = None) -> None:
        super().__init__(topic, message)
        self.topic = topic
        self.message = message
        self.distro = distro

    def __str__(self) -> str:
        return f"`{self.topic}`: {self.message}"


def check_class(kind: Any, topic: Topic, include: tuple[str, ...] = ()) -> Any:
    """Return a program's class; raise RecordingError if messages are of another type."""
    try:
        class_type = structure_of(owner_of(message_class(kind)))
    except TypeError:
        hint = "omit it, or give a class that `idlc gen` generated"
        raise RecordingError(f"{kind!r} is not a message class of idlc", hint) from None
    if class_type.name != topic.type:
        message = f"`{topic.name}` has messages of {topic.type}, not of {class_type.name}"
        raise RecordingError(message)
    if class_type.hash != topic.hash:
        types, _ = _types(topic, include)
        digest = next(map(types.hash, types.topics), None)
        if class_type.hash != digest:
            raise RecordingError(
                f"{class_type.name} was another type when `{topic.name}` was recorded: its hash is "
                f"{digest or topic.hash or 'not known'}, the class has {class_type.hash}",
                "omit the class to read the recorded type",
            )
    return kind
