"""Recordings, and robots that are seen as recordings."""

from __future__ import annotations

from idlc.diagnostics.report import Report
from idlc.project.find import is_address
from idlc.project.root import Root
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
