"""Groups of commands that are known by name, and imported when they are asked for."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import click


class LazyGroup(click.Group):
    """A group of commands, each with its line in the overview.

    The module of a command is `modules` with its name; `meant` are words of other tools, each with
    the command that is suggested for it.
    """

    def __init__(
        self,
        *args: Any,
        overview: Mapping[str, str],
        modules: str,
        meant: Mapping[str, str] | None = None,
        **more: Any,
    ) -> None:
        super().__init__(*args, **more)
        self._overview = overview
        self._modules = modules
        self._meant = meant or {}

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the names in the order in which people need them."""
        return list(self._overview)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Return a command by name; this imports it."""
        if cmd_name not in self._overview:
            return None
        command: click.Command = import_module(f"{self._modules}{cmd_name}").command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that is asked for; suggest one for a name that there is not."""
        name = args[0]
        unknown = name not in self._overview and not name.startswith("-")
        if unknown and not ctx.resilient_parsing:
            raise click.UsageError(f"no such command: {name!r}; {self._hint(name)}", ctx)
        return super().resolve_command(ctx, args)

    def _hint(self, name: str) -> str:
        from idlc.diagnostics.suggest import did_you_mean

        known = self._meant.get(name.lower())
        close = f"did you mean `{known}`?" if known else did_you_mean(name, self._overview)
        return close or f"the commands are {', '.join(self._overview)}"

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """Write the overview without importing any command."""
        with formatter.section("Commands"):
            formatter.write_dl(list(self._overview.items()))
