"""Classes without generated files: compiled on request, and kept in a cache."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib import import_module, invalidate_caches
from pathlib import Path
from shutil import rmtree
from types import ModuleType
from typing import TYPE_CHECKING, Any

from idlc.check.compiler import Compiler, library_for, sources_of
from idlc.diagnostics.report import Report
from idlc.generate.target import last_change, requested_packages
from idlc.model import ir
from idlc.model.python_names import class_
from idlc.project.files import cache_folder
from idlc.project.find import is_path
from idlc.project.library import resolve
from idlc.project.root import Root
from idlc.project.settings import Config, Scope, scope
from idlc.project.templates import RenderedFile
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.definitions import read_definition
from idlc.recordings.find import is_recording
from idlc.recordings.types import LocalTypes, RecordedTypes, read_topics, recorded_types, versions
from idlc.runtime.names import owner_of
from idlc.runtime.typeinfo import structure_of
from idlc.version import __version__

if TYPE_CHECKING:
    from idlc.model.link import Model
    from idlc.recordings.containers.container import Topic


@cache
def folder() -> Path:
    """Return the folder of cached packages, by default with idlc's other caches.

    Without a writable cache, it is a folder that is removed when this process ends.
    """
    chosen = os.environ.get("IDLC_CACHE")
    base = Path(chosen) if chosen else cache_folder()
    try:
        if base is not None:
            place = base / "loaded"
            place.mkdir(mode=0o700, parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=place):
                return place
    except OSError:
        pass
    import atexit

    temporary = tempfile.mkdtemp(prefix="idlc-")
    atexit.register(rmtree, temporary, ignore_errors=True)
    return Path(temporary)


def is_stored(name: str) -> bool:
    """Return whether packages are there under a name."""
    return (folder() / name).is_dir()


def store(name: str, files: Iterable[RenderedFile]) -> None:
    """Write packages under a name, whole or not at all; packages of other processes stay."""
    target = folder() / name
    draft = Path(tempfile.mkdtemp(dir=folder(), prefix=".new-"))
    try:
        for file in files:
            path = draft / file.path
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(file.text, encoding="utf-8")
        try:
            draft.rename(target)
        except OSError:
            if not target.is_dir():
                raise
    finally:
        rmtree(draft, ignore_errors=True)


@cache
def newest() -> int:
    """Return the time of the last change of idlc: its version does not change with each edit."""
    package = Path(__file__).parents[1]
    return last_change((package, package.parent / "templates"))


Models = dict[str, "Model"]


def requested_models(
    what: str, include: tuple[str, ...], distro: str | None, report: Report
) -> tuple[Models, list[ir.TypeName]]:
    """Return the models of packages, and the requested interfaces in them."""
    where = scope(Config(Root.here()), None, include, distro=distro)
    if is_recording(what, where.root):
        return _of_recording(what, where, report)
    if is_path(what, where.root):
        packages = requested_packages([what], [], "", where, report)
        library = library_for(packages, where, report)
        names = [name for package in packages for name in package.names]
        compiler = Compiler(library)
        for package in packages:
            compiler.add(sources_of(package, report), report)
    else:
        library, definitions = resolve(what, where, report)
        names = [definition.interface for definition in definitions]
        compiler = Compiler(library)
    return ({}, []) if report.had_errors else (_models(compiler, names, report), names)


def _models(compiler: Compiler, names: Iterable[ir.TypeName], report: Report) -> Models:
    """Return the models of interfaces and of all that these need, by package."""
    every = Report()
    models = compiler.models(compiler.reached(names), every)
    report.extend(every.errors)
    return models


def _of_recording(path: str, where: Scope, report: Report) -> tuple[Models, list[ir.TypeName]]:
    recording = read_topics(path, where.root, report)
    groups = versions(recording.topics) if recording else []
    if len(groups) != 1:
        from idlc.recordings.packages import check_versions

        check_versions(groups, report)
        return {}, []
    types = recorded_types(groups[0], LocalTypes(where, report), where, Report())
    models = types.models
    report.extend(types.errors)
    return models, sorted({topic.interface for topic in types.topics})


def topic_models(topic: Topic, include: tuple[str, ...]) -> tuple[Models, Report]:
    """Return the models of a topic's type, and a report if not all was recorded."""
    types, report = _types(topic, include)
    if not types.topics or types.errors or report.had_errors:
        problems = [*types.errors, *report]
        first = min(problems, key=lambda problem: problem.severity, default=None)
        why = first.message if first else "its type is not known"
        why = why.removeprefix(f"`{topic.name}` is left out: ")
        raise RecordingError(f"`{topic.name}` cannot be read: {why}", first and first.hint)
    return types.models, report


