"""Recordings, and robots that are seen as recordings."""

from __future__ import annotations

from collections.abc import Iterable

from idlc.diagnostics.report import Report
from idlc.project.root import Root
from idlc.project.words import is_address
from idlc.recordings.load import LoadedPackages, loaded
from idlc.recordings.types import RecordingTopics, read_topics


def read_source(
    path: str, root: Root, report: Report, *, check: bool = False, verify: bool = False
) -> RecordingTopics | None:
    """Return the topics of a recording, or of the robot at an address; `None` after an error."""
    if not is_address(path):
        return read_topics(path, root, report, check=check, verify=verify)
    from idlc.robot.live.types import read_robot

    robot = read_robot(path, report)
    return None if robot is None else RecordingTopics(robot)


def load(what: str, *, include: Iterable[str] = (), distro: str | None = None) -> LoadedPackages:
    """Compile interfaces, and return their classes.

    `what` is a recording, a .msg, .srv or .action file, a folder of them, or the name of a type or
    package that is known here. `include` are folders in which other packages are looked for first.
    The classes can be pickled, and read wherever idlc is installed; type checkers do not know them,
    so programs are better off with `idlc gen`.
    """
    return loaded(what, include=include, distro=distro, read=read_source)
