"""The pipeline of `idlc upgrade`: recordings, and the plan of each topic whose type changed."""

from __future__ import annotations

import os
import shlex
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from idlc.api.sources import read_source
from idlc.api.upgrade import Runner, UpgradeError
from idlc.compiler.compiler import stage
from idlc.diagnostics import codes
from idlc.diagnostics.report import (
    Diagnostic,
    Label,
    Report,
    ReportedError,
    Severity,
    first_few,
)
from idlc.diagnostics.terminal import Progress
from idlc.model import ir
from idlc.project.files import is_folder
from idlc.project.find import RULES
from idlc.project.root import Root
from idlc.project.settings import Scope
from idlc.project.words import is_address, read_version
from idlc.recordings.columns import unread_bytes
from idlc.recordings.containers import conversion
from idlc.recordings.containers.container import open_recording
from idlc.recordings.containers.file import CDR, MSG
from idlc.recordings.containers.messages import ALWAYS
from idlc.recordings.containers.source import RecordingError
from idlc.recordings.definitions import definition_text, interface_of
from idlc.recordings.lengths import check_lengths, first_longer, sample, wrong_definition
from idlc.recordings.load import TopicType, known_versions
from idlc.recordings.types import (
    NAMED,
    DefinedTopic,
    LocalTypes,
    RecordedTypes,
    damage_problems,
    recorded_types,
    topics_of,
    versions,
)
from idlc.runtime.typeinfo import Structure
from idlc.tasks.upgrade.targets import UpgradeTarget, compiled, target_of
from idlc.versions.conversion import FieldFate, Plan, Version, make_plan
from idlc.versions.converters import RunRules
from idlc.versions.exact import Payloads
from idlc.versions.meanings import renumbered
from idlc.versions.rules import Known, Rules, read_rules, rule_files

if TYPE_CHECKING:
    from idlc.recordings.rewrite import Rewritten


#: The option for old types that recordings do not define.
FROM = "--from"


class UpgradeOptions(msgspec.Struct, frozen=True):
    """The options of `idlc upgrade`; `again` is the command without those of rules and output."""

    recordings: tuple[str, ...]
    scope: Scope
    out: str | None = None
    to: str | None = None
    old: str | None = None
    topics: tuple[str, ...] = ()
    rules: tuple[str, ...] = ()
    write_rules: str | None = None
    dry_run: bool = False
    allow_loss: bool = False
    strict: bool = False
    again: str = "idlc upgrade"


class TopicPlan(NamedTuple):
    """A recorded topic, and the plan of its messages; without a plan, the type was removed.

    `definition` is the key of the recorded definition; `several` is true if the topic has others.
    """

    recording: str
    topic: str
    type: str
    plan: Plan | None
    definition: conversion.DefinitionKey = ("", "")
    several: bool = False

    @property
    def findings(self) -> list[FieldFate]:
        """The fate of each field that changed."""
        if self.plan is None:
            reason = f"type `{self.type}` was removed: its messages do not change"
            return [FieldFate("lost", "", self.type, "", reason)]
        return self.plan.findings()

    @property
    def fate(self) -> str:
        """The worst fate of any field."""
        return "lost" if self.plan is None else self.plan.fate

    def rewritten(self, written: Rewritten) -> conversion.RewrittenTopic | None:
        """Return the fate of these messages in a recording that was written."""
        if self.several:
            return written.definitions.get((self.topic, self.definition))
        return written.topics.get(self.topic)


class UndefinedTopic(NamedTuple):
    """An unchanged topic whose definition its recording lacks, and the version that it has."""

    topic: str
    version: Version
    definition: conversion.DefinitionKey
    several: bool = False


class UpgradeResult(NamedTuple):
    """The plans of changed topics, the recordings that were written, and new files of rules.

    `undefined` are unchanged topics whose definitions the recording lacks, by its path; `unread`
    are topics whose definitions nothing has, which are copied.
    """

    plans: list[TopicPlan]
    written: list[tuple[str, str, Rewritten]]
    stubs: list[str]
    undefined: dict[str, list[UndefinedTopic]]
    unread: dict[str, list[str]]


