"""Recordings as sources of interfaces: their topics, and the definitions that count."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import msgspec

from idlc.diagnostics import codes
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.diagnostics.text import did_you_mean
from idlc.language.parse import parse_any
from idlc.model import ir
from idlc.model.ir import content
from idlc.model.lower import lower
from idlc.recordings.containers.container import open_recording
from idlc.recordings.containers.source import RecordingError, Unread
from idlc.recordings.definitions import Recorded, TextCache, recorded
from idlc.recordings.find import is_there

if TYPE_CHECKING:
    pass


#: The number of versions that a topic is compared with.
TRIED = 16


class RecordingTopics(NamedTuple):
    """The topics of a recording; `path` is its name in reports."""

    path: str
    topics: tuple[Recorded, ...]
    unread: tuple[Unread, ...] = ()


class Version(msgspec.Struct):
    """Topics whose definitions do not contradict each other, and these definitions."""

    topics: list[Recorded]
    texts: dict[ir.TypeName, Source]


def read_topics(path: str, report: Report, *, check: bool = False) -> RecordingTopics | None:
    """Return the topics of a recording; report IDL651 and return `None` for other files.

    With `check`, topics that cannot be read are in `unread`.
    """
    if not is_there(path):
        report.add(codes.NO_SUCH_PATH.of(path, f"no such file or folder: `{path}`"))
        return None
    try:
        with open_recording(path) as container:
            report.notes += container.notes
            cache: TextCache = {}
            topics = tuple(recorded(topic, path, cache) for topic in container.topics)
            return RecordingTopics(path, topics, tuple(container.unread()) if check else ())
    except RecordingError as error:
        report.add(codes.UNREADABLE_RECORDING.of(path, error.message, hint=error.hint))
        return None


def topics_of(
    paths: Sequence[str], selected: Sequence[str], report: Report
) -> list[Recorded] | None:
    """Return the topics of recordings, or the selected ones; `None` after an error.

    Reports IDL655 for a topic that is in none of them.
    """
    recordings = [read_topics(path, report) for path in paths]
    if None in recordings:
        return None
    topics = [topic for recording in recordings if recording for topic in recording.topics]
    names = dict.fromkeys(topic.topic.name for topic in topics)
    missing = [name for name in selected if name not in names]
    for name in missing:
        near = did_you_mean(name, names) or did_you_mean(f"/{name}", names)
        hint = near or "`idlc show` lists the topics of a recording"
        message = f"no topic `{name}` in {' or '.join(f'`{path}`' for path in paths)}"
        report.add(codes.NO_SUCH_TOPIC.of("", message, hint=hint))
    if missing:
        return None
    return [topic for topic in topics if not selected or topic.topic.name in selected]


def versions(topics: Iterable[Recorded]) -> list[Version]:
    """Return topics in as few groups as they have different definitions of one name.

    Definitions that differ in comments only are equal.
    """
    groups: list[Version] = []
    contents = Contents()
    placed: dict[int, Version] = {}  # topics of one definition share their texts
    for topic in topics:
        if id(topic.texts) not in placed:
            # real recordings have few versions; of many, not all are tried
            some = (each for each in groups[-TRIED:] if contents.agree(topic.texts, each.texts))
            version = next(some, None) or Version([], {})
            if not version.topics:
                groups.append(version)
            for name, source in topic.texts.items():
                version.texts.setdefault(name, source)
            placed[id(topic.texts)] = version
        placed[id(topic.texts)].topics.append(topic)
    return groups


def contradictions(groups: Sequence[Version]) -> Iterator[tuple[ir.TypeName, Source, Source]]:
    """Yield each name that has several definitions, with the first two of them."""
    contents = Contents()
    seen: dict[ir.TypeName, Source] = {}
    reported: set[ir.TypeName] = set()
    for version in groups:
        every = {id(topic.repeated): topic.repeated for topic in version.topics}
        repeated = (pair for pairs in every.values() for pair in pairs)
        for name, source in (*version.texts.items(), *repeated):
            first = seen.setdefault(name, source)
            if name not in reported and not contents.same(name, first, source):
                reported.add(name)
                yield name, first, source


class Contents:
    """Compares definitions by what they mean without comments; each is read once."""

    def __init__(self) -> None:
        self._contents: dict[tuple[ir.TypeName, str, bool], Hashable] = {}

    def agree(
        self, some: Mapping[ir.TypeName, Source], others: Mapping[ir.TypeName, Source]
    ) -> bool:
        """Return whether no name has different definitions in both."""
        return all(
            self.same(name, source, others[name]) for name, source in some.items() if name in others
        )

    def same(self, name: ir.TypeName, source: Source, other: Source) -> bool:
        """Return whether two definitions mean the same."""
        return source.text == other.text or self._of(name, source) == self._of(name, other)

    def _of(self, name: ir.TypeName, source: Source) -> Hashable:
        key = (name, source.text, source.is_idl)
        if key not in self._contents:
            report = Report()
            read = lower(parse_any(source), name, report)
            # a definition that cannot be parsed equals no other
            self._contents[key] = source.text if report.had_errors else content(read)
        return self._contents[key]
