"""The registry of rules: constants, slugs and codes tell the same story."""

import inspect
import re

import pytest

from idlc.check import portability, registry, style
from idlc.cli.main import main
from idlc.compiler import verdicts
from idlc.diagnostics import codes
from idlc.diagnostics.explain import page
from idlc.diagnostics.report import Severity


def test_constants_are_called_like_their_slugs():
    named = {
        name: one for name, one in vars(codes).items() if isinstance(one, codes.DiagnosticCode)
    }
    assert [one.slug for one in named.values()] == [
        name.lower().replace("_", "-") for name in named
    ]
    assert len({one.id for one in named.values()}) == len(named) == len(codes.CODES)


def test_advice_can_be_chosen_by_category_and_errors_cannot():
    assert {one.category for one in codes.CODES.values()} == set(codes.CATEGORIES)
    for one in codes.CODES.values():
        assert one.severity is Severity.WARNING or not "IDL400" < one.id < "IDL500"
        assert one.default or one.severity is Severity.WARNING


@pytest.mark.parametrize("code", codes.CODES)
def test_a_page_says_whether_its_code_is_off(code):
    text = " ".join((page(code) or "").split())
    assert ("This rule is off by default." in text) is not codes.CODES[code].default


def test_a_terminal_gets_each_page_without_its_markup(monkeypatch, capsys):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "80")
    for code in codes.CODES:
        assert main(["explain", code]) == 0
        out = capsys.readouterr().out
        plain = re.sub("\x1b\\[[0-9]*m", "", out)
        assert plain != out
        assert not re.search(r"(?m)^## |```", plain)
        prose = [line for line in plain.splitlines() if not line.startswith("    ")]
        assert max(map(len, prose)) <= 80
        words = re.sub("[`#]", "", page(code)).replace("console\n", "\n").split()
        assert plain.replace("`", "").replace("#", "").split() == words


def test_every_rule_is_registered():
    rules = {
        rule
        for module in (verdicts, portability, style)
        for name, rule in vars(module).items()
        if not name.startswith("_") and getattr(rule, "__module__", "") == module.__name__
        if [*inspect.signature(rule).parameters] == ["model"]
    }
    assert rules == {*verdicts._OF_PACKAGES, *verdicts._VERDICTS, *registry._ADVICE}
