"""A console script is added to any setup.py correctly, or not at all."""

import ast
import io
import re
import tokenize

import pytest

from idlc.packaging.entry_points import ConsoleScript, add_to_setup
from idlc.packaging.files import Edited, Refused
from tests.support.examples import HealthCheck, given, settings, st

TALKER = ConsoleScript("talker", "demo.talker:main")
HEAD = "from setuptools import setup\n\npackage_name = 'demo'\n"


def entries(text: str) -> list[str]:
    """Return the console scripts that setuptools would see: the file is run."""
    seen = {}
    tree = ast.parse(text)
    tree.body = [node for node in tree.body if not isinstance(node, (ast.Import, ast.ImportFrom))]
    names = {"setup": seen.update, "NODES": ["a", "b"], "OTHER": {"x": ["y = z:main"]}}
    exec(compile(tree, "setup.py", "exec"), names)  # noqa: S102 - our own text
    points = seen.get("entry_points", {})
    if isinstance(points, str):
        lines = points.split("[console_scripts]")[1].split("[")[0].splitlines()
        return [line.strip() for line in lines if line.strip()]
    scripts = points.get("console_scripts", [])
    if isinstance(scripts, str):
        return [line.strip() for line in scripts.splitlines() if line.strip()]
    return list(scripts)


def comments(text: str) -> list[str]:
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return [token.string for token in tokens if token.type == tokenize.COMMENT]


LISTS = {
    "empty": "[]",
    "empty, spread": "[\n        ]",
    "one line": "['a = demo.a:main']",
    "spread": "[\n            'a = demo.a:main',  # first\n        ]",
    "no last comma": "[\n            'a = demo.a:main'  # first\n            # more\n        ]",
    "hanging": "['a = demo.a:main',\n                            'b = demo.b:main']",
    "double quotes": '["a = demo.a:main"]',
    "tuple": "('a = demo.a:main',)",
    "f-string": "[f'a = {package_name}.a:main']",
    "sum": "['a = demo.a:main'] + [f'{n}2 = demo.{n}:main' for n in NODES]",
    "text": "'a = demo.a:main'",
    "lines": "'''\n            a = demo.a:main\n        '''",
}
ENTRY_POINTS = {
    "dict": "{{\n        'console_scripts': {},\n    }}",
    "dict of more": "{{'gui_scripts': [], 'console_scripts': {}}}",
    "dict call": "dict(console_scripts={})",
    "merged": "{{**OTHER, 'console_scripts': {}}}",
}
SETUPS = {
    "spread": "setup(\n    name=package_name,\n    entry_points={},\n)\n",
    "one line": "setup(name=package_name, entry_points={}, zip_safe=True)\n",
    "variable": "POINTS = {}\nsetup(name=package_name, entry_points=POINTS)\n",
    "block": "if True:\n    setup(\n        name='demo',\n        entry_points={},\n    )\n",
}
WHOLE = {
    "none": "setup(name='demo')\n",
    "none, spread": "setup(\n    name='demo',  # who\n    version='1',\n    # the end\n)\n",
    "no argument": "setup()\n",
    "no scripts": "setup(name='demo', entry_points={'x': ['y = z:main']})\n",
    "ini": "setup(entry_points='''\n [console_scripts]\n a = demo.a:main\n\n [x]\n y = z\n ''')\n",
    "ini at the end": "setup(entry_points='''[console_scripts]\na = demo.a:main''')\n",
}


def check(text: str) -> None:
    before = entries(text)
    outcome = add_to_setup(text, TALKER)
    assert isinstance(outcome, Edited), outcome
    after = outcome.text
    assert entries(after) == [*before, TALKER.line]
    assert comments(after) == comments(text)
    assert add_to_setup(after, TALKER) == outcome
    gone = [line for line in text.splitlines() if line not in after.splitlines()]
    assert len(gone) <= 2, "lines that have nothing to do with it were changed"


@pytest.mark.parametrize("setup", SETUPS.values(), ids=SETUPS)
@pytest.mark.parametrize("points", ENTRY_POINTS.values(), ids=ENTRY_POINTS)
@pytest.mark.parametrize("scripts", LISTS.values(), ids=LISTS)
def test_every_shape_of_entry_points(setup, points, scripts):
    text = HEAD + setup.replace("{}", points.format(scripts))
    if scripts == LISTS["sum"]:  # the new entry is not the last one then
        outcome = add_to_setup(text, TALKER)
        assert isinstance(outcome, Edited)
        assert TALKER.line in entries(outcome.text)
        return
    check(text)


