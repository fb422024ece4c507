"""Text from interface files never becomes code, and comes out as it went in."""

import ast
import subprocess
import sys

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from jinja2 import UndefinedError

from idlc.generate.python import lines, render
from idlc.generate.python import lines as literals
from idlc.model import ir, link
from idlc.project.templates import environment

HOSTILE = [
    '"""',
    "'''",
    '"',
    "\\",
    "\\\\",
    '\\"""',
    'x"',
    '"x',
    'a\\" b',
    "\nimport os",
    "\r\n'''\nprint(1)",
    "{{ module }}",
    "{% for x in y %}",
    "{# comment #}",
    "\x00",
    "\x1b[31m",
    "\u202e\u2066evil",
    "\u2028\u0085\x0c",
    "\ud800",
    "\\N{BULLET} \\u0041 \\x41",
    "tab\there",
    "# noqa",
    "漢字 é 😀",
    "%s {0} $HOME `ls`",
    "    indented",
    "",
]
TEXT = st.sampled_from(HOSTILE) | st.text(max_size=12)


def page(text, *more):
    """Return the module of a message in which a text stands wherever one can."""
    lines = (text, *more)
    string = ir.String()
    message = ir.Message(
        name=ir.TypeName("hostile_msgs", "msg", "X"),
        comment=lines,
        fields=(
            ir.Field(
                name="a",
                type=string,
                default=ir.Default(text, text),
                comment=lines,
                unit=text,
            ),
            ir.Field(
                name="b",
                type=ir.Sequence(string),
                default=ir.Default((*lines, "long" * 20), ""),
                comment=lines,
            ),
        ),
        constants=(ir.Constant(name="C", type=string, value=text, comment=lines, unit=text),),
    )
    model = link.Model("hostile_msgs", (message,), {message.name: message})
    return next(render.module_files(message, model, {message.name: "_it"})).text


def shape(code):
    """Return a module's syntax tree without the content of its strings."""
    tree = ast.parse(code)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            node.value = ""
    return ast.dump(tree)


BENIGN = shape(page("x", "x"))


@given(TEXT, TEXT)
@example('"""', '"')
@example("\\", '"""\\')
def test_no_text_changes_what_the_module_does(text, more):
    code = page(text, more)
    assert shape(code) == BENIGN
    assert all(c.isprintable() or c == "\n" for c in code)
    found = ast.parse(code)
    values = [n.value for n in ast.walk(found) if isinstance(n, ast.Constant)]
    assert text in values


@pytest.mark.parametrize("text", HOSTILE)
def test_a_literal_is_read_back_as_the_text(text):
    assert ast.literal_eval(lines.string_literal(text)) == text


@given(st.lists(TEXT, min_size=1, max_size=4), st.booleans())
def test_a_docstring_is_read_back_as_its_lines(lines, one_line):
    shown = literals.docstring([literals.prose(line) for line in lines], one_line=one_line)
    end = "" if one_line and len(lines) == 1 else "\n"
    read = ast.literal_eval(f'"""{shown}{end}"""')
    for line in lines:
        assert "".join(c for c in line if c.isalnum()) in "".join(
            c for c in read if c.isalnum()
        ) or any(not c.isprintable() for c in line)


@pytest.mark.parametrize("value", range(256))
def test_an_octet_is_read_back(value):
    assert ast.literal_eval(lines.octet(value)) == bytes([value])


@pytest.fixture(scope="module")
def hostile_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile")
    for number, text in enumerate(HOSTILE):
        (folder / f"m{number}.py").write_text(page(text, text), encoding="utf-8")
    return folder


def test_pages_of_hostile_text_are_formatted_and_clean(hostile_folder):
    for command in (
        ["format", "--check", "--diff"],
        ["check", "--ignore=PLE,RUF001,RUF002,RUF003"],
    ):
        result = subprocess.run(
            [sys.executable, "-m", "ruff", *command, "--isolated", "--no-cache", hostile_folder],
            capture_output=True,
            text=True,
            check=False,
        )
        assert result.returncode == 0, result.stdout + result.stderr


def test_an_unknown_name_in_a_template_is_an_error():
    with pytest.raises(UndefinedError):
        environment().from_string("{{ nothing }}").render()
