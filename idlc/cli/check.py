"""`idlc check`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import completion, options


@click.command("check", epilog=options.example(*options.DEMO, "idlc check demo"))
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=click.Path())
@click.option(
    "--select",
    metavar="RULE,...",
    shell_complete=completion.rules,
    help="Only these: categories, codes, their names, `all`.",
)
@click.option("--ignore", metavar="RULE,...", shell_complete=completion.rules, help="Not these.")
@click.option("--fix", is_flag=True, help="Fix what can be fixed without harm.")
@click.option("--strict", is_flag=True, help="Fail on warnings as well.")
@click.option("--statistics", is_flag=True, help="Show only how often each rule was broken.")
@click.option(
    "--prefix",
    metavar="DIR",
    type=click.Path(),
    help="Look at what is installed in a folder instead: whether C++ tools can load it.",
)
@options.packages
@options.distros
@options.report_style
def command(paths: tuple[str, ...], **arguments: Any) -> int:
    """Report every problem of interface files and of the packages around them.

    PATH is a folder of packages, a package folder, a folder of interface files, or a .msg, .srv
    or .action file; without it, `paths` in pyproject.toml, or the working folder.

    For several distributions, each problem is reported once, with those for which it holds.

    Categories of rules are correctness, portability, style and package; `idlc explain` knows each.
    """
    from idlc.check.select import is_selector
    from idlc.cli.direct import check_paths

    for word in f"{arguments['select'] or ''},{arguments['ignore'] or ''}".split(","):
        if word and not is_selector(word):
            from idlc.diagnostics.codes import CATEGORIES, CODES
            from idlc.diagnostics.text import did_you_mean

            hint = did_you_mean(word, (*CATEGORIES, *(code.slug for code in CODES.values())))
            hint = hint or "`idlc explain` lists the codes"
            raise click.UsageError(f"{word!r} means no rule; {hint}")
    if arguments["prefix"] is not None and (paths or arguments["fix"]):
        raise click.UsageError("--prefix looks at what is installed, without PATH and --fix")
    return check_paths(paths, **arguments)