@pytest.mark.parametrize("setup", WHOLE.values(), ids=WHOLE)
def test_entry_points_that_are_missing_or_one_text(setup):
    check(HEAD + setup)


def test_line_ends_stay():
    text = (HEAD + SETUPS["spread"].replace("{}", "{'console_scripts': [\n    ]}")).replace(
        "\n", "\r\n"
    )
    outcome = add_to_setup(text, TALKER)
    assert isinstance(outcome, Edited)
    assert outcome.text.count("\r\n") == outcome.text.count("\n")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("setup(entry_points={'console_scripts': [f'{n} = d.{n}:main' for n in NODES]})", "list"),
        ("setup(entry_points=points())", "dictionary"),
        ("setup(**metadata)", r"\*\*"),
        ("KEY = 'url'\nsetup(**{KEY: 'x'})", r"\*\*"),
        ("setup(entry_points={**OTHER})", r"\*\*"),
        ("P = {}\nP = {'console_scripts': []}\nsetup(entry_points=P)", "exactly one place"),
        ("setup(name='a')\nsetup(name='b')", "2 calls"),
        ("print('hello')", "no calls"),
        ("setup(", "not valid Python"),
        ("setup(entry_points={'console_scripts': ['talker = other:main']})", "already the command"),
        ("setup(entry_points='[console_scripts]\\n')", "escapes"),
    ],
)
def test_what_is_refused_with_the_line_to_add(text, why):
    outcome = add_to_setup(f"from setuptools import setup\n{text}\n", TALKER)
    assert isinstance(outcome, Refused)
    assert TALKER.line in outcome.line
    assert re.search(why, outcome.why), outcome.why


def test_a_line_that_was_added_by_hand_is_found_anywhere():
    text = HEAD + "EXTRA = ['talker=demo.talker:main']\nsetup(entry_points=points(EXTRA))\n"
    assert add_to_setup(text, TALKER) == Edited(text)


indents = st.sampled_from(["    ", "  ", "\t", "        "])
quotes = st.sampled_from(["'", '"'])
notes = st.sampled_from(["", "  # a note", '  # it\'s "quoted", [brackets] {and} = signs'])
names = st.lists(st.from_regex(r"[a-z][a-z_]{0,8}[a-z]", fullmatch=True), unique=True, max_size=5)


@st.composite
def setup_files(draw):
    """Return a setup.py as somebody might have written it."""
    indent, quote = draw(indents), draw(quotes)
    nodes = [name for name in draw(names) if name != "talker"]
    spread, last_comma = draw(st.booleans()), draw(st.booleans())
    lines = [f"{quote}{name} = demo.{name}:main{quote}" for name in nodes]
    if spread:
        body = ",".join(f"{draw(notes) if n else ''}\n{indent * 3}{x}" for n, x in enumerate(lines))
        comma = "," if lines and last_comma else ""
        scripts = f"[{body}{comma}{draw(notes)}\n{indent * 2}]"
    else:
        scripts = f"[{', '.join(lines)}{',' if lines and last_comma else ''}]"
    key = f"{quote}console_scripts{quote}"
    points = f"{{\n{indent * 2}{key}: {scripts},{draw(notes)}\n{indent}}}"
    arguments = [f"name={quote}demo{quote}", f"version={quote}1{quote}", f"entry_points={points}"]
    arguments = draw(st.permutations(arguments))
    called = "setup"
    head = "from setuptools import setup\n"
    if draw(st.booleans()):
        head, called = "from setuptools import setup as install_it\n", "install_it"
    text = ",".join(f"\n{indent}{one}" for one in arguments)
    return f"{head}{draw(notes).strip()}\n\n{called}({text}{draw(st.sampled_from(['', ',']))}\n)\n"


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(setup_files())
def test_no_setup_file_is_ever_corrupted(text):
    outcome = add_to_setup(text, TALKER)
    assert isinstance(outcome, Edited), outcome
    before, after = (one.replace("install_it", "setup") for one in (text, outcome.text))
    assert entries(after) == [*entries(before), TALKER.line]
    assert comments(after) == comments(before)
    assert add_to_setup(outcome.text, TALKER) == outcome
