"""Where something is defined, and where it is used."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from idlc.diagnostics.source import Span
from idlc.driver.workspace import State
from idlc.lsp.elements import Element, elements, spot
from idlc.lsp.features import manifest
from idlc.lsp.protocol.parts import AskedReferences, AtPosition, Location, Part, Range
from idlc.lsp.users import text_of, users
from idlc.lsp.world import Known, World
from idlc.model import ir

_READ, _WRITE = 2, 3


class Highlight(Part, frozen=True):
    """A range that is about the same thing as the cursor's; `kind` 3 is where it is defined."""

    range: Range
    kind: int


class Thing(NamedTuple):
    """What a place is about: a definition, or the interface of that name."""

    known: Known
    name: ir.TypeName
    element: Element | None


def thing(world: World, asked: AtPosition) -> Thing | None:
    """Return what a position is about; between definitions, that is the file's interface."""
    known = world.known(asked.text_document.uri)
    if known is None:
        return None
    found = spot(world, known, asked.position)
    if found is None or found.part == "comment":
        return Thing(known, known.interface.name, None)
    if found.part == "type":
        target = found.element.target
        return Thing(known, target, None) if target else None
    return Thing(known, known.interface.name, found.element)


def definition(world: World, asked: AtPosition) -> Location | None:
    """Return where the thing at a position is defined."""
    if package := manifest.named(world, asked):
        return manifest.definition(package, world)
    found = thing(world, asked)
    if found is None:
        return None
    if found.element is not None:
        return world.location(found.element.name, found.known.state)
    return top(found.name, found.known.state, world)


def type_definition(world: World, asked: AtPosition) -> Location | None:
    """Return where the type of the field at a position is defined."""
    found = thing(world, asked)
    if found is None:
        return None
    target = found.element.target if found.element else found.name
    return top(target, found.known.state, world) if target else None


def top(name: ir.TypeName, state: State, world: World) -> Location | None:
    """Return the beginning of the file of an interface."""
    source = text_of(name, state)
    return world.location(Span(source, 0, 0), state) if source else None


def references(world: World, asked: AskedReferences) -> list[Location]:
    """Return where the thing at a position is used, in all folders, and where it is defined."""
    if package := manifest.named(world, asked):
        return manifest.references(package, asked, world)
    found = thing(world, asked)
    if found is None:
        return []
    if found.element is not None:
        spans = list(mentions(found.element, found.known))
        if not asked.context.include_declaration:
            del spans[0]
        return [world.location(span, found.known.state) for span in spans]
    first = top(found.name, found.known.state, world)
    declared = [first] if first and asked.context.include_declaration else []
    state, path = found.known.state, found.known.state.path_of(found.known.source)
    used = [world.location(span, one) for one, span in users(found.name, state, world)]
    project = world.projects.of(path)
    span = project.workspace.declaration(path, found.name.package) if project else None
    used += [world.location(span, state)] if span else []
    return list(dict.fromkeys((*declared, *used)))


def mentions(element: Element, known: Known) -> Iterator[Span]:
    """Yield where a field or constant is defined, and where comments of its file name it.

    A constant is named by its name. Fields are called like words, so they count in backticks only.
    """
    yield element.name
    name = re.escape(element.body.name.text)
    if not name:
        return
    is_constant = isinstance(element.meaning, ir.Constant)
    pattern = re.compile(rf"\b{name}\b" if is_constant else rf"(?<=`){name}(?=`)")
    for span in comments(known):
        for match in pattern.finditer(span.text):
            yield span.at(*match.span())


def comments(known: Known) -> Iterator[Span]:
    """Yield every comment of a file."""
    from idlc.syntax.parse import parse

    for section in parse(known.source).sections:
        for line in section.lines:
            if line.comment:
                start = line.start + len(line.code)
                yield Span(known.source, start, start + len(line.comment))


def highlights(world: World, asked: AtPosition) -> list[Highlight]:
    """Return the places of the document that are about the thing at a position."""
    found = thing(world, asked)
    if found is None:
        return []
    if found.element is not None:
        first, *others = mentions(found.element, found.known)
        places = [Highlight(world.range(span), _READ) for span in others]
        return [Highlight(world.range(first), _WRITE), *places]
    return [
        Highlight(world.range(one.type), _READ)
        for one in elements(found.known.source, found.known.interface)
        if one.target == found.name
    ]