def upgrade_recordings(
    options: UpgradeOptions, report: Report, progress: Progress
) -> UpgradeResult:
    """Plan the upgrade of recordings, and write them unless something is in the way of it.

    The result has what was planned before an error.
    """
    result = UpgradeResult([], [], [], {}, {})
    unread: list[Diagnostic] = []
    with ExitStack() as opened, suppress(ReportedError):
        opened.callback(lambda: report.extend(_as_errors(unread)))  # which do not prevent writing
        target = local = None
        with suppress(ReportedError):
            target = opened.enter_context(target_of(options.to, options.scope, report))
        with suppress(ReportedError):
            local = _local(options, opened, report)
        named = _read(rule_files(options.rules, options.scope.root), options.scope.root, report)
        if options.topics:
            topics_of(read_source, options.recordings, options.topics, options.scope.root, report)
        report.raise_errors()
        assert target is not None
        assert local is not None
        found = _found(target, named, options.scope.root)
        for recording in options.recordings:
            undefined = result.undefined.setdefault(recording, [])
            known_rules = Known(named)
            without: dict[Diagnostic, list[str]] = {}
            lists = undefined, without
            every = _plans(recording, options, target, local, known_rules, report, *lists)
            with suppress(ReportedError):  # the other recordings may be readable
                result.plans.extend(every)
            result.unread[recording] = [name for names in without.values() for name in names]
            unread += without
        report.raise_errors()
        if options.write_rules is not None:
            from idlc.versions.stubs import write_stubs

            plans = [each.plan for each in result.plans if each.plan is not None]
            result.stubs.extend(write_stubs(plans, options.write_rules, options.scope.root, report))
            return result
        _judge(result.plans, options, target, Known(named), found, report)
        if not options.dry_run and options.out is not None:
            run = Runner({rules.path: rules.file for rules in named})
            _write(result, options, run, report, progress)
    return result


