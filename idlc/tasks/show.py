"""The pipeline of `idlc show`: find a type, compile it, print it in another format."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

import msgspec

from idlc.compiler.compiler import compile_package, derived_names, sound_models, stage
from idlc.diagnostics import codes
from idlc.diagnostics.report import Report, ReportedError
from idlc.language.tree import OPTIONAL
from idlc.model import derive, ir
from idlc.model.distros import later
from idlc.model.ir import spell, spell_value
from idlc.model.link import Model
from idlc.project import inputs
from idlc.project.find import find
from idlc.project.library import resolve
from idlc.project.settings import Scope
from idlc.project.words import read_words

if TYPE_CHECKING:
    from idlc.recordings.definitions import RecordedDefinition
    from idlc.recordings.types import LocalTypes


def hashes(targets: Sequence[str], scope: Scope, report: Report) -> list[tuple[str, str]]:
    """Return type hash and full name of each type in paths and names, derived types included."""
    named_hashes: list[tuple[str, str]] = []
    scope = _with_hashes(scope, report)
    for model, names in requested_models(targets, scope, report):
        with stage("describe", model.package):
            named_hashes += [(model.describer.hash(name), name) for name in names]
    return list(dict.fromkeys(named_hashes))


def describe(target: str, scope: Scope, report: Report) -> dict[str, object]:
    """Return the content of the JSON file that ROS 2 installs for one interface or derived type.

    Raises ReportedError.
    """
    scope = _with_hashes(scope, report)
    models = list(requested_models((target,), scope, report))
    report.raise_errors()
    if not models:
        raise ReportedError
    (model, names) = models[0]
    tops = [str(own.name) for own in model.own if str(own.name) in names] or names
    if len(models) > 1 or len(tops) > 1:
        hint = f"choose one, for example with `idlc show {tops[0]} --format type-description`"
        message = f"`{target}` contains several interfaces"
        raise report.refused(codes.NO_SUCH_TYPE.of(target, message, hint=hint))
    with stage("describe", tops[0]):
        return model.describer.installed(tops[0])


def _with_hashes(scope: Scope, report: Report) -> Scope:
    """Return a scope for the first of its distributions with type hashes; raise if none."""
    able = tuple(distro for distro in scope.distros if distro.has_hashes)
    scope = msgspec.structs.replace(scope, distros=able or scope.distros)
    if not scope.distro.has_hashes:
        first = next(other for other in later(scope.distro) if other.has_hashes)
        message = f"ROS 2 {scope.distro.title} has no type hashes and no type descriptions"
        hint = (
            f"{first.title} introduced them; choose a newer distribution, such as `--distro jazzy`"
        )
        raise report.refused(codes.NO_TYPE_HASHES.of("", message, hint=hint))
    return scope


def requested_models(
    targets: Sequence[str], scope: Scope, report: Report
) -> Iterator[tuple[Model, list[str]]]:
    """Yield, for paths and names, models and the requested names in them.

    Interfaces with errors are left out.
    """
    meant = read_words(targets, scope.root, "name")
    for name in meant["name"]:
        problems = Report()
        with suppress(ReportedError):  # the other words are shown
            yield from _named(name, scope, problems)
        report.extend(problems)
    if recordings := meant["recording"]:
        from idlc.api.sources import read_source
        from idlc.recordings.packages import recorded_models

        yield from recorded_models(read_source, recordings, scope, report)
    if paths := meant["path"]:
        problems = Report()
        files = find(paths, scope.root, problems, scope.exclude)
        packages = inputs.packages(files, scope, problems)
        report.extend(problems)
        report.notes += problems.notes
        if not problems.had_errors:  # not all files may be known
            yield from sound_models(packages, scope, report)


def _named(text: str, scope: Scope, report: Report) -> Iterator[tuple[Model, list[str]]]:
    """Yield the models of a type's or package's name, and the requested names in them."""
    library, matches = resolve(text, scope, report)
    for name, interface in matches:
        source = library.source(interface)
        if source is None:
            return
        model = compile_package(interface.package, [(interface, source)], library, report)
        report.raise_errors()
        names = [n for own in model.own if own.name == interface for n in derived_names(own)]
        if name == interface:
            yield model, names
        elif str(name) in names:
            yield model, [str(name)]
        else:
            parts = (f"`{name.rpartition('/')[2]}`" for name in names if name != str(interface))
            hint = f"the types of `{interface}` are {', '.join(parts)}"
            report.add(codes.NO_SUCH_TYPE.of("", f"no such type: `{text}`", hint=hint))


class TopicFacts(NamedTuple):
    """One line of the table.

    `hash` is the recorded hash, or the hash of the recorded definition. `here` compares it with the
    local type of the same name: same, differs or unknown. `definition` is the encoding of the
    recorded one. `rate` is in messages per second, `size` the bytes of the messages, `qos` the
    profiles of the publishers in few words.
    """

    name: str
    type_name: str
    messages: int | None
    hash: str | None
    here: str
    definition: str | None
    rate: float | None = None
    size: int | None = None
    qos: str = ""


class RecordingFacts(NamedTuple):
    """The summary of a recording; times are nanoseconds, the size is that of the files."""

    start: int | None
    end: int | None
    size: int
    messages: int
    damage: list[str]


#: The values of profiles; Humble wrote numbers.
PROFILE = re.compile(r"^[-\s]*(reliability|durability|history|depth):\s*(\w+)\s*$", re.MULTILINE)
NUMBERS = {
    "reliability": {"1": "reliable", "2": "best_effort"},
    "durability": {"1": "transient_local", "2": "volatile"},
    "history": {"1": "keep_last", "2": "keep_all"},
}
#: A profile takes a few hundred bytes.
MOST_OF_PROFILES = 1 << 16


def qos_text(profiles: str) -> str:
    """Return the profiles of publishers in few words, each once."""
    texts: dict[str, None] = {}
    for profile in re.split(r"(?m)^-", profiles[:MOST_OF_PROFILES]):
        values = {
            key: NUMBERS.get(key, {}).get(value, value) for key, value in PROFILE.findall(profile)
        }
        if not values:
            continue
        words = [values.get("reliability", "?")]
        if values.get("durability") == "transient_local":
            words.append("transient_local")
        is_all = values.get("history") == "keep_all"
        words.append("keep_all" if is_all else f"depth {values.get('depth', '?')}")
        texts[" ".join(words)] = None
    return ", ".join(texts)


def _topic_facts(
    recorded: RecordedDefinition,
    compiled: str | None,
    local: LocalTypes,
    rate: float | None,
    size: int | None,
) -> TopicFacts:
    """Return what is shown of a topic; `compiled` is the hash of its definition."""
    topic = recorded.topic
    hash_, here, local_hash = topic.hash or compiled, "unknown", None
    if recorded.name and recorded.interface:
        local_hash = local.hash(recorded.name, recorded.interface)
    if local_hash and hash_:
        here = "same" if local_hash == hash_ else "differs"
    schema = topic.schema
    if schema and schema.is_blank and not compiled:
        schema = None
    definition = None
    if schema:
        definition = schema.encoding or "unknown"
    own = (topic.name, topic.type, topic.count, hash_, here, definition)
    return TopicFacts(*own, rate, size, qos_text(topic.qos))


def recording(
    path: str, scope: Scope, report: Report
) -> tuple[RecordingFacts | None, list[TopicFacts]]:
    """Return the summary of a recording and its topics, sorted by name; nothing after an error."""
    from idlc.api.sources import read_source
    from idlc.recordings.times import END_OF_TIME
    from idlc.recordings.types import (
        LocalTypes,
        RecordingSummary,
        damage_problems,
        recorded_types,
        versions,
    )

    recording = read_source(path, scope.root, report, check=True)
    if recording is None:
        return None, []
    report.notes += [topic.message for topic in recording.unread]
    report.extend(damage_problems(path, recording.damage))
    local = LocalTypes(scope, report)
    facts = []
    span, size, sizes = recording.summary or RecordingSummary(None, 0, {})
    if span and span[1] >= END_OF_TIME:
        report.notes.append(f"`{path}`: a time is after the year 2262, so its length is not known")
        span = None
    seconds = (span[1] - span[0]) / 1e9 if span else 0
    for version in versions(recording.topics):
        types = recorded_types(version, local, Report())
        own = (typed for typed in types.topics if typed.interface in types.texts)
        # a name may stand for several topics, of different types
        hashes = {id(typed.recorded): types.hash(typed) for typed in own}
        for recorded in version.topics:
            topic, compiled = recorded.topic, hashes.get(id(recorded))
            rate = (topic.count - 1) / seconds if seconds and topic.count > 1 else None
            size_of_topic = sizes.get(topic)
            facts.append(_topic_facts(recorded, compiled, local, rate, size_of_topic))
    facts.sort(key=lambda row: (row.name, row.type_name))
    if recording.summary is None:
        return None, facts
    messages = sum(row.messages or 0 for row in facts)
    start, end = span or (None, None)
    damage = [str(each) for each in recording.damage]
    return RecordingFacts(start, end, size, messages, damage), facts


def definitions(
    path: str, selected: Sequence[str], style: str, scope: Scope, report: Report
) -> Iterator[str]:
    """Yield the interfaces of topics, each once, as text in a format."""
    from idlc.api.sources import read_source
    from idlc.recordings.types import LocalTypes, recorded_types, topics_of, versions

    if style in ("hash", "type-description"):
        scope = _with_hashes(scope, report)
    recorded = topics_of(read_source, [path], selected, scope.root, report)
    local = LocalTypes(scope, report)
    for version in versions(recorded):
        types = recorded_types(version, local, report)
        for name in dict.fromkeys(typed.interface for typed in types.topics):
            model = types.models[name.package]
            if name in model.interfaces:
                with stage("show", str(name)):
                    yield shown(model.interfaces[name], model, style)
        report.extend(types.errors)


INDENT = "    "
GAP = 2
#: Comments are not aligned further to the right than this column.
WIDEST = 60


def outline(interface: ir.Interface, model: Model) -> Iterator[str]:
    """Yield the lines; sections of services and actions are divided as in their files."""
    for number, section in enumerate(derive.sections(interface)):
        if number:
            yield "---"
        yield from (f"# {line}".rstrip() for line in section.comment)
        if section.comment and (section.constants or section.fields):
            yield ""
        rows = list(_rows(section, model, ""))
        widths = [len(code) for code, _ in rows if len(code) <= WIDEST]
        column = max(widths, default=0) + GAP
        for code, comment in rows:
            before = f"{code.ljust(column - GAP)}{' ' * GAP}"
            for line in comment:
                yield f"{before}# {line}".rstrip()
                before = " " * column
            if not comment:
                yield code


def _rows(message: ir.Message, model: Model, margin: str) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield each line of code with its comment; nested structures are below, indented."""
    for constant in message.constants:
        value = spell_value(constant.value)
        yield f"{margin}{spell(constant.type)} {constant.name}={value}", constant.comment
    for field in message.fields:
        default = f" {spell_value(field.default.value)}" if field.default else ""
        unit = f" [{field.unit}]" if field.unit else ""
        *before, last = field.comment or ("",)
        comment = tuple(line for line in (*before, f"{last}{unit}".strip()) if line)
        optional = f"{OPTIONAL} " if field.optional else ""
        yield f"{margin}{optional}{spell(field.type)} {field.name}{default}", comment
        element = ir.element_of(field.type)
        if isinstance(element, ir.Ref):
            yield from _rows(model.messages[element.target], model, margin + INDENT)


