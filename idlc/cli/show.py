"""`idlc show`."""

from __future__ import annotations

from typing import Any

import click

from idlc.cli import completion, options


@click.command(
    "show",
    epilog=options.example(
        "idlc show geometry_msgs/msg/PoseStamped", "idlc show std_msgs/msg/Header --format hash"
    ),
)
@click.argument(
    "subject", metavar="TYPE|PATH|REC", type=click.Path(), shell_complete=completion.types_and_paths
)
@click.argument("topics", metavar="[TOPIC]...", nargs=-1, shell_complete=completion.topics)
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
def command(**arguments: Any) -> None:
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
