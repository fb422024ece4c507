"""Text from interface files never becomes code, and comes out as it went in."""

import ast
import subprocess
import sys

import pytest
from jinja2 import UndefinedError
from msgspec import Struct
from msgspec.structs import asdict, replace

from idlc.generate.python import imports, literals, render
from idlc.generate.templates import Code, EscapedText, code
from idlc.model import ir, link
from idlc.model.python_names import modules
from tests.support import generated
from tests.support.examples import example, given, st

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
    return next(render.interface_files(model, imports.ALONE)).text


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
    assert ast.literal_eval(literals.string_literal(text)) == text


@given(TEXT, st.booleans())
def test_a_docstring_is_read_back_as_its_line(text, alone):
    shown = literals.prose(text)
    page = f'"""{literals.between_quotes(shown)}"""' if alone else f'"""\n{shown}\n"""'
    read = ast.literal_eval(page)
    if text.isprintable():
        assert read.strip() == text.strip()


@pytest.mark.parametrize("value", range(256))
def test_an_octet_is_read_back(value):
    assert ast.literal_eval(literals.octet(value)) == bytes([value])


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
        code().from_string("{{ nothing }}").render()


PLACED = [
    "{{ text }}",
    "{{ [text] | join(', ') }}",
    "{{ text | indent(4) }}",
    "{% macro show(words) %}{{ words }}{% endmacro %}{{ show(text) }}",
    "{% set words %}{{ text }}{% endset %}{{ words }}",
]
MADE = [
    "{{ text ~ text }}",
    "{{ text.upper() }}",
    "{{ text | replace('a', 'b') }}",
    "{{ text[1:] }}",
]


@pytest.mark.parametrize("template", PLACED)
def test_templates_place_code_and_text_and_no_other_string(template):
    page = code().from_string(template)
    for kind in (Code, EscapedText):
        assert page.render(text=kind("a + b")) == "a + b"
    for other in ("a + b", None, ["a"], b"a"):
        with pytest.raises(TypeError, match="a template may place Code and EscapedText, not"):
            page.render(text=other)


@pytest.mark.parametrize("template", MADE)
def test_what_templates_make_of_text_cannot_be_placed(template):
    with pytest.raises(TypeError, match="Code and EscapedText, not str"):
        code().from_string(template).render(text=EscapedText("a + b"))


def test_indented_lines_get_a_margin_unless_they_are_empty():
    text = EscapedText("a\n\nb")
    assert code().from_string("  {{ text | indent(2) }}").render(text=text) == "  a\n\n  b"


def views():
    """Yield each view of a package whose files are full of hostile text, and its template."""
    comments = "".join(f"# {text}\n" for text in HOSTILE if text.isprintable() and "\\" not in text)
    constant = 'string C = "{{ x }}"\n'
    fields = f'{comments}{constant}string a "x" # [m/s]\nfloat64[2] b [1, 2]\nHeader[] c\n'
    files = {
        "msg/Header.msg": "int8 list\n",
        "msg/Hostile.msg": f"{fields}std_msgs/Header d\n",
        "srv/Ask.srv": f"{fields}---\n{comments}",
        "action/Do.action": f"{fields}---\n---\n",
    }
    model = generated.model_of("hostile_msgs", files)
    names = modules(interface.name for interface in model.own)
    for interface in model.own:
        for module in render.module_views(interface, model.messages, names):
            yield module.template, {"module": module.view}
    for kind in ("msg", "srv", "action"):
        yield "package_init", {"package": imports.package(model, kind, names, imports.ALONE)}


def with_an_ordinary_string(view):
    """Yield a view once for each text in it, which is an ordinary string there."""
    match view:
        case str():
            assert isinstance(view, (Code, EscapedText)), view
            if view:
                yield f"{view} of others"
        case tuple():
            for place, part in enumerate(view):
                for other in with_an_ordinary_string(part):
                    yield (*view[:place], other, *view[place + 1 :])
        case Struct() | dict():
            parts = view if isinstance(view, dict) else asdict(view)
            for name, part in parts.items():
                for other in with_an_ordinary_string(part):
                    yield {**view, name: other} if view is parts else replace(view, **{name: other})


@pytest.mark.parametrize(("name", "view"), list(views()), ids=lambda value: str(value)[:12])
def test_each_text_of_a_view_is_placed_as_what_it_is(name, view):
    template = code().get_template(f"message/{name}.py.jinja")
    page = template.render(view)
    refused = 0
    for other in with_an_ordinary_string(view):
        try:
            assert template.render(other) == page, "an ordinary string was placed"
        except TypeError:
            refused += 1
    assert refused > 3
