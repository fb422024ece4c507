"""The pipeline of `idlc show REC`: the topics of a recording, compared with local types."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from idlc.check.compiler import stage
from idlc.diagnostics.report import Report
from idlc.documents.show import shown
from idlc.project.settings import Scope
from idlc.recordings.definitions import Recorded
from idlc.recordings.types import LocalTypes, recorded_types
from idlc.recordings.versions import read_topics, topics_of, versions


class TopicFacts(NamedTuple):
    """One line of the table.

    `hash` is the recorded one, or that of the recorded definition. `here` compares it with the
    local type of the same name: same, differs or unknown. `definition` is the encoding of the
    recorded one.
    """

    name: str
    type_name: str
    messages: int | None
    hash: str | None
    here: str
    definition: str | None


def topics(path: str, scope: Scope, report: Report) -> list[TopicFacts]:
    """Return the topics of a recording, sorted by name; empty after an error."""
    recording = read_topics(path, report, check=True)
    report.notes += [topic.message for topic in recording.unread] if recording else []
    local = LocalTypes(scope, report)
    facts = []
    for version in versions(recording.topics) if recording else ():
        types = recorded_types(version, local, scope, Report())
        own = (typed for typed in types.topics if typed.interface in types.texts)
        # a name may stand for several topics, of different types
        hashes = {id(typed.recorded): types.hash(typed) for typed in own}
        facts += [_facts(recorded, hashes.get(id(recorded)), local) for recorded in version.topics]
    return sorted(facts, key=lambda row: (row.name, row.type_name))


def _facts(recorded: Recorded, compiled: str | None, local: LocalTypes) -> TopicFacts:
    topic = recorded.topic
    hash_ = topic.hash or compiled
    local_hash = (
        local.hash(recorded.name, recorded.interface)
        if recorded.name and recorded.interface
        else None
    )
    comparison = "unknown"
    if local_hash and hash_:
        comparison = "same" if local_hash == hash_ else "differs"
    schema = None if topic.schema and topic.schema.is_blank and not compiled else topic.schema
    definition = schema.encoding or "unknown" if schema else None
    return TopicFacts(topic.name, topic.type, topic.count, hash_, comparison, definition)


def definitions(
    path: str, selected: Sequence[str], style: str, scope: Scope, report: Report
) -> Iterator[str]:
    """Yield the interfaces of topics, each once, as text in a format."""
    recorded = topics_of([path], selected, report)
    local = LocalTypes(scope, report)
    for version in versions(recorded or ()):
        types = recorded_types(version, local, scope, report)
        for name in dict.fromkeys(typed.interface for typed in types.topics):
            model = types.models[name.package]
            if name in model.interfaces:
                with stage("show", str(name)):
                    yield shown(model.interfaces[name], model, style)
        report.extend(types.errors)