def _as_errors(problems: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
    for problem in problems:
        yield msgspec.structs.replace(problem, severity=Severity.ERROR)


def _local(options: UpgradeOptions, opened: ExitStack, report: Report) -> LocalTypes:
    """Return the old types that recordings do not define. Raises ReportedError."""
    scope = options.scope
    if options.old is None:
        return LocalTypes(scope, report, option=f"`{FROM} PATH`")
    if options.to is not None and read_version(options.to, scope.root).meaning in ("path", "name"):
        # a revision of what `--to` names
        scope = msgspec.structs.replace(scope, paths=(options.to,))
    old = opened.enter_context(target_of(options.old, scope, report))
    scope = msgspec.structs.replace(scope, distros=(old.distro or scope.distro,))
    return LocalTypes(scope, report, old.texts, option=f"`{FROM} PATH`")


def _read(files: Iterable[Path], root: Root, report: Report) -> list[Rules]:
    rules, bad = read_rules(files, root, report)
    report.extend(codes.BAD_RULES.at(error.span, str(error)) for error in bad)
    return rules


def _found(target: UpgradeTarget, named: Sequence[Rules], root: Root) -> list[Rules]:
    """Return the rules beside the target's messages that were not named."""
    folders = [str(home / RULES) for home in target.homes.values() if is_folder(home / RULES)]
    used = {rules.file.resolve() for rules in named}
    files = (file for file in rule_files(folders, root) if file.resolve() not in used)
    return read_rules(files, root, Report())[0]


def _plans(
    recording: str,
    options: UpgradeOptions,
    target: UpgradeTarget,
    local: LocalTypes,
    rules: Known,
    report: Report,
    undefined: list[UndefinedTopic],
    unread: dict[Diagnostic, list[str]],
) -> Iterator[TopicPlan]:
    """Yield the plan of each topic of a recording whose type is another one in the target.

    Unchanged topics whose definitions the recording lacks are added to `undefined`, and those whose
    definitions nothing has to `unread`.
    """
    topics = topics_of(read_source, [recording], (), options.scope.root, report)
    selected = set(options.topics)
    packages: set[str] = set()
    definitions = Counter(topic.topic.name for topic in topics)
    for version in versions(topics):
        version = msgspec.structs.replace(
            version,
            topics=[t for t in version.topics if not selected or t.topic.name in selected],
        )
        if not version.topics:
            continue
        problems = Report()
        types = recorded_types(version, local, problems)
        unread |= types.undefined
        report.extend(problem for problem in problems if problem not in types.undefined)
        report.extend(types.errors)
        packages |= {name.package for name in types.interfaces}
        if not is_address(recording):
            _check_lengths(recording, types, options, report)
        with stage("plan", recording), suppress(ReportedError):
            for each in _of_types(recording, types, target, rules, report, undefined):
                yield each._replace(several=definitions[each.topic] > 1)
    if packages and target.texts and not any(map(target.owns, packages)):
        listed = first_few((f"`{package}`" for package in sorted(packages)), NAMED)
        where = f"`{options.to}` has none of the packages of `{recording}`"
        report.notes.append(f"{where}, which are {listed}")
    undefined[:] = [each._replace(several=definitions[each.topic] > 1) for each in undefined]


def _check_lengths(
    recording: str, types: RecordedTypes, options: UpgradeOptions, report: Report
) -> None:
    """Report topics whose messages are of another version than their definition."""
    models = dict(types.models)
    with open_recording(options.scope.root.path(recording)) as container:
        for typed in types.topics:
            topic, package = typed.recorded.topic, typed.name.package
            if topic.encoding != CDR or typed.name not in models[package].messages:
                continue
            structure = TopicType(models, typed.name).structure
            raws = sample(container.messages(topic, ALWAYS))
            unread = unread_bytes(structure, raws)
            hint: str | None = wrong_definition(topic, option=FROM)
            problem = ""
            try:
                if raws:
                    known = known_versions(topic, options.scope.include, ())
                    problem = check_lengths(topic, structure, unread, raws, known, FROM)
            except RecordingError as error:
                problem, hint = error.message, error.hint
            if problem:
                report.add(codes.CONVERSION_FAILED.of(recording, problem, hint=hint))


def _of_types(
    recording: str,
    types: RecordedTypes,
    target: UpgradeTarget,
    rules: Known,
    report: Report,
    undefined: list[UndefinedTopic],
) -> Iterator[TopicPlan]:
    compiler = target.compiler(types.texts)
    known: list[tuple[DefinedTopic, Version, ir.TypeName]] = []
    for topic in types.topics:
        if topic.name not in types.models[topic.name.package].messages:
            continue
        old = Version(types.models, topic.name)
        name = _name_in(compiler.library, old, rules)
        if name is not None:
            known.append((topic, old, name))
        elif target.defines(topic.name.package):
            recorded = topic.recorded.topic
            key = conversion.definition_key(recorded.type, recorded.schema)
            yield TopicPlan(recording, recorded.name, str(topic.name), None, key)
    models = compiled(compiler, {interface_of(name) for *_, name in known}, report)
    plans: dict[tuple[ir.TypeName, ir.TypeName], Plan | None] = {}
    for topic, old, name in known:
        if (topic.name, name) not in plans:
            new = Version(models, name)
            is_same = old.key == new.key and not _differs(old, new, target)
            is_same = is_same and not _renumbers(old, new)
            plans[topic.name, name] = None if is_same else make_plan(old, new, rules)
        plan, recorded = plans[topic.name, name], topic.recorded.topic
        key = conversion.definition_key(recorded.type, recorded.schema)
        if plan is not None:
            yield TopicPlan(recording, recorded.name, str(topic.name), plan, key)
        elif recorded.schema is None:
            undefined.append(UndefinedTopic(recorded.name, old, key))


def _name_in(library: Any, old: Version, rules: Known) -> ir.TypeName | None:
    """Return the name of a type in the target: its own, or the one that rules lead to."""
    if library.source(interface_of(old.name)) is not None:
        return old.name
    keys = [old.key]
    for key in keys:
        for file in rules.starting(key):
            name = ir.TypeName.parse(file.new.type)
            if library.source(interface_of(name)) is not None:
                return name
            keys += [file.new] if file.new not in keys else []
    return None


def _differs(old: Version, new: Version, target: UpgradeTarget) -> bool:
    """Return whether types of one hash differ in comments or constants that the user wrote.

    The definitions of other packages stay as they were recorded.
    """
    before, after = (
        {
            name: ir.meaning(interface)
            for reached in ({interface_of(each) for each in version.reached},)
            for model in version.models.values()
            for name, interface in model.interfaces.items()
            if target.owns(name.package) and name in reached
        }
        for version in (old, new)
    )
    return before != after


def _renumbers(old: Version, new: Version) -> bool:
    """Return whether a constant of a type has another value in a version of the same hash."""
    return any(
        renumbered(old.of(name).message, new.of(name).message) for name in old.reached & new.reached
    )


def _judge(
    plans: Sequence[TopicPlan],
    options: UpgradeOptions,
    target: UpgradeTarget,
    rules: Known,
    found: Sequence[Rules],
    report: Report,
) -> None:
    """Report the fields that need a rule, the data that is lost, and rules that were not named."""
    folders = sorted({options.scope.root.shown(each.file.parent) for each in found})
    words = [options.again, *(f"--rules {shlex.quote(folder)}" for folder in folders)]
    running = " ".join([*words, "--diff"] if options.out is None else words)
    every = Known((*rules.files, *found))
    useful: set[str] = set()
    for entry in plans:
        if entry.plan is None:
            if not options.allow_loss:
                hint = "--allow-loss keeps these messages under their old type"
                message = f"`{entry.topic}`: type `{entry.type}` was removed"
                report.add(codes.DATA_LOST.of(entry.recording, message, hint=hint))
            continue
        if found:
            planned = make_plan(entry.plan.old, entry.plan.new, every)
            used = {part.rules.path for part in planned.walk() if part.rules}
            useful |= used & {each.path for each in found}
        for finding in entry.plan.missing:
            package = finding.type.partition("/")[0]
            home = target.homes.get(package)
            place = options.scope.root.shown(home / RULES) if home else RULES
            covered = folders and not make_plan(entry.plan.old, entry.plan.new, every).missing
            if covered:
                hint = f"run the rules: `{running}`"
            else:
                hint = f"write a rule: `{options.again} --write-rules {shlex.quote(place)}`"
            message = f"`{entry.topic}` needs a rule for `{finding.path}`: {finding.reason}"
            labels = (Label(finding.old, "recorded version"),) if finding.old else ()
            span = finding.span
            report.add(codes.RULE_NEEDED.at(span, message, hint=hint, labels=labels))
    report.raise_errors()
    if useful:
        listed = ", ".join(f"`{path}`" for path in sorted(useful))
        report.notes.append(f"idlc did not run the rules in {listed}; run them with `{running}`")


def definition_of(version: Version) -> str:
    """Return the text that a recorder writes for a type: its file, and those that it refers to."""
    model = version.models[version.name.package]
    interface = model.interfaces[interface_of(version.name)]
    return definition_text(interface, model)


def _write(
    result: UpgradeResult,
    options: UpgradeOptions,
    run: RunRules,
    report: Report,
    progress: Progress,
) -> None:
    """Write each recording; report those that cannot be, and go on with the others."""
    from idlc.recordings.rewrite import mcap_name, rewrite

    root = options.scope.root
    out = Path(root.path(options.out or "."))
    targets: dict[str, str] = {}
    for recording in options.recordings:
        name = mcap_name(Path(os.path.normpath(root.path(recording))))
        shown = f"{str(options.out).rstrip('/')}/{name}"
        if os.path.lexists(out / name) or shown in targets.values():
            what = "is the name of two recordings" if shown in targets.values() else "exists"
            hint = "choose another folder with -o"
            report.add(codes.EXISTING_FILE.of(shown, f"`{shown}` {what}", hint=hint))
        targets[recording] = shown
    if report.errors:
        return
    for recording, shown in targets.items():
        plans = [each for each in result.plans if each.recording == recording]
        try:
            conversions = _conversions(plans, result.undefined[recording], run)
            source, to = root.path(recording), root.path(shown)
            summary = rewrite(source, to, conversions, progress, strict=options.strict)
        except (RecordingError, UpgradeError) as error:
            advice = getattr(error, "hint", None)
            report.add(codes.CONVERSION_FAILED.of(recording, str(error), hint=advice))
        else:
            result.written.append((recording, shown, summary))
            report.extend(damage_problems(recording, summary.damage))
            if _has_db3(Path(root.path(recording))):
                report.notes.append(PLUGIN)
    report.notes[:] = dict.fromkeys(report.notes)


#: The note about MCAP files that were .db3 files.
PLUGIN = (
    "the new recordings are MCAP files; ROS 2 Humble plays them if the package "
    "ros-humble-rosbag2-storage-mcap is installed"
)


def _has_db3(path: Path) -> bool:
    return path.suffix == ".db3" or (path.is_dir() and any(path.glob("*.db3")))


def _conversions(
    plans: Iterable[TopicPlan], undefined: Iterable[UndefinedTopic], run: RunRules
) -> conversion.Conversions:
    """Return the conversions of each topic; raise UpgradeError if rules cannot be run."""
    conversions: dict[str, conversion.Conversion | tuple[conversion.Conversion, ...]] = {}

    def add(entry: TopicPlan | UndefinedTopic, own: conversion.Conversion) -> None:
        if not entry.several:
            conversions[entry.topic] = own
            return
        others = conversions.get(entry.topic, ())
        assert isinstance(others, tuple)
        conversions[entry.topic] = (*others, own._replace(old=entry.definition))

    for topic in undefined:
        key, text = topic.version.key, definition_of(topic.version)
        add(topic, conversion.Conversion(key.type, MSG, text, key.hash))
    ways: dict[int, Payloads] = {}
    for entry in plans:
        plan = entry.plan
        if plan is None:
            continue
        convert = None
        if not plan.same:
            way = ways[id(plan)] = ways.get(id(plan)) or Payloads(plan, run)
            structure = TopicType(dict(plan.old.models), plan.old.name).structure
            convert = partial(converted, way, structure, entry.topic)
        definition, new = definition_of(plan.new), plan.new.key
        add(entry, conversion.Conversion(new.type, MSG, definition, new.hash, convert))
    return conversions


def converted(
    way: Payloads,
    structure: Structure,
    topic: str,
    payloads: Sequence[Any],
    times: Sequence[int],
) -> list[bytes]:
    """Return new payloads; errors name the topic and the time of the message.

    A message that is longer than its type is an error.
    """
    unread = unread_bytes(structure, payloads)
    number = None if unread is None else first_longer(structure, unread, payloads)
    if number is not None:
        what = f"{unread[number]:,} bytes that the definition of {structure.name} does not read"
        raise RecordingError(f"`{topic}` at {times[number]} ns has {what}")
    return way.many(payloads, lambda number: f"`{topic}` at {times[number]} ns")
