"""Packages generated for a test, and imported as if nothing else were installed."""

import ast
import importlib
import json
import sys
from contextlib import contextmanager
from typing import NamedTuple

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.generate.python.render import render_package
from idlc.language.parse import parse
from idlc.model import catalog, derive, ir
from idlc.model.distros import DEFAULT, Distro
from idlc.model.link import link
from idlc.model.lowering.lower import lower
from tests.support.paths import GOLDEN

RECORDED = GOLDEN / "rosidl" / "interfaces"


class BuiltIn(NamedTuple):
    """The catalogue of a distribution as the library of a model."""

    distro: Distro

    def source(self, name):
        return catalog.source(name, self.distro)

    def names(self, package):
        return catalog.names(package, self.distro)

    def packages(self):
        return catalog.packages(self.distro)

    def nearby(self, _package):
        return None

    def idl_file(self, _name):
        return None


def model_of(package, files, distro=DEFAULT):
    """Return the model of a package from texts by path, such as `msg/Pose.msg`."""
    report = Report()
    own = []
    for path, text in sorted(files.items()):
        kind, file = path.split("/")
        name = ir.TypeName(package, kind, file.partition(".")[0])
        own.append(lower(parse(Source(path, text)), name, report))
    model = link(package, own, BuiltIn(distro), report)
    assert not report.had_errors, [(d.code, d.message, d.where) for d in report]
    return model


def files_of(folder):
    """Return the interface files below a folder by path."""
    return {
        path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8")
        for path in sorted(folder.glob("*/*.*"))
    }


def catalog_files():
    """Return the catalogue's interfaces: package to texts by path."""
    found = {}
    for name in catalog.interfaces():
        text = catalog.source(name).text
        found.setdefault(name.package, {})[f"{name.kind}/{name.name}.{name.kind}"] = text
    return found


def structures(name):
    """Return the full names of the messages of an interface of the catalogue."""
    report = Report()
    own = lower(parse(catalog.source(name)), name, report)
    link(name.package, [own], catalog, report)
    return [str(message.name) for message in derive.messages(own)]


def write_package(folder, package, files):
    """Generate a package into `folder`/`package`."""
    write_model(folder, model_of(package, files))


def write_model(folder, model):
    """Generate a model's package into `folder`."""
    for file in render_package(model):
        target = folder / model.package / file.path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(file.text, encoding="utf-8")


def type_data(package):
    """Return what a generated package says of its types, read without importing it."""
    text = (package / "_type_data.py").read_text(encoding="utf-8")
    docstring, data = ast.parse(text).body  # there is nothing else
    assert isinstance(ast.literal_eval(docstring.value), str)
    return json.loads(ast.literal_eval(data.value))


@contextmanager
def importable(folder):
    """Put the packages in a folder before all others, and forget them afterwards."""
    names = {path.name for path in folder.iterdir()}

    def forget():
        mine = [name for name in sys.modules if name.partition(".")[0] in names]
        return {name: sys.modules.pop(name) for name in mine}

    before = forget()
    sys.path.insert(0, str(folder))
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        forget()
        sys.modules.update(before)


def class_of(name):
    """Return a class by its full name, package/kind/Name."""
    package, kind, short = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), short)
