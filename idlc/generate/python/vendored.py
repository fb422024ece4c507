"""Types of other packages that come with a generated package, and its module `vendor`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import msgspec

from idlc.generate.python.imports import VENDORED
from idlc.generate.python.render import interface_files, template
from idlc.generate.templates import Code, RenderedFile
from idlc.model import derive, link


class CopyView(msgspec.Struct, frozen=True):
    """The types of another package that come with a package.

    `hashes` are of structures, each after its kind and name, such as `msg/Header`.
    """

    name: Code
    kinds: tuple[Code, ...]
    hashes: tuple[tuple[Code, Code], ...]


def vendored_files(package: str, copies: Sequence[link.Model]) -> Iterator[RenderedFile]:
    """Yield the files that a package needs to come with types of others."""
    if not copies:
        return
    views = tuple(map(_view, copies))
    text = template("message/vendor.py.jinja").render(package=Code(package), copies=views)
    yield RenderedFile("vendor/__init__.py", text)
    yield RenderedFile("_vendor/__init__.py", '"""Copies of types: import them from `vendor`."""\n')
    for model, view in zip(copies, views, strict=True):
        for file in interface_files(model, VENDORED):
            yield RenderedFile(f"_vendor/{view.name}/{file.path}", file.text)
        text = template("message/vendor_copy.py.jinja").render(copy=view)
        yield RenderedFile(f"_vendor/{view.name}/__init__.py", text)
        text = template("message/vendor_package.py.jinja").render(copy=view)
        yield RenderedFile(f"vendor/{view.name}/__init__.py", text)
        for kind in view.kinds:
            text = template("message/vendor_kind.py.jinja").render(copy=view, kind=kind)
            yield RenderedFile(f"vendor/{view.name}/{kind}.py", text)


def _view(model: link.Model) -> CopyView:
    names = [section.name for own in model.own for section in derive.sections(own)]
    return CopyView(
        Code(model.package),
        tuple(map(Code, model.kinds)),
        tuple(
            (Code(f"{name.kind}/{name.name}"), Code(model.describer.hash(str(name))))
            for name in names
        ),
    )
