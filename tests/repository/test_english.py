"""Documents, help, problems and rules are in the English of the field, as in `english.py`."""

import ast
import re
from collections.abc import Iterator

import pytest

from idlc.diagnostics.codes import CODES
from idlc.diagnostics.explain import page
from tests.repository import english
from tests.support.command_line_page import commands
from tests.support.paths import DOCS, ROOT

# Their words come from idlc/ and templates/.
GENERATED = {DOCS / "command-line.md"}
OUTSIDE = (
    *("README.md", "CONTRIBUTING.md", "SECURITY.md", "RELEASING.md", "CHANGELOG.md"),
    *("CODE_OF_CONDUCT.md", "editors/README.md", "editors/vscode/README.md"),
    "examples/my_robot_controller/README.md",
)
OTHERS = [ROOT / path for path in (*OUTSIDE, "maintenance/website/landing.md")]
PAGES = [path for path in [*OTHERS, *sorted(DOCS.rglob("*.md"))] if path not in GENERATED]


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_the_words_do_not_come_back(page):
    assert english.problems(page.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("code", CODES)
def test_rules_are_explained_without_the_words(code):
    assert english.problems(page(code) or "") == []


@pytest.mark.parametrize("command", [command for command, _ in commands()], ids=lambda c: c.name)
def test_help_is_without_the_words(command):
    texts = [command.help, *(getattr(param, "help", None) for param in command.params)]
    assert [problem for text in texts for problem in english.problems(text or "")] == []


SENTENCE = re.compile(r"(?m)^(?:(?:error|warning)\[IDL\d+\]: (?:\[\*\] )?| *= hint: |note: )(.*)$")


@pytest.mark.parametrize("case", sorted((ROOT / "golden/diag").glob("*.txt")), ids=lambda p: p.stem)
def test_problems_are_reported_without_the_words(case):
    sentences = SENTENCE.findall(case.read_text(encoding="utf-8"))
    assert [problem for text in sentences for problem in english.problems(text)] == []


def printed(path) -> Iterator[str]:
    """Yield the strings of a module that read like sentences, without docstrings."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        for child in ast.iter_child_nodes(node):
            text = child.value if isinstance(child, ast.Constant) else None
            if isinstance(text, str) and not isinstance(node, ast.Expr) and len(text.split()) > 2:
                yield text


def test_strings_in_the_code_are_without_the_words():
    problems = {
        f"{path.name}: {text}": complaints
        for path in (ROOT / "idlc").rglob("*.py")
        for text in printed(path)
        if (complaints := english.problems(text))
    }
    assert problems == {}


#: A comment or a docstring in a template.
COMMENT = re.compile(r'(?:^|\s)# (.*)$|"""(.*?)"""', re.MULTILINE)


def test_generated_files_are_without_the_words():
    templates = [*(ROOT / "templates").rglob("*.jinja")]
    assert len(templates) > 50
    problems = {
        path.name: complaints
        for path in templates
        for words in COMMENT.findall(path.read_text(encoding="utf-8"))
        if (complaints := english.problems("".join(words)))
    }
    assert problems == {}


@pytest.mark.parametrize(
    "text",
    [
        "It tells you.",
        "That changes\nare meant is fine.",
        "`x` is no file",
        "Who runs nodes has ROS 2.",
        "True. What comes after it is skipped.",
        "* What it is, and\n  what not.",
        "The name is that of the package.",
    ],
)
def test_a_pattern_matches(text):
    assert english.problems(text)


@pytest.mark.parametrize(
    "text",
    [
        "What does it do? A lot.",
        "# What changes",
        "`it tells` you",
        "```\nit tells\n```\n",
        "    it tells\n",
        "It is no longer there, and there is no other.",
        "[link](what-is-said.md)",
    ],
)
def test_code_titles_and_questions_may_have_them(text):
    assert english.problems(text) == []
