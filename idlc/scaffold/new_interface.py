"""A new interface file, from the fields given on the command line."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from idlc.model import names

SEPARATOR = "---"
#: The folder of what is installed for ROS 2's tools only.
RESOURCE = "resource"


def check_name(name: str) -> str:
    """Return an interface's name if it can be one."""
    if not names.is_message_name(name) or "_" in name:
        raise ValueError(f"`{name}` cannot be an interface: {names.MESSAGE_HINT}")
    return name


def text(kind: str, fields: Sequence[str], comment: str = "") -> str:
    """Return the text of an interface file; without fields, all parts are empty."""
    parts: list[list[str]] = [[]]
    for field in fields:
        if field.strip() == SEPARATOR:
            parts.append([])
        else:
            parts[-1].append(field.strip())
    wanted = {"msg": 1, "srv": 2, "action": 3}[kind]
    if len(parts) > wanted:
        rule = f"a .{kind} file has {wanted} part{'s' * (wanted > 1)}"
        raise ValueError(f"{rule}, here are {len(parts)}: there is one `---` too many")
    if fields and len(parts) < wanted:
        rest = {"srv": "the response", "action": "the result and the feedback"}[kind]
        raise ValueError(
            f"a .{kind} file has {wanted} parts: add `---` before the fields of {rest}"
        )
    parts += [[] for _ in range(wanted - len(parts))]
    head = "".join(f"# {line}".rstrip() + "\n" for line in comment.splitlines())
    gap = "\n" if head and parts[0] else ""
    body = f"{SEPARATOR}\n".join("".join(f"{line}\n" for line in part) for part in parts)
    return head + gap + body


#: What a new file holds to begin with.
_STARTERS = {
    "msg": ("float32 speed  # forwards [m/s]",),
    "srv": ("bool enable  # what is wanted", "---", "bool enabled  # what is so now"),
    "action": (
        "uint32 count  # how many times",
        "---",
        "uint32 total  # how many times it was",
        "---",
        "uint32 done  # how many times until now",
    ),
}


def starter(word: str) -> tuple[str, str]:
    """Return path and text of a new interface file, named like `Drive` or `srv/Ask`."""
    kind, _, name = word.rpartition("/")
    kind = kind or "msg"
    if kind not in _STARTERS:
        raise ValueError(f"`{word}` is no interface: write `Drive`, `srv/Ask` or `action/Walk`")
    comment = "An example: say here what it is for."
    return f"{kind}/{check_name(name)}.{kind}", text(kind, _STARTERS[kind], comment)


def index(package: str, keys: Iterable[str]) -> tuple[str, str]:
    """Return path and text of the file by which ROS 2's tools know a package's interfaces.

    `keys` are the interface files, such as `msg/Drive.msg`. Source: language 9.
    """
    return f"{RESOURCE}/rosidl_interfaces/{package}", "".join(f"{key}\n" for key in sorted(keys))


def check_fields(fields: Sequence[str]) -> None:
    """Raise ValueError for a field that would be more than one line of the file."""
    for field in fields:
        if len(field.splitlines()) > 1:
            raise ValueError(f"a field is one line, not {field!r}")
