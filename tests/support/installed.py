"""The interfaces that the wheels installed, and idlc run on them."""

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from idlc.generate.native.platforms import LAYOUTS, StructLayout
from idlc.project.prefixes import distribution

SHARE = Path(sys.prefix) / "share"

#: The (kind, name) of each interface, by package.
Interfaces = dict[str, list[tuple[str, str]]]


def installed_layout() -> StructLayout:
    """Return how the installed distribution lays structures out."""
    return LAYOUTS.get(distribution().name, LAYOUTS["jazzy"])


def interfaces_in(folders: Iterable[Path]) -> Interfaces:
    """Return the interfaces in package folders."""
    found: Interfaces = {}
    for folder in folders:
        for kind in ("msg", "srv", "action"):
            for path in sorted(folder.glob(f"{kind}/*.{kind}")):
                found.setdefault(folder.name, []).append((kind, path.stem))
    return found


def interfaces() -> Interfaces:
    """Return the installed interfaces."""
    return interfaces_in(sorted(SHARE.iterdir()))


def message_names(package: str, kind: str, name: str) -> list[str]:
    """Return the full names of every message that an interface is or implies."""
    service = ["_Request", "_Response", "_Event"]
    suffixes = {
        "msg": [""],
        "srv": service,
        "action": ["_Goal", "_Result", "_Feedback", "_FeedbackMessage"]
        + [f"_{part}{suffix}" for part in ("SendGoal", "GetResult") for suffix in service],
    }
    return [f"{package}/{kind}/{name}{suffix}" for suffix in suffixes[kind]]


def names_in(packages: Iterable[str], found: Interfaces) -> list[str]:
    """Return the full names of all messages of packages."""
    return [
        full
        for package in packages
        for kind, name in found[package]
        for full in message_names(package, kind, name)
    ]


def generate(files: Path, out: Path, *options: str, cwd: Path | None = None) -> None:
    """Let idlc compile a folder of interface files."""
    command = [sys.executable, "-m", "idlc", "gen", files, "-o", out, *options]
    done = subprocess.run(
        [str(word) for word in command], cwd=cwd, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
