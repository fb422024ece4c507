"""One package, what is done to it in every editor, and what is seen there."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

FILES = {
    "package.xml": '<package format="3">\n  <name>demo_msgs</name>\n'
    "  <depend>std_msgs</depend>\n</package>\n",
    "msg/Drive.msg": "# How fast to drive.\n\nstd_msgs/Header header\n"
    "float64 speed 0.5  # forward speed [m/s]\nuint8 MODE_FAST=1\nuint8 mode\n",
    "msg/Fleet.msg": "Drive[] drives  # all of them\nDrive leader\n",
    "msg/Broken.msg": "flot64 x\n",
    "msg/Untidy.msg": "float64   speed 0.5# [m/s]\n",
}
#: What is written into pyproject.toml at the end, when there are files that cannot be compiled.
SETTINGS = '[tool.idlc]\npaths = ["msg/Untidy.msg"]\nout = "out/demo_msgs"\n'
#: What each editor shows: of the first problem its text and the marked words; after a fix, a rename
#: or formatting the file's text; of a hover some lines; of places the file and the line.
EXPECTED: dict[str, Any] = {
    "diagnostic": ("IDL201: unknown type `flot64`", "flot64"),
    "fix": "float64 x\n",
    "hover": {
        "demo_msgs/msg/Drive",
        "How fast to drive.",
        "int32 sec",
        "float64 speed 0.5",
        "RIHS01_",
    },
    "definition": "Drive.msg",
    "references": [("Drive.msg", 1), ("Fleet.msg", 1), ("Fleet.msg", 2)],
    "completion": ("std_msgs/Header", "std_msgs/Header"),
    "rename": FILES["msg/Drive.msg"].replace("float64 speed", "float64 velocity"),
    "format": "float64 speed 0.5  # [m/s]\n",
    "symbol": {"header", "speed", "MODE_FAST", "mode"},
    "inlay_hint": ["@0, ≥13 B", "@≥16, 8 B", "@≥24, 1 B"],
}
#: Two packages, of which a message is renamed in each editor, from the file of a user.
RENAMING = {
    "base/package.xml": '<package format="3">\n  <name>base</name>\n</package>\n',
    "base/CMakeLists.txt": 'rosidl_generate_interfaces(base\n  "msg/Pose.msg" "msg/Track.msg")\n',
    "base/msg/Pose.msg": "float64 x  # [m]\n",
    "base/msg/Track.msg": "Pose[] poses\n",
    "fleet/package.xml": '<package format="3">\n  <name>fleet</name>\n'
    "  <depend>base</depend>\n</package>\n",
    "fleet/msg/Robot.msg": "base/Pose pose\nbase/Pose[2] before\n",
    "fleet/srv/Where.srv": "---\nbase/Pose pose\n",
}
RENAMED = {
    path.replace("Pose", "Waypoint"): text.replace("Pose", "Waypoint")
    for path, text in RENAMING.items()
}
#: Each name that the message gets in turn, with the files as buffers have them or `disk` has.
_CMAKE = "base/CMakeLists.txt"
EDITED = {**RENAMING, _CMAKE: "# not saved\n" + RENAMING[_CMAKE]}
NEOVIM_RENAMES = [
    ["Waypoint", RENAMED],
    ["Pose", RENAMING],
    ["Waypoint", RENAMED],
    ["disk", RENAMED],
    ["Pose", EDITED],
    ["disk", EDITED],
]


def write(folder: Path, files: Mapping[str, str] = FILES) -> Path:
    """Write files into a folder, with what makes it a repository, and return that."""
    for path, text in {".git/HEAD": "", **files}.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    return folder


def normal(seen: dict[str, Any]) -> dict[str, Any]:
    """Return what an editor saw of each of the ten capabilities, as `EXPECTED` has it."""
    found = {name: value for name, value in seen.items() if name in EXPECTED}
    for name, value in found.items():
        if isinstance(value, dict) and "failed" in value:
            continue
        if name == "diagnostic":
            message, marked = value[0]
            code, _, text = message.replace("idlc [IDL201]", "IDL201").partition(": ")
            found[name] = (f"{code}: {text.splitlines()[0]}", marked)
        elif name == "hover":
            found[name] = {one for one in EXPECTED[name] if one in value}
        elif name == "references":
            found[name] = sorted((file, line) for file, line, *_ in value)
        elif name == "completion":
            found[name] = (value["words"][0], value["line"])
        elif name == "symbol":
            words = {one if isinstance(one, str) else one[-1] for one in value}
            found[name] = {word.split()[-1] for word in words}
        elif name == "inlay_hint":
            found[name] = [label for _, label in value]
    return found


def steps(before: Mapping[str, str], after: Mapping[str, str]) -> dict[str, object]:
    """Return what VS Code has on disk after each step, and which dialogs are left at the end."""
    return {"renamed": after, "undone": before, "redone": after, "dialogs": 0}
