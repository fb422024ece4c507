"""Shell completion of words that are not options: types, packages, codes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem


def packages(context: click.Context, _: click.Parameter, word: str) -> list[str]:
    """Offer packages."""
    from idlc.cli import candidates

    return candidates.packages(word, _include(context), context.params.get("distro"))


def types_and_paths(
    context: click.Context, _: click.Parameter, word: str
) -> list[CompletionItem[str]]:
    """Offer types and, in the shell's own way, files."""
    from idlc.cli import candidates

    names = candidates.types(word, _include(context), distro=context.params.get("distro"))
    # bash forgets items before files
    return [_item(word, "file"), *map(_item, names)]


def topics(context: click.Context, _: click.Parameter, word: str) -> list[str]:
    """Offer the topics of the recordings that were typed."""
    from idlc.cli import candidates

    typed: Any = context.params.get("paths") or (context.params.get("subject"),)
    # arguments before an option without its value are not parsed
    return candidates.topics(word, [path for path in (*typed, *context.args) if path])


def endpoint(context: click.Context, option: click.Parameter, word: str) -> list[str]:
    """Offer the types that an endpoint of a node can have; the topic is the user's."""
    from idlc.cli import candidates
    from idlc.scaffold.roles import ROLES

    kinds = [role.kind for role in ROLES if role.name == option.name and role.kind]
    return candidates.types(word, _include(context), kinds, bare="own")


def templates(_: click.Context, __: click.Parameter, word: str) -> list[str]:
    """Offer the templates that a user can replace."""
    from idlc.scaffold.templates import names

    return [name for name in names() if name.startswith(word)]


def codes(_: click.Context, __: click.Parameter, word: str) -> list[CompletionItem[str]]:
    """Offer the ids and names of codes."""
    from idlc.diagnostics.codes import CODES

    ids = [_item(code.id, about=code.slug) for code in CODES.values()]
    names = [_item(code.slug, about=code.id) for code in CODES.values()]
    return [item for item in (*ids, *names) if item.value.startswith(word)]


def rules(context: click.Context, option: click.Parameter, word: str) -> list[CompletionItem[str]]:
    """Offer the next names in a list of rules."""
    from idlc.diagnostics.codes import CATEGORIES

    before, comma, last = word.rpartition(",")
    groups = [_item(name) for name in ("all", *CATEGORIES) if name.startswith(last)]
    return [
        _item(f"{before}{comma}{item.value}", about=item.help)
        for item in (*groups, *codes(context, option, last))
    ]


def distros(_: click.Context, __: click.Parameter, word: str) -> list[str]:
    """Offer the next names in a list of distributions."""
    from idlc.model.distros import BY_NAME

    before, comma, last = word.rpartition(",")
    return [f"{before}{comma}{name}" for name in BY_NAME if name.startswith(last)]


def _include(context: click.Context) -> tuple[str, ...]:
    folders: Any = context.params.get("include")
    return tuple(folders or ())


def _item(value: str, kind: str = "plain", about: str | None = None) -> CompletionItem[str]:
    from click.shell_completion import CompletionItem  # only shells need it

    return CompletionItem(value, kind, about)
