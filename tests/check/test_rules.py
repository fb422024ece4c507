"""The registry of rules: constants, slugs, codes and checks tell the same story."""

import re
from pathlib import Path

import pytest

from idlc.check import registry
from idlc.cli.main import main
from idlc.diagnostics import codes
from idlc.diagnostics.explain import page
from idlc.diagnostics.report import Report, Severity
from tests.support import golden_text
from tests.support.paths import GOLDEN

CASES = GOLDEN / "diag"
LISTS = ("verdicts", "advice", "package_advice")
RULES = {name: getattr(registry, name)() for name in LISTS}
ADVICE = (*RULES["advice"], *RULES["package_advice"])


def test_constants_are_called_like_their_slugs():
    named = {name: one for name, one in vars(codes).items() if isinstance(one, codes.Code)}
    assert [one.slug for one in named.values()] == [
        name.lower().replace("_", "-") for name in named
    ]
    assert len({one.id for one in named.values()}) == len(named) == len(codes.CODES)


def test_advice_can_be_chosen_by_category_and_errors_cannot():
    assert {one.category for one in codes.CODES.values()} == set(codes.CATEGORIES)
    for rule in ADVICE:
        assert [one.severity for one in rule.codes] == [Severity.WARNING] * len(rule.codes)
    for one in codes.CODES.values():
        assert one.default or one.severity is Severity.WARNING


@pytest.mark.parametrize("code", codes.CODES)
def test_a_page_says_whether_its_code_is_off(code):
    text = " ".join((page(code) or "").split())
    assert ("Off unless it is selected" in text) is not codes.CODES[code].default


def test_a_terminal_gets_each_page_without_its_markup(monkeypatch, capsys):
    monkeypatch.setenv("FORCE_COLOR", "1")
    for code in codes.CODES:
        assert main(["explain", code]) == 0
        out = capsys.readouterr().out
        plain = re.sub("\x1b\\[[0-9]*m", "", out)
        assert plain != out
        assert not re.search(r"(?m)^## |```", plain)
        words = re.sub("[`#]", "", page(code)).replace("console\n", "\n").split()
        assert plain.replace("`", "").replace("#", "").split() == words


def test_every_code_of_advice_has_a_rule_of_its_own():
    reported = [code for rule in ADVICE for code in rule.codes]
    assert len(reported) == len(set(reported))
    assert {one.id for one in reported} == {id_ for id_ in codes.CODES if "IDL400" < id_ < "IDL490"}


def test_every_rule_reports_the_codes_that_it_is_listed_with(tmp_path, capsys, monkeypatch):
    reported = {}

    def watched(rule):
        def check(*words):
            *facts, report = words
            found = Report()
            rule.check(*facts, found)
            reported.setdefault(rule.check, set()).update(one.code for one in found)
            report.extend(found)

        return rule._replace(check=check)

    for name, rules in RULES.items():
        watching = tuple(map(watched, rules))
        monkeypatch.setattr(registry, name, lambda watching=watching: watching)
    listed = {rule.check: {one.id for one in rule.codes} for one in RULES.values() for rule in one}
    for path in sorted(CASES.glob("*.txt")):
        if path.stem[:6] in set.union(*listed.values()):
            case = golden_text.read(path.read_text(encoding="utf-8"))
            folder = tmp_path / path.stem
            folder.mkdir()
            with monkeypatch.context() as inner:
                golden_text.run(case, folder, capsys, inner)
    assert reported == listed


@pytest.mark.parametrize(
    ("words", "asked"),
    [([], False), (["--select", "style"], True), (["--select", "IDL451"], False)],
)
def test_a_rule_that_nobody_wants_is_not_asked(words, asked, tmp_path, capsys, monkeypatch):
    seen = []
    rule = registry.Rule(lambda model, _: seen.append(model), (codes.UNDOCUMENTED_FIELD,))
    monkeypatch.setattr(registry, "advice", lambda: (rule,))
    monkeypatch.chdir(tmp_path)
    Path("msg").mkdir()
    Path("msg/Drive.msg").write_text("int8 speed\n")
    assert main(["check", *words]) == 0
    assert bool(seen) is asked
