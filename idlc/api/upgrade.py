"""`idlc.upgrade(old, new)`: a converter between two classes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from pathlib import Path
from typing import Any

from idlc.api.upgraded import Upgraded
from idlc.diagnostics.report import Report
from idlc.project.root import Root
from idlc.recordings.arguments import message_class, texts
from idlc.recordings.columns import to_arrow, to_columns
from idlc.recordings.containers.messages import Separate
from idlc.versions.classes import version_of
from idlc.versions.conversion import NO_RULES, FieldFate, Plan, RuleFiles, make_plan
from idlc.versions.converters import Converters, Functions, words_of
from idlc.versions.exact import Payloads
from idlc.versions.rules import Known, read_rules, rule_files, run_rules


class UpgradeError(ValueError):
    """Two versions of a type between which nobody has said how to convert.

    `findings` are the fields that need a rule.
    """

    def __init__(self, message: str, findings: Iterable[FieldFate] = ()) -> None:
        super().__init__(message)
        self.findings = tuple(findings)


def named_rules(rules: Any) -> tuple[RuleFiles, dict[str, Path]]:
    """Return the rules in a file or folder, or several of them, and the files by their names."""
    if rules is None:
        return NO_RULES, {}
    paths = texts(rules, "the files of `rules`")
    root, report = Root.here(), Report()
    files, bad = read_rules(rule_files(paths, root), root, report)
    for error in bad:
        line, _ = error.span.source.position(error.span.start)
        raise UpgradeError(f"{error.span.source.path}:{line}: {error}")
    for problem in report.errors:
        raise UpgradeError(problem.message)
    return Known(files), {file.path: file.file for file in files}


class Runner:
    """Runs files of rules that were named, each once."""

    def __init__(self, files: dict[str, Path]) -> None:
        self._files = files
        self._functions: dict[str, Functions] = {}

    def __call__(self, path: str) -> Functions:
        """Return the functions in a file."""
        if path not in self._functions:
            try:
                self._functions[path] = run_rules(self._files[path])
            except KeyboardInterrupt:
                raise
            except BaseException as error:  # SystemExit would end idlc without a word
                raise UpgradeError(f"{path} cannot be run: {words_of(error)}") from error
        return self._functions[path]


def complete(plan: Plan) -> Plan:
    """Return a plan; raise UpgradeError if a field in it needs a rule."""
    if plan.missing:
        lines = "; ".join(f"{each.path}: {each.reason}" for each in plan.missing)
        message = f"{plan.old.key.short} needs rules to become {plan.new.key.short}: {lines}"
        raise UpgradeError(message, plan.missing)
    return plan


class Upgrade:
    """Converts messages of one version of a type to another: objects, bytes and columns.

    It can be pickled, with the paths of its rules.
    """

    def __init__(self, old: Any, new: Any, rules: Any = None) -> None:
        known, files = named_rules(rules)
        self._arguments = old, new, rules
        self._run = Runner(files)
        before, after = (version_of(message_class(kind)) for kind in (old, new))
        self.plan = complete(make_plan(before, after, known))

    def __repr__(self) -> str:
        return f"<Upgrade from {self.plan.old.key.short} to {self.plan.new.key.short}>"

    def __reduce__(self) -> Any:
        return Upgrade, self._arguments

    @property
    def old(self) -> Any:
        """The class of the earlier version."""
        return self._arguments[0]

    @property
    def findings(self) -> list[FieldFate]:
        """The changed fields, at any depth."""
        return self.plan.findings()

    @cached_property
    def _message(self) -> Any:
        return Converters(self._run).message(self.plan)

    @cached_property
    def _payloads(self) -> Payloads:
        return Payloads(self.plan, self._run)

    def message(self, message: Any) -> Any:
        """Return the message of the new class; it shares nothing with the old one.

        Raises ValidationError for a value of a rule that does not fit.
        """
        fields = self.old._fields_and_field_types  # noqa: SLF001
        if getattr(type(message), "_fields_and_field_types", None) != fields:
            raise TypeError(f"{message!r} is not a message of {self.plan.old.key.short}")
        return self._message(message)

    def payload(self, payload: Any) -> bytes:
        """Return the new bytes of one serialized message; see `many`."""
        return self.many([payload])[0]

    def many(
        self,
        payloads: Iterable[Any],
        place: Callable[[int], str] = lambda number: f"message {number}",
    ) -> list[bytes]:
        """Return the new bytes of serialized messages; copies where the versions are alike.

        Raises idlc's RecordingError, in which `place` names the message.
        """
        if self.plan.same:
            return [each if type(each) is bytes else bytes(memoryview(each)) for each in payloads]
        return self._payloads.many(payloads, place)

    def columns(self, payloads: Iterable[Any], **options: Any) -> Any:
        """Return serialized messages as columns of the new type, as its `to_columns` does."""
        return to_columns(self._arguments[1], self._upgraded(payloads), **options)

    def arrow(self, payloads: Iterable[Any], **options: Any) -> Any:
        """Return serialized messages as a table of the new type, as its `to_arrow` does."""
        return to_arrow(self._arguments[1], self._upgraded(payloads), **options)

    def _upgraded(self, payloads: Iterable[Any]) -> Upgraded:
        return Upgraded(None, None, Separate(None, None, list(payloads)), self)


def upgrade(old: Any, new: Any, rules: Any = None) -> Upgrade:
    """Return the converter from one version of a message class to another.

    `rules` is a file or folder of rules, or several of them, which are run. Raises UpgradeError if
    the classes differ in a way that needs a rule that is not there.
    """
    return Upgrade(old, new, rules)
