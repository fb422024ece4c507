"""Commands that show what there is: `list`, `docs`, `doctor` and `explain`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import completion, options


@click.command("list", epilog=options.example("idlc list std_msgs"))
@click.argument("packages", metavar="[PACKAGE]...", nargs=-1, shell_complete=completion.packages)
@options.scoped(options.include, options.distro)
@options.style
def list_command(**arguments: Any) -> None:
    """List the packages that idlc can find, or the interfaces in each PACKAGE.

    idlc searches the working folder, the -I folders and the folders in AMENT_PREFIX_PATH. The
    standard packages of each distribution are a part of idlc.
    """
    from idlc.cli.run.look import list_names

    return list_names(**arguments)


@click.command("docs", epilog=options.example(*options.DEMO, "idlc docs demo -o site"))
@click.argument("paths", metavar="[PATH|PACKAGE|TYPE]...", nargs=-1, type=click.Path())
@click.option("-o", "--out", metavar="DIR", required=True, type=click.Path(), help="Output folder.")
@options.scoped(options.package, options.include, options.exclude, options.distro)
def docs_command(**arguments: Any) -> str:
    """Generate a static HTML site that describes interfaces and links their types.

    The site also shows units, constants and type hashes, and has a search. It needs no server and
    loads nothing from other hosts. PACKAGE and TYPE are names, as in
    `idlc gen`.
    """
    from idlc.cli.run.look import write_docs

    return write_docs(**arguments)


@click.command("doctor", epilog=options.example("idlc doctor"))
@options.scoped(options.include, options.distro, despite_errors=True)
@options.style
def doctor_command(**arguments: Any) -> None:
    """Check the installed programs, ROS 2 and packages.

    Each line begins with `ok` or `warn`, and a hint follows each warning. Attach the
    output of `--format json` to bug reports.
    """
    from idlc.cli.run.look import doctor

    return doctor(**arguments)


@click.command("explain", epilog=options.example("idlc explain wide-string"))
@click.argument("code", metavar="[CODE]", required=False, shell_complete=completion.codes)
def explain_command(**arguments: Any) -> int:
    """Explain a problem that idlc reports, with a bad and a good example.

    CODE is an id such as IDL201 or a name such as unknown-type. Without CODE, idlc lists all
    codes.
    """
    from idlc.cli.run.look import explain

    return explain(**arguments)


MEMBERS = (list_command, docs_command, doctor_command, explain_command)
