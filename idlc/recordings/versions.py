"""Recordings as sources of interfaces: their topics, and which definitions count."""

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
from idlc.recordings.definitions import Known, Recorded, recorded
from idlc.recordings.find import is_there

if TYPE_CHECKING:
    pass


#: With so many versions a topic is compared.
TRIED = 16


class Recording(NamedTuple):
    """A recording, as it is called in messages, with its topics."""

    path: str
    topics: tuple[Recorded, ...]
    unread: tuple[Unread, ...] = ()


class Version(msgspec.Struct):
    """Topics whose definitions do not contradict each other, and these definitions."""

    topics: list[Recorded]
    texts: dict[ir.TypeName, Source]


def read(path: str, report: Report, *, look: bool = False) -> Recording | None:
    """Return what is in a recording; report IDL651 and return `None` for one that is none.

    With `look`, it says which topics cannot be read.
    """
    if not is_there(path):
        report.add(codes.NO_SUCH_PATH.of(path, f"no such file or folder: `{path}`"))
        return None
    try:
        with open_recording(path) as container:
            report.notes += container.notes
            known: Known = {}
            topics = tuple(recorded(one, path, known) for one in container.topics)
            return Recording(path, topics, tuple(container.unread()) if look else ())
    except RecordingError as error:
        report.add(codes.UNREADABLE_RECORDING.of(path, error.message, hint=error.hint))
        return None


def topics_of(paths: Sequence[str], wanted: Sequence[str], report: Report) -> list[Recorded] | None:
    """Return the topics of recordings, or those that are wanted; `None` after an error.

    Reports IDL655 for a topic that is in none of them.
    """
    recordings = [read(path, report) for path in paths]
    if None in recordings:
        return None
    topics = [one for recording in recordings if recording for one in recording.topics]
    known = dict.fromkeys(one.topic.name for one in topics)
    missing = [name for name in wanted if name not in known]
    for name in missing:
        near = did_you_mean(name, known) or did_you_mean(f"/{name}", known)
        hint = near or "`idlc show` lists the topics of a recording"
        message = f"no topic `{name}` in {' or '.join(f'`{path}`' for path in paths)}"
        report.add(codes.NO_SUCH_TOPIC.of("", message, hint=hint))
    if missing:
        return None
    return [one for one in topics if not wanted or one.topic.name in wanted]


def versions(topics: Iterable[Recorded]) -> list[Version]:
    """Return topics in as few groups as they have different definitions of one name.

    What differs in comments only is no other definition.
    """
    found: list[Version] = []
    contents = Contents()
    placed: dict[int, Version] = {}  # topics of one definition share their texts
    for one in topics:
        if id(one.texts) not in placed:
            # real recordings have few versions; of many, not all are tried
            some = (each for each in found[-TRIED:] if contents.agree(one.texts, each.texts))
            version = next(some, None) or Version([], {})
            if not version.topics:
                found.append(version)
            for name, source in one.texts.items():
                version.texts.setdefault(name, source)
            placed[id(one.texts)] = version
        placed[id(one.texts)].topics.append(one)
    return found


def contradictions(found: Sequence[Version]) -> Iterator[tuple[ir.TypeName, Source, Source]]:
    """Yield each name that has several definitions, with the first two of them."""
    contents = Contents()
    seen: dict[ir.TypeName, Source] = {}
    told: set[ir.TypeName] = set()
    for version in found:
        every = {id(topic.repeated): topic.repeated for topic in version.topics}
        repeated = (pair for pairs in every.values() for pair in pairs)
        for name, source in (*version.texts.items(), *repeated):
            first = seen.setdefault(name, source)
            if name not in told and not contents.same(name, first, source):
                told.add(name)
                yield name, first, source


class Contents:
    """Compares definitions by what they mean without comments; each is read once."""

    def __init__(self) -> None:
        self._known: dict[tuple[ir.TypeName, str, bool], Hashable] = {}

    def agree(
        self, some: Mapping[ir.TypeName, Source], others: Mapping[ir.TypeName, Source]
    ) -> bool:
        """Return whether no name has different definitions in both."""
        return all(
            self.same(name, one, others[name]) for name, one in some.items() if name in others
        )

    def same(self, name: ir.TypeName, one: Source, other: Source) -> bool:
        """Return whether two definitions mean the same."""
        return one.text == other.text or self._of(name, one) == self._of(name, other)

    def _of(self, name: ir.TypeName, source: Source) -> Hashable:
        key = (name, source.text, source.is_idl)
        if key not in self._known:
            report = Report()
            read = lower(parse_any(source), name, report)
            # nothing is like what cannot be read
            self._known[key] = source.text if report.had_errors else content(read)
        return self._known[key]