def recorded_hash(topic: Topic, include: tuple[str, ...]) -> str | None:
    """Return the hash of a topic's type by its definition, or `None` if there is none."""
    types, _ = _types(topic, include)
    return next((types.hash(typed) for typed in types.topics), None)


def _types(topic: Topic, include: tuple[str, ...]) -> tuple[RecordedTypes, Report]:
    where, report = Scope(Root.here(), include=include), Report()
    (version,) = versions([read_definition(topic, topic.name)])
    types = recorded_types(version, LocalTypes(where, report), where, report)
    return types, report


#: The package that all loaded ones are in.
LOADED = "idlc.loaded"
#: The `_idlc` of each. Messages show names as those of generated packages do.
SUPPORT = '''\
"""The runtime of this package, which is that of idlc."""

from idlc.runtime import *
from idlc.runtime import __getattr__, message

_home = __name__.rpartition(".")[0]
message.SHOWN[_home] = _home.rpartition(".")[2]
'''


class CompileError(ValueError):
    """Interfaces that cannot be loaded: they have errors, or do not exist."""


class LoadedPackages(ModuleType):
    """Packages that were compiled together; requested interfaces also by their own names."""

    def __init__(
        self, name: str, models: Mapping[str, Model], asked: Iterable[ir.TypeName]
    ) -> None:
        super().__init__(name, "What `idlc.load` compiled.")
        self._packages = {
            package: sorted({own.name.kind for own in model.own})
            for package, model in sorted(models.items())
        }
        self._asked = {str(class_(type_name)): type_name for type_name in asked}

    def __getattr__(self, name: str) -> Any:
        if name in self._packages:
            for kind in self._packages[name]:
                import_module(f"{self.__name__}.{name}.{kind}")
            return import_module(f"{self.__name__}.{name}")
        if name in self._asked:
            return self[str(self._asked[name])]
        raise AttributeError(f"no `{name}` was loaded, but {', '.join(dir(self))}")

    def __getitem__(self, name: str) -> Any:
        """Return a class by its full name, such as "std_msgs/msg/Header"."""
        return _class(self.__name__, name)

    def __dir__(self) -> list[str]:
        return [*self._packages, *sorted(self._asked)]

    def __repr__(self) -> str:
        return f"<loaded: {', '.join(dir(self))}>"


def load(what: str, *, include: Iterable[str] = (), distro: str | None = None) -> LoadedPackages:
    """Compile interfaces, and return their classes.

    `what` is a recording, a .msg, .srv or .action file, a folder of them, or the name of a type or
    package that is known here. `include` are folders in which other packages are looked for first.
    The classes can be pickled, where the same cache is seen; type checkers do not know them, so
    programs are better off with `idlc gen`.
    """
    report = Report()
    models, asked = requested_models(str(what), tuple(include), distro, report)
    _raise_for(report)
    name = _stored(models)
    return LoadedPackages(f"{LOADED}.{name}", models, asked)


