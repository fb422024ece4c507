"""Classes without generated files: compiled on request, and kept in memory."""

from __future__ import annotations

import copyreg
import json
import sys
import warnings
import zlib
from collections.abc import Iterable, Mapping
from functools import cache, cached_property, lru_cache
from hashlib import sha256
from importlib import import_module
from importlib.abc import ExecutionLoader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

from idlc import runtime
from idlc.check.compiler import Compiler, library_for, sources_of
from idlc.diagnostics.report import Report
from idlc.generate.target import requested_packages
from idlc.generate.types import content
from idlc.model import ir
from idlc.model.distros import Distro
from idlc.model.link import Model
from idlc.model.python_names import class_
from idlc.project.find import is_path
from idlc.project.library import resolve
from idlc.project.root import Root
from idlc.project.settings import Config, Scope, scope
from idlc.recordings.containers.container import Topic
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.definitions import read_definition
from idlc.recordings.find import is_recording
from idlc.recordings.packages import check_versions
from idlc.recordings.types import LocalTypes, RecordedTypes, recorded_types, topics_of, versions
from idlc.runtime.message import SHOWN, InterfaceMeta
from idlc.runtime.names import owner_of
from idlc.runtime.typeinfo import Structure, Types, structure_of

Models = dict[str, Model]


# packages in memory

#: The package that all loaded ones are in.
LOADED = "idlc.loaded"


class _Module(ModuleType):
    """A module whose classes are pickled with the packages that they are of."""

    def __setattr__(self, name: str, value: object) -> None:
        # each class has a metaclass of its own, which its module gets, too
        if isinstance(value, type) and issubclass(value, InterfaceMeta):
            copyreg.pickle(value, _class_reduction)
        super().__setattr__(name, value)


class _Importer(MetaPathFinder, ExecutionLoader):
    """Imports modules by their `texts`."""

    def __init__(self) -> None:
        self.texts = {LOADED: ""}

    def find_spec(self, name: str, _path: object = None, _target: object = None) -> Any:
        """Return the spec of a module."""
        if name not in self.texts:
            return None
        is_package = any(other.startswith(f"{name}.") for other in self.texts)
        spec = ModuleSpec(name, self, origin=self.get_filename(name), is_package=is_package)
        spec.has_location = True
        return spec

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return an empty module."""
        return _Module(spec.name)

    def get_source(self, name: str) -> str:
        """Return the text of a module."""
        return self.texts[name]

    def get_filename(self, name: str) -> str:
        """Return what tracebacks name."""
        return f"{name}.py"


_IMPORTER = _Importer()
sys.meta_path.append(_IMPORTER)


def _keep(home: str, texts: Mapping[str, str]) -> None:
    """Make packages importable; `texts` are those of their modules, named relative to `home`."""
    if home in _IMPORTER.texts:
        return
    for name, text in texts.items():
        _IMPORTER.texts[f"{home}.{name}"] = text
        if "." not in name:
            # messages show names as those of generated packages do
            SHOWN[f"{home}.{name}"] = name
            sys.modules[f"{home}.{name}._idlc"] = runtime
    _IMPORTER.texts[home] = ""


def _home_of(models: Models) -> str:
    """Return the package that holds the packages of models, after they are rendered if need be."""
    from idlc.generate.python.imports import Surroundings
    from idlc.generate.python.render import interface_files

    definitions = [
        (str(own.name), own.source and own.source.text, model.distro.converts_values)
        for model in models.values()
        for own in model.own
    ]
    home = f"{LOADED}.h{sha256(repr(definitions).encode()).hexdigest()[:12]}"
    if home not in _IMPORTER.texts:
        texts = dict.fromkeys(models, "")
        for package, model in models.items():
            for file in interface_files(model, Surroundings(others=f"{home}.")):
                module = file.path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
                texts[f"{package}.{module}"] = file.text
        _keep(home, texts)
    return home


def _class_in(home: str, name: ir.TypeName) -> Any:
    return getattr(import_module(f"{home}.{name.package}.{name.kind}"), class_(name))


def _class_reduction(kind: type) -> Any:
    """Return what a pickle holds of a loaded class; of one that a user derives, its name."""
    if not kind.__module__.startswith(f"{LOADED}."):
        return kind.__qualname__
    home = ".".join(kind.__module__.split(".")[:3])
    return class_from, (home, _packed(home), kind.__module__, kind.__qualname__)


@cache
def _packed(home: str) -> bytes:
    prefix = f"{home}."
    own = [name for name in _IMPORTER.texts if name.startswith(prefix)]
    texts = {name.removeprefix(prefix): _IMPORTER.texts[name] for name in own}
    return zlib.compress(json.dumps(texts).encode())


# pickles name this function
def class_from(home: str, packages: bytes, module: str, name: str) -> Any:
    """Return a class that another process has loaded."""
    _keep(home, json.loads(zlib.decompress(packages)))
    return getattr(import_module(module), name)


# what is loaded


class CompileError(ValueError):
    """Interfaces that cannot be loaded: they have errors, or do not exist."""


class LoadedPackages(ModuleType):
    """Packages that were compiled together; requested interfaces also by their own names."""

    def __init__(self, models: Models, names: Iterable[ir.TypeName]) -> None:
        super().__init__(_home_of(models), "What `idlc.load` compiled.")
        self._packages = {package: model.kinds for package, model in sorted(models.items())}
        self._interfaces = {str(class_(name)): name for name in names}

    def __getattr__(self, name: str) -> Any:
        if name in self._packages:
            for kind in self._packages[name]:
                import_module(f"{self.__name__}.{name}.{kind}")
            return import_module(f"{self.__name__}.{name}")
        if name in self._interfaces:
            return _class_in(self.__name__, self._interfaces[name])
        raise AttributeError(f"no `{name}` was loaded, but {', '.join(dir(self))}")

    def __getitem__(self, name: str) -> Any:
        """Return a class by its full name, such as "std_msgs/msg/Header"."""
        return _class_in(self.__name__, ir.TypeName(*name.split("/")))  # type: ignore[arg-type]

    def __dir__(self) -> list[str]:
        return [*self._packages, *sorted(self._interfaces)]

    def __repr__(self) -> str:
        return f"<loaded: {', '.join(dir(self))}>"


def load(what: str, *, include: Iterable[str] = (), distro: str | None = None) -> LoadedPackages:
    """Compile interfaces, and return their classes.

    `what` is a recording, a .msg, .srv or .action file, a folder of them, or the name of a type or
    package that is known here. `include` are folders in which other packages are looked for first.
    The classes can be pickled, and read wherever idlc is installed; type checkers do not know them,
    so programs are better off with `idlc gen`.
    """
    report = Report()
    models, names = _models_of(str(what), tuple(include), distro, report)
    if report.had_errors:
        from idlc.diagnostics import terminal

        raise CompileError("\n" + "\n".join(terminal.text(report)))
    return LoadedPackages(models, names)


def _models_of(
    what: str, include: tuple[str, ...], distro: str | None, report: Report
) -> tuple[Models, Iterable[ir.TypeName]]:
    """Return the models of packages, and the requested interfaces in them."""
    where = scope(Config(root=Root.here()), None, include, distro=distro)
    if is_recording(what, where.root):
        groups = versions(topics_of([what], (), where.root, report) or ())
        check_versions(groups, report)
        if len(groups) != 1:
            return {}, ()
        types = recorded_types(groups[0], LocalTypes(where, report), Report())
        report.extend(types.errors)
        return types.models, {topic.interface for topic in types.topics}
    if is_path(what, where.root):
        packages = requested_packages([what], [], "", where, report)
        names = [name for package in packages for name in package.names]
        compiler = Compiler(library_for(packages, where, report))
        for package in packages:
            compiler.add(sources_of(package, report), report)
    else:
        library, definitions = resolve(what, where, report)
        names = [definition.interface for definition in definitions]
        compiler = Compiler(library)
    if report.had_errors:
        return {}, ()
    every = Report()
    models = compiler.models(compiler.reached(names), every)
    report.extend(every.errors)
    return models, names


# the types of recorded messages


class TopicType:
    """The type of a topic's messages, compiled from what was recorded."""

    def __init__(self, models: Models, name: ir.TypeName) -> None:
        self._models = models
        self._name = name

    @cached_property
    def structure(self) -> Structure:
        """The type, field by field."""
        described = content(self._models[self._name.package])
        return Types(json.dumps(described))[str(self._name)]

    @cached_property
    def kind(self) -> Any:
        """The class of the messages."""
        return _class_in(_home_of(self._models), self._name)


