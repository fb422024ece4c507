"""Packages of generated classes that are kept in memory, and can be imported and pickled."""

from __future__ import annotations

import copyreg
import json
import sys
import zlib
from collections.abc import Iterator, Mapping
from functools import cache
from hashlib import sha256
from importlib import import_module
from importlib.abc import ExecutionLoader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

from idlc import runtime
from idlc.model import ir
from idlc.model.link import Model
from idlc.model.python_names import class_
from idlc.runtime.message import SHOWN, InterfaceMeta

ModelsByName = dict[str, Model]

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


def home_of(models: ModelsByName) -> str:
    """Return the package that holds the packages of models, after they are rendered if need be."""
    definitions = [
        (str(own.name), own.source and own.source.text, model.distro.converts_values)
        for model in models.values()
        for own in model.own
    ]
    home = f"{LOADED}.h{sha256(repr(definitions).encode()).hexdigest()[:12]}"
    if home not in _IMPORTER.texts:
        texts = dict.fromkeys(models, "")
        for package, model in models.items():
            for module, text in _modules(model, f"{home}."):
                texts[f"{package}.{module}"] = text
        _keep(home, texts)
    return home


def is_kept(module: str) -> bool:
    """Return whether a module can be imported from memory."""
    return module in _IMPORTER.texts


def keep_as_named(model: Model) -> None:
    """Make a package importable under its own name, as other packages are for its classes."""
    package = model.package
    _IMPORTER.texts[package] = ""
    sys.modules[f"{package}._idlc"] = runtime
    for module, text in _modules(model):
        _IMPORTER.texts[f"{package}.{module}"] = text


def _modules(model: Model, others: str = "") -> Iterator[tuple[str, str]]:
    """Yield the modules of a package by dotted name; `others` is before the names of others."""
    from idlc.generate.python.imports import Surroundings  # classes that are kept need no templates
    from idlc.generate.python.render import interface_files

    for file in interface_files(model, Surroundings(others=others, enums="none")):
        path = file.path.removesuffix(".py").removesuffix("/__init__")
        yield path.replace("/", "."), file.text


def find_spec(module: str) -> ModuleSpec | None:
    """Return the spec of a module in memory."""
    spec: ModuleSpec | None = _IMPORTER.find_spec(module)
    return spec


def class_in(home: str, name: ir.TypeName) -> Any:
    """Return the class of an interface in the package `home`."""
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