def class_of(topic: Topic, include: tuple[str, ...] = ()) -> Any:
    """Return the class of a topic's messages, compiled from what was recorded.

    Warns if something else had to be used, or if it is not what the topic's publisher said it is.
    """
    schema, key = topic.schema, ""
    if schema and not schema.is_blank:
        converts = Scope(Root.here(), include=include).distro.converts_values
        texts = [topic.type, schema.encoding, schema.text, topic.hash or ""]
        key = _key(texts, converts=converts)
    if not (key and is_stored(key)):
        models, report = topic_models(topic, include)
        for diagnostic in report:
            warnings.warn(MissingDefinitionWarning(topic.name, diagnostic.message), stacklevel=2)
        # local definitions that were used instead may change
        key = _stored(models, "" if list(report) else key)
    kind = _class(f"{LOADED}.{key}", topic.type)
    if topic.hash not in (None, structure_of(owner_of(kind)).hash):
        message = f"`{topic.name}`: the definition of {topic.type} is not that of what was recorded"
        warnings.warn(message, OtherDefinitionWarning, stacklevel=2)
    return kind


class OtherDefinitionWarning(UserWarning):
    """The definition in a recording does not have the hash that the publisher announced."""


class MissingDefinitionWarning(UserWarning):
    """A recording does not define one of its types; the local type of that name is used."""

    def __init__(self, topic: str, message: str) -> None:
        super().__init__(topic, message)
        self.topic = topic
        self.message = message

    def __str__(self) -> str:
        return f"`{self.topic}`: {self.message}"


def check_class(kind: Any, topic: Topic, include: tuple[str, ...] = ()) -> Any:
    """Return the class of a program; raise RecordingError if messages are of another type."""
    try:
        class_type = structure_of(owner_of(kind))
    except (AttributeError, ImportError, KeyError, TypeError):
        hint = "leave it out, or give one that `idlc gen` made"
        raise RecordingError(f"{kind!r} is no message class of idlc", hint) from None
    if class_type.name != topic.type:
        message = f"`{topic.name}` has messages of {topic.type}, not of {class_type.name}"
        raise RecordingError(message)
    if class_type.hash != topic.hash:
        digest = recorded_hash(topic, include)
        if class_type.hash != digest:
            raise RecordingError(
                f"{class_type.name} was another type when `{topic.name}` was recorded: its hash is "
                f"{digest or topic.hash or 'not known'}, that of the class is {class_type.hash}",
                "leave the class out to read what was recorded",
            )
    return kind


def _class(home: str, name: str) -> Any:
    package, kind, short = name.split("/")
    module: Any = import_module(f"{home}.{package}.{kind}")
    return getattr(module, class_(ir.TypeName(package, kind, short)))  # type: ignore[arg-type]


def _stored(models: Mapping[str, Model], key: str = "") -> str:
    """Return the name under which the packages are kept, after they are written if need be."""
    if not key:
        texts = [
            text
            for model in models.values()
            for own in model.own
            for text in (str(own.name), own.source.text if own.source else "")
        ]
        converts = any(model.distro.converts_values for model in models.values())
        key = _key(texts, converts=converts)
    if not is_stored(key):
        store(key, _files(models, f"{LOADED}.{key}"))
        invalidate_caches()
    return key


def _files(models: Mapping[str, Model], parent: str) -> Iterator[RenderedFile]:
    """Yield the files of packages, which share the support code of this idlc."""
    from idlc.generate.python.imports import Surroundings
    from idlc.generate.python.render import render_package

    runtime = (RenderedFile("_idlc.py", SUPPORT),)
    for package, model in models.items():
        surroundings = Surroundings(others=f"{parent}.")
        for file in render_package(model, surroundings, runtime):
            yield RenderedFile(f"{package}/{file.path}", file.text)


def _key(texts: Iterable[str], *, converts: bool) -> str:
    """Return a name for packages that are compiled from these texts by this idlc.

    With `converts`, their classes convert values as Lyrical's do.
    """
    from hashlib import sha256

    digest = sha256(f"{__version__} {newest()} {converts}".encode())
    for text in texts:
        raw = text.encode("utf-8", "surrogatepass")
        digest.update(b"%d " % len(raw) + raw)
    return f"h{digest.hexdigest()[:12]}"


def _raise_for(report: Report) -> None:
    if report.had_errors:
        from idlc.diagnostics import terminal

        raise CompileError("\n" + "\n".join(terminal.text(report)))
