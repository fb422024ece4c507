"""The rules of a package as `idlc check` and `idlc breaking` judge them, which run none of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from idlc.diagnostics import codes
from idlc.diagnostics.report import Diagnostic, Label, Report
from idlc.diagnostics.text import did_you_mean
from idlc.model import ir
from idlc.model.link import Model
from idlc.model.python_names import field as attribute
from idlc.project.files import is_folder
from idlc.project.find import RULES
from idlc.project.root import Root
from idlc.versions.changes import Change
from idlc.versions.conversion import Plan, Version, VersionKey, direct_plan, make_plan
from idlc.versions.rules import Known, Rules, read_rules, rule_files


def rule_folders(folders: Iterable[Path]) -> list[str]:
    """Return the folders of rules beside the messages of packages."""
    return [str(folder / RULES) for folder in folders if is_folder(folder / RULES)]


def rule_problems(folders: Sequence[str], model: Model, root: Root) -> Iterator[Diagnostic]:
    """Yield the problems of the rules in folders, which end at versions of a model."""
    report = Report()
    files, bad = read_rules(rule_files(folders, root), root, report)
    yield from report
    for error in bad:
        yield codes.BAD_RULES.at(error.span, str(error))
    yield from _ambiguous(files)
    known = Known(files)
    for rules in files:
        yield from _of_file(rules, known, model)


def _ambiguous(files: Sequence[Rules]) -> Iterator[Diagnostic]:
    pairs: dict[tuple[VersionKey, VersionKey], Rules] = {}
    for rules in files:
        first = pairs.setdefault((rules.old, rules.new), rules)
        if first is not rules:
            message = f"`{first.path}` has rules for the same versions"
            hint = "keep one of the two files"
            labels = (Label(first.top, "first file"),)
            yield codes.AMBIGUOUS_RULE.at(rules.top, message, hint=hint, labels=labels)
        spans: dict[str, Label] = {}
        for name, span in rules.spans:
            if name in spans:
                message = f"`{name}` has two rules; Python runs the last rule"
                labels = (spans[name],)
                hint = "remove one of them"
                yield codes.AMBIGUOUS_RULE.at(span, message, hint=hint, labels=labels)
            spans.setdefault(name, Label(span, "first rule"))


def _of_file(rules: Rules, known: Known, model: Model) -> Iterator[Diagnostic]:
    try:
        name = ir.TypeName.parse(rules.new.type)
    except ValueError:
        name = None
    if name is None or name not in model.messages:
        if not known.starting(rules.new):
            message = f"type `{rules.new.type}` does not exist"
            hint = "remove the rules, or write rules that lead to its successor"
            yield codes.STALE_RULE.at(rules.top, message, hint=hint)
        return
    current = Version({name.package: model}, name)
    new = current if current.key == rules.new else known.version(rules)
    if new is None:
        message = f"`{rules.new.short}` is not the current version, which is {current.key.short}"
        hint = "write them again with `idlc upgrade REC --write-rules DIR`"
        yield codes.STALE_RULE.at(rules.top, message, hint=hint)
        return
    if new is not current:
        missing = make_plan(new, current, known).missing
        if missing:
            fields = ", ".join(f"`{each.path}`" for each in missing)
            message = f"the rules end at `{new.key.short}`; from there on, {fields} needs a rule"
            hint = "write the rule with `idlc upgrade REC --write-rules DIR`"
            yield codes.STALE_RULE.at(rules.top, message, hint=hint)
    fields_of = {attribute(field.name): field.name for field in new.message.fields}
    for function, span in rules.spans:
        if function not in fields_of:
            message = f"`{function}` is not a field of `{new.key.short}`"
            near = did_you_mean(function, list(fields_of))
            hint = near or "begin the name of a helper function with an underscore"
            yield codes.STALE_RULE.at(span, message, hint=hint)
    old = known.version_beside(rules, rules.old)
    if old is not None:
        for field in direct_plan(old, new, rules).fields:
            if field.finding.fate == "needs a rule":
                message = f"no rule for `{field.new.name}`: {field.finding.reason}"
                body = field.finding.proposal
                hint = f"add `def {attribute(field.new.name)}(old: {old.key.short})`"
                hint += f" that returns `{body}`" if body else ""
                yield codes.MISSING_RULE.at(rules.top, message, hint=hint)


def with_rules(
    changes: Iterable[Change],
    before: Mapping[str, Model],
    after: Mapping[str, Model],
    folders: Sequence[str],
    root: Root,
) -> tuple[Change, ...]:
    """Return changes, with the rule that converts recorded data as the hint of those that have one.

    `folders` are those of rules; `before` and `after` are the packages.
    """
    known = Known(read_rules(rule_files(folders, root), root, Report())[0])
    plans: dict[str, Plan | None] = {}
    result: list[Change] = []
    for change in changes:
        name = change.subject.partition(".")[0]
        if name not in plans:
            plans[name] = _ruled(name, before, after, known)
        plan = plans[name]
        for field in plan.fields if plan and plan.rules else ():
            spans = field.new.name_span, field.new.type_span
            mine = change.span in spans and change.span is not None
            if field.finding.fate == "rule" and plan and plan.rules and mine:
                hint = f"the rule in {plan.rules.path} converts recorded data"
                change = change._replace(hint=hint)
        result.append(change)
    return tuple(result)


def _ruled(
    text: str, before: Mapping[str, Model], after: Mapping[str, Model], known: Known
) -> Plan | None:
    """Return the plan of a type that has rules for exactly these two versions."""
    try:
        name = ir.TypeName.parse(text)
        old, new = (Version({name.package: side[name.package]}, name) for side in (before, after))
        starting = known.starting(old.key)
    except (KeyError, ValueError):
        return None
    rules = next((rules for rules in starting if rules.new == new.key), None)
    return direct_plan(old, new, rules) if rules else None
