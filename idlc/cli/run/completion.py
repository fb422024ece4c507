"""The words that a shell offers: names only, nothing is parsed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

import click

from idlc.diagnostics.codes import CATEGORIES, CODES
from idlc.diagnostics.report import Report
from idlc.model import ir
from idlc.model.distros import BY_NAME
from idlc.model.ir import KINDS
from idlc.project.inputs import nearby_packages
from idlc.project.library import Library
from idlc.project.root import Root
from idlc.project.settings import scope, settings_here
from idlc.project.words import split_recordings

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from idlc.robot.session import Session


def packages(context: click.Context, _: click.Parameter, word: str) -> list[str]:
    """Offer packages."""
    return [name for name in _library(context).packages() if name.startswith(word)]


def types_and_paths(
    context: click.Context, _: click.Parameter, word: str
) -> list[CompletionItem[str]]:
    """Offer types and, in the shell's own way, files."""
    library = _library(context)
    # bash forgets items before files
    return [_item(word, "file"), *map(_item, _types(word, library, KINDS, library.packages()))]


def topics(context: click.Context, _: click.Parameter, word: str) -> list[str]:
    """Offer the topics of the recordings that were typed."""
    from idlc.api.sources import read_source

    typed: Any = context.params.get("paths") or (context.params.get("subject"),)
    # arguments before an option without its value are not parsed
    paths = [path for path in (*typed, *context.args) if path]
    root = Root.here()
    words = split_recordings(paths, root)[0]
    recordings = filter(None, (read_source(path, root, Report()) for path in words))
    names = {topic.topic.name for recording in recordings for topic in recording.topics}
    return sorted(name for name in names if name.startswith(word))


def topics_and_paths(
    context: click.Context, parameter: click.Parameter, word: str
) -> list[CompletionItem[str]]:
    """Offer topics and, in the shell's own way, files."""
    return [_item(word, "file"), *map(_item, topics(context, parameter, word))]


#: Seconds that a shell waits for a robot.
ROBOT_TIMEOUT = 1.0


def _robot(context: click.Context) -> AbstractContextManager[Session | None]:
    """Return a session with the robot that was typed; `None` if it does not answer soon."""
    from idlc.robot.live.connect import connected

    address = context.params.get("address") or next(iter(context.args), "")
    return connected(str(address), Report(), ROBOT_TIMEOUT)


def robot_names(
    context: click.Context, parameter: click.Parameter, word: str
) -> list[CompletionItem[str]]:
    """Offer the topics or services of the robot that was typed, by the name of the parameter."""
    from idlc.robot.keys import EntityKind
    from idlc.robot.live.connect import TOPICS, robot_entities

    kinds = (EntityKind.SERVICE,) if parameter.name == "service" else TOPICS
    with _robot(context) as session:
        entities = robot_entities(session, *kinds) if session else []
    names = dict.fromkeys(end.name for end in entities)
    return [_item(name) for name in names if name.startswith(word)]


def robot_fields(
    context: click.Context, _: click.Parameter, word: str
) -> list[CompletionItem[str]]:
    """Offer the fields of the request of the service that was typed."""
    from idlc.cli.messages import field_words
    from idlc.robot.keys import EntityKind
    from idlc.robot.live.traffic import find_version

    name, kind = str(context.params.get("service") or ""), None
    with _robot(context) as session:
        if session:
            kind = find_version(session, name, [EntityKind.SERVICE], Report())[0]
    return [_item(each) for each in field_words(kind.Request, word)] if kind else []


def endpoint(context: click.Context, option: click.Parameter, word: str) -> list[str]:
    """Offer the types that an endpoint of a node can have; the topic is the user's."""
    from idlc.scaffold.roles import ROLES

    kinds = [role.kind for role in ROLES if role.name == option.name and role.kind]
    return _types(word, _library(context), kinds, list(nearby_packages(Root.here())))


def codes(_: click.Context, __: click.Parameter, word: str) -> list[CompletionItem[str]]:
    """Offer the ids and names of codes."""
    names = {code.id: code.slug for code in CODES.values()}
    names |= {slug: id_ for id_, slug in names.items()}
    return [_item(name, about=about) for name, about in names.items() if name.startswith(word)]


def rules(context: click.Context, option: click.Parameter, word: str) -> list[CompletionItem[str]]:
    """Offer the next names in a list of rules."""
    before, comma, last = word.rpartition(",")
    groups = [_item(name) for name in ("all", *CATEGORIES) if name.startswith(last)]
    return [
        _item(f"{before}{comma}{item.value}", about=item.help)
        for item in (*groups, *codes(context, option, last))
    ]


def distros(_: click.Context, __: click.Parameter, word: str) -> list[str]:
    """Offer the next names in a list of distributions."""
    before, comma, last = word.rpartition(",")
    return [f"{before}{comma}{name}" for name in BY_NAME if name.startswith(last)]


def _types(word: str, library: Library, kinds: Sequence[ir.Kind], bare: Sequence[str]) -> list[str]:
    """Return the types that a word begins, written as it is.

    `package/Name` and `package/kind/Name` are both known, and so are names without a package of
    types in the packages `bare`.
    """
    package, slash, rest = word.partition("/")
    if slash:
        return sorted(_within(package, rest, library, kinds))
    named = {
        interface.name
        for name in bare
        for interface in library.interfaces(name)
        if word and interface.kind in kinds and interface.name.startswith(word)
    }
    holding = [
        name
        for name in library.packages()
        if name.startswith(word)
        and any(interface.kind in kinds for interface in library.interfaces(name))
    ]
    if len(holding) == 1 and not named:
        return sorted(_within(holding[0], "", library, kinds))
    return [*sorted(named), *(f"{name}/" for name in holding)]


def _within(package: str, rest: str, library: Library, kinds: Sequence[ir.Kind]) -> Iterator[str]:
    """Yield the types of a package that begin with `rest`, with their kind if it names one."""
    for interface in library.interfaces(package):
        full = f"{interface.kind}/{interface.name}"
        if interface.kind in kinds:
            if interface.name.startswith(rest):
                yield f"{package}/{interface.name}"
            elif full.startswith(rest):
                yield f"{package}/{full}"


def _library(context: click.Context) -> Library:
    """Return the library that the options mean, for the distribution in the settings by default."""
    settings, report = settings_here()
    root = settings.root
    distro = context.params.get("distro")
    name = distro if distro in BY_NAME else None
    selected = scope(settings, distro=name).distro
    include = context.params.get("include") or ()
    return Library(include, root, report, own=nearby_packages(root), distro=selected)


def _item(value: str, kind: str = "plain", about: str | None = None) -> CompletionItem[str]:
    from click.shell_completion import CompletionItem  # only shells need it

    return CompletionItem(value, kind, about)
