"""The pipeline of `idlc show REC`: what is in a recording, compared with what is known here."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from idlc.check.compiler import stage
from idlc.diagnostics.report import Report
from idlc.documents.show import shown
from idlc.project.settings import Scope
from idlc.recordings.definitions import Recorded
from idlc.recordings.types import Around, recorded_types
from idlc.recordings.versions import read, topics_of, versions


class TopicFacts(NamedTuple):
    """One line of the table.

    `hash` is the recorded one, or that of the recorded definition. `here` compares it with the
    type of the same name that is known here: same, differs or unknown. `definition` is the
    encoding of the recorded one.
    """

    name: str
    type_name: str
    messages: int | None
    hash: str | None
    here: str
    definition: str | None


def topics(path: str, scope: Scope, report: Report) -> list[TopicFacts]:
    """Return the topics of a recording, sorted by name; empty after an error."""
    recording = read(path, report, look=True)
    report.notes += [one.message for one in recording.unread] if recording else []
    around = Around(scope, report)
    found = []
    for version in versions(recording.topics) if recording else ():
        types = recorded_types(version, around, scope, Report())
        own = (one for one in types.topics if one.interface in types.texts)
        # a name may stand for several topics, of different types
        hashes = {id(one.recorded): types.hash(one) for one in own}
        found += [_facts(one, hashes.get(id(one)), around) for one in version.topics]
    return sorted(found, key=lambda one: (one.name, one.type_name))


def _facts(one: Recorded, compiled: str | None, around: Around) -> TopicFacts:
    topic = one.topic
    hash_ = topic.hash or compiled
    known = around.hash(one.name, one.interface) if one.name and one.interface else None
    here = "unknown"
    if known and hash_:
        here = "same" if known == hash_ else "differs"
    schema = None if topic.schema and topic.schema.is_blank and not compiled else topic.schema
    definition = schema.encoding or "unknown" if schema else None
    return TopicFacts(topic.name, topic.type, topic.count, hash_, here, definition)


def definitions(
    path: str, wanted: Sequence[str], style: str, scope: Scope, report: Report
) -> Iterator[str]:
    """Yield the interfaces of topics, each once, as text in a format."""
    found = topics_of([path], wanted, report)
    around = Around(scope, report)
    for version in versions(found or ()):
        types = recorded_types(version, around, scope, report)
        for name in dict.fromkeys(one.interface for one in types.topics):
            model = types.models[name.package]
            if name in model.interfaces:
                with stage("show", str(name)):
                    yield shown(model.interfaces[name], model, style)
        report.extend(types.errors)
