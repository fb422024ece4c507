"""The part of docs/command-line.md that comes from the commands themselves."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator

import click

from idlc.cli.app import app
from tests.support.paths import DOCS

PAGE = DOCS / "command-line.md"
#: The options that the page describes once. Some commands have another option of such a name.
COMMON = ("--package", "--include", "--exclude", "--distro", "--format")
_PART = re.compile(r"(?<=<!-- commands -->\n).*?(?=<!-- end -->)", re.DOTALL)


def written(text: str) -> str:
    """Return the page with its generated part made anew."""
    sections = "\n".join(line for command in commands() for line in _section(*command))
    text, count = _PART.subn(lambda _: f"\n{sections}\n", text)
    assert count == 1
    return text


def commands(
    group: click.Group = app, context: click.Context | None = None
) -> Iterator[tuple[click.Command, click.Context]]:
    """Yield every command that does something, in the order of the overview."""
    context = context or click.Context(app, info_name="idlc")
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        inner = click.Context(command, info_name=name, parent=context)
        if isinstance(command, click.Group):
            yield from commands(command, inner)
        else:
            yield command, inner


def _section(command: click.Command, context: click.Context) -> Iterator[str]:
    yield f"## {context.command_path}"
    yield ""
    words = (word for param in command.params for word in param.get_usage_pieces(context))
    yield f"    {' '.join([context.command_path, '[OPTIONS]', *words])}"
    yield ""
    yield from _prose(command.help or "")
    records = [param.get_help_record(context) for param in command.params if _is_option(param)]
    common = [record for record in records if record and _is_common(*record)]
    rows = [_row(record) for record in records if record and record not in common]
    if rows:
        yield from ("| option | |", "|---|---|", *rows, "")
    if common:
        names = ", ".join(f"`{names}`" for names, _ in common)
        yield f"[Common options](#common-options): {names}."
        yield ""
    yield from _prose(command.epilog or "")


def _is_option(param: click.Parameter) -> bool:
    return isinstance(param, click.Option)


def _is_common(names: str, text: str) -> bool:
    name = names.rpartition(", ")[2].split()[0]
    return name in COMMON and (name != "--format" or text.startswith("Output format.  ["))


def _row(record: tuple[str, str]) -> str:
    names, help_ = (" ".join(text.split()).replace("|", r"\|") for text in record)
    return f"| `{names}` | {help_} |"


def _prose(text: str) -> Iterator[str]:
    """Yield paragraphs, each on one line, and as code what click leaves as it is."""
    for paragraph in inspect.cleandoc(text).split("\n\n"):
        lines = paragraph.splitlines()
        if lines[:1] == ["\b"]:
            yield from (f"    {line.removeprefix('  ')}".rstrip() for line in lines[1:])
        elif lines:
            yield " ".join(line.strip() for line in lines)
        yield ""