def show(target: str, style: str, scope: Scope, report: Report) -> list[str]:
    """Return the interfaces of a type name or path, each as text in a format."""
    if style == "type-description":
        return [_description(describe(target, scope, report))]
    texts = []
    wholes: list[ir.TypeName] = []
    for model, names in list(requested_models((target,), scope, report)):
        for own in model.own:
            wholes.append(own.name)
            if str(own.name) in names:
                with stage("show", str(own.name)):
                    texts.append(shown(own, model, style))
    if not texts:
        report.raise_errors()
        message = f"`{target}` is a section of a service or action"
        hint = f"`idlc show {wholes[0]}` shows the whole interface" if wholes else None
        report.add(codes.NO_SUCH_TYPE.of("", message, hint=hint))
    return texts


def _description(content: dict[str, object]) -> str:
    return json.dumps(content, indent=2) + "\n"


def shown(interface: ir.Interface, model: Model, style: str) -> str:
    """Return an interface in a format."""
    from idlc.generate import schemas
    from idlc.model import idl_text
    from idlc.recordings.definitions import mcap_text

    name = str(interface.name)
    match style:
        case "json":
            return json.dumps(schemas.facts(interface, model)) + "\n"
        case "hash":
            names = derived_names(interface)
            return "".join(f"{model.describer.hash(each)}  {each}\n" for each in names)
        case "type-description":
            return _description(model.describer.installed(name))
        case "ros2idl":
            return idl_text.idl(interface)
        case "jsonschema":
            return json.dumps(schemas.json_schema(interface, model), indent=2) + "\n"
        case "mcap":
            return mcap_text(interface, model)
    has_hashes = model.distro.has_hashes
    head = [f"# {model.describer.hash(name)}"] if has_hashes else []
    lines = (f"# {name}", *head, "", *outline(interface, model))
    return "".join(f"{line}\n" for line in lines)
