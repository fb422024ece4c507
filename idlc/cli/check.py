"""Commands that hooks and editors start: `check`, `fmt` and `lsp`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options


@click.command("check", epilog=options.example(*options.DEMO, "idlc check demo"))
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=click.Path())
@click.option(
    "--select",
    metavar="RULE,...",
    shell_complete=options.completed("rules"),
    help="Enable only these rules, by category, code or name; `all` enables every rule.",
)
@click.option(
    "--ignore",
    metavar="RULE,...",
    shell_complete=options.completed("rules"),
    help="Disable these rules.",
)
@click.option("--fix", is_flag=True, help="Apply safe fixes.")
@click.option(
    "--diff", is_flag=True, help="Show the changes that --fix would make, and write nothing."
)
@click.option("--strict", is_flag=True, help="Also fail on warnings.")
@click.option(
    "--ament",
    "prefix",
    metavar="PREFIX",
    type=click.Path(),
    help="Do not check PATH, but only whether C++ tools such as ros2 bag can load the packages "
    "that are installed in the folder PREFIX.",
)
@options.packages
@options.distros
@options.report_style
def check_command(paths: tuple[str, ...], **arguments: Any) -> int:
    """Check interface files and the packages that contain them.

    PATH is a file or folder. If PATH is a package.xml, CMakeLists.txt, setup.py, setup.cfg or
    pyproject.toml, idlc checks the package that the file belongs to. Without PATH, idlc checks the
    `paths` in pyproject.toml. If `paths` is not set, idlc checks the working folder.

    If you name several distributions with --distro, idlc reports each problem once, with the
    distributions that it affects.

    The categories of rules are correctness, portability, style and package. `idlc explain` lists
    all rules.
    """
    from idlc.check.select import is_selector, similar_selector
    from idlc.cli.run.check import check_paths

    for word in f"{arguments['select'] or ''},{arguments['ignore'] or ''}".split(","):
        if word and not is_selector(word):
            raise click.UsageError(f"{word!r} is not a rule; {similar_selector(word)}")
    if arguments["prefix"] is not None and (paths or arguments["fix"] or arguments["diff"]):
        raise click.UsageError("--ament checks an install prefix; omit PATH, --fix and --diff")
    if arguments["diff"] and arguments["style"] != "text":
        raise click.UsageError("--diff writes text; omit --format")
    return check_paths(paths, **arguments)


@click.command(
    "fmt",
    epilog=options.example(
        "mkdir -p demo/msg",
        "echo 'float64   speed 0.5# [m/s]' > demo/msg/Drive.msg",
        "idlc fmt demo",
    ),
)
@click.argument("paths", metavar="[PATH]...", nargs=-1, type=click.Path())
@click.option("--check", is_flag=True, help="Write nothing; fail if a file would change.")
@click.option(
    "--diff", is_flag=True, help="Write nothing; show the changes and fail if there are any."
)
@options.exclude
def fmt_command(**arguments: Any) -> int:
    """Normalize whitespace and keep deliberate alignment.

    A gap of several spaces stays if it aligns names or comments in a column, or if every line of a
    block has it. (Empty lines separate blocks.) If the lines above and below a line are aligned,
    idlc aligns that line with them. Every other gap becomes one space, or two spaces before a
    comment. A `=` with a space on one side gets one on the other side, too. idlc keeps at most two
    consecutive empty lines. If one of these rules changes a file, idlc also removes trailing
    whitespace and adds a missing final newline.

    Formatting never changes the meaning of a file. idlc skips files with syntax errors. PATH works
    as in `idlc check`.
    """
    from idlc.cli.run.fmt import run

    return run(**arguments)


@click.command("lsp", epilog=options.example("idlc lsp --check"))
@click.option("--check", is_flag=True, help="Print the server's capabilities as JSON, and exit.")
def lsp_command(check: bool) -> int:
    """Run the language server on standard input and output. Your editor starts it.

    The server implements the Language Server Protocol 3.17. It reads [tool.idlc] and the editor's
    settings. The language id of .msg, .srv and .action files is `rosmsg`.
    """
    from idlc.cli.run.lsp import serve_editor, show_capabilities

    return show_capabilities() if check else serve_editor()


MEMBERS = (check_command, fmt_command, lsp_command)
