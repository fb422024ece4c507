"""Commands that show what there is: `show`, `list`, `docs`, `doctor` and `explain`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import options


@click.command(
    "show",
    epilog=options.example(
        "idlc show geometry_msgs/msg/PoseStamped", "idlc show std_msgs/msg/Header --format hash"
    ),
)
@click.argument(
    "subject",
    metavar="TYPE|PATH|REC",
    type=click.Path(),
    shell_complete=options.completed("types_and_paths"),
)
@click.argument(
    "topics", metavar="[TOPIC]...", nargs=-1, shell_complete=options.completed("topics")
)
@options.output_style(
    ("text", "json", "hash", "type-description", "ros2idl", "jsonschema", "mcap", "msg"),
    "Output format. `hash` is the type hash (RIHS01), `type-description` the JSON file that ROS 2 "
    "installs, `ros2idl` an IDL file, `jsonschema` a JSON Schema, and `mcap` the text that an MCAP "
    "file contains for this type. `msg` writes the recorded definitions as files (see --out).",
)
@click.option(
    "-o",
    "--out",
    metavar="DIR",
    type=click.Path(file_okay=False),
    help="With --format msg, the folder to write a recording's .msg, .srv, .action and .idl files "
    "to, with one folder for each package.",
)
@options.scoped(options.package, options.include, options.exclude, options.distro)
def show_command(**arguments: Any) -> None:
    """Show an interface with its nested messages and all comments.

    TYPE is a name such as std_msgs/msg/Header, PATH is a file or folder, and REC is a recording.

    For a recording, idlc lists each topic with its type, message count and type hash, and shows
    whether the type that `idlc list` finds is the same. With TOPIC, it shows the recorded
    definitions of these topics.

    REC can also be the address of a robot: `dds` (the nodes on this machine), dds/192.168.1.20 or,
    with Zenoh, tcp/robot:7447. idlc lists the robot's
    topics, services and actions, and the nodes that use them. It also reports incompatible
    endpoints.

    With --format hash, idlc prints the hash of the type. For a service or action, it also prints
    the hashes of its messages, such as the request.
    """
    from idlc.cli.run.show import run

    return run(**arguments)


@click.command("list", epilog=options.example("idlc list std_msgs"))
@click.argument(
    "packages", metavar="[PACKAGE]...", nargs=-1, shell_complete=options.completed("packages")
)
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
@click.argument("code", metavar="[CODE]", required=False, shell_complete=options.completed("codes"))
def explain_command(**arguments: Any) -> int:
    """Explain a problem that idlc reports, with a bad and a good example.

    CODE is an id such as IDL201 or a name such as unknown-type. Without CODE, idlc lists all
    codes.
    """
    from idlc.cli.run.look import explain

    return explain(**arguments)


MEMBERS = (show_command, list_command, docs_command, doctor_command, explain_command)