def type_of(topic: Topic, include: tuple[str, ...] = ()) -> TopicType:
    """Return the type of a topic's messages.

    Warns if something else had to be used than what was recorded, or if that is not what the
    topic's publisher said it is.
    """
    topic_type, report = _type_of(topic, include, Scope(Root.here()).distro)
    for diagnostic in report:
        warnings.warn(MissingDefinitionWarning(topic.name, diagnostic.message), stacklevel=2)
    if list(report):  # the local definitions that are used instead may change
        _type_of.cache_clear()
    if topic.hash not in (None, topic_type.structure.hash):
        message = f"`{topic.name}`: the definition of {topic.type} is not that of what was recorded"
        warnings.warn(message, OtherDefinitionWarning, stacklevel=2)
    return topic_type


@lru_cache(maxsize=64)
def _type_of(topic: Topic, include: tuple[str, ...], _: Distro) -> tuple[TopicType, Report]:
    types, report = _types(topic, include)
    if not types.topics or types.errors or report.had_errors:
        problems = [*types.errors, *report]
        first = min(problems, key=lambda problem: problem.severity, default=None)
        why = first.message if first else "its type is not known"
        why = why.removeprefix(f"`{topic.name}` is left out: ")
        raise RecordingError(f"`{topic.name}` cannot be read: {why}", first and first.hint)
    return TopicType(types.models, types.topics[0].name), report


def _types(topic: Topic, include: tuple[str, ...]) -> tuple[RecordedTypes, Report]:
    where, report = Scope(Root.here(), include=include), Report()
    (version,) = versions([read_definition(topic, topic.name)])
    return recorded_types(version, LocalTypes(where, report), report), report


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
    """Return a program's class; raise RecordingError if messages are of another type."""
    try:
        class_type = structure_of(owner_of(kind))
    except (AttributeError, ImportError, KeyError, TypeError):
        hint = "leave it out, or give one that `idlc gen` made"
        raise RecordingError(f"{kind!r} is no message class of idlc", hint) from None
    if class_type.name != topic.type:
        message = f"`{topic.name}` has messages of {topic.type}, not of {class_type.name}"
        raise RecordingError(message)
    if class_type.hash != topic.hash:
        types, _ = _types(topic, include)
        digest = next(map(types.hash, types.topics), None)
        if class_type.hash != digest:
            raise RecordingError(
                f"{class_type.name} was another type when `{topic.name}` was recorded: its hash is "
                f"{digest or topic.hash or 'not known'}, that of the class is {class_type.hash}",
                "leave the class out to read what was recorded",
            )
    return kind
