"""Shell completion of words that are not options; what is offered is loaded when a shell asks."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

import click

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

Candidates: TypeAlias = "list[str] | list[CompletionItem[str]]"
Offer: TypeAlias = Callable[[click.Context, click.Parameter, str], Candidates]


def _offer(name: str) -> Offer:
    """Return the function of `run/completion.py`."""

    def offer(context: click.Context, parameter: click.Parameter, word: str) -> Candidates:
        from idlc.cli.run import completion

        words: Candidates = getattr(completion, name)(context, parameter, word)
        return words

    return offer


packages = _offer("packages")
types_and_paths = _offer("types_and_paths")
topics = _offer("topics")
topics_and_paths = _offer("topics_and_paths")
robot_names = _offer("robot_names")
robot_fields = _offer("robot_fields")
endpoint = _offer("endpoint")
codes = _offer("codes")
rules = _offer("rules")
distros = _offer("distros")
