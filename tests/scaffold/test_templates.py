"""Templates of a user's own: they replace idlc's, and a broken one is a problem at its line."""

import os
import random
import re
import shutil
import typing
from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.scaffold import templates
from idlc.scaffold.node import NodeView
from idlc.scaffold.node import TestView as ViewOfTest
from idlc.scaffold.package import Package
from idlc.scaffold.roles import ROLES
from idlc.scaffold.roles.role import Part
from idlc.scaffold.roles.role import TestPart as PartOfTest
from tests.scaffold.test_command import FOLDER, carry_out, nothing_installed, tree
from tests.support import refresh
from tests.support.paths import DOCS, GOLDEN

DOCUMENT = (DOCS / "templates.md").read_text(encoding="utf-8")
RECORD = GOLDEN / "templates" / f"version-{templates.VERSION}.txt"
SEED = int(os.environ.get("SEED", "7"))
nothing_installed = nothing_installed  # a fixture of every test here, too
TALKER = ["scaffold", "node", "talker", "--publisher", "std_msgs/String:chatter"]


@pytest.fixture
def package(tmp_path, monkeypatch) -> Path:
    """Return a new package, in which the test works, with a folder for templates beside it."""
    monkeypatch.chdir(tmp_path)
    assert main(["scaffold", "package", "demo"]) == 0
    monkeypatch.chdir("demo")
    return tmp_path / "demo"


def write(package: Path, name: str, text: str | bytes) -> None:
    path = package.parent / "mine" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(text if isinstance(text, bytes) else text.encode())


PUBLISHER = '''
    {{ part.head }}
        """Ours."""
        {{ part.message }}
        self.{{ part.word }}_publisher.publish(message)
'''


def test_one_that_is_replaced_is_used_and_the_others_are_idlcs(package):
    assert main(TALKER) == 0
    before = (package / "demo/talker.py").read_text()
    write(package, "node/publisher.py.jinja", PUBLISHER)
    assert main([*TALKER, "--templates", "../mine", "--force"]) == 0
    after = (package / "demo/talker.py").read_text()
    assert after == before.replace("Publish a message on chatter.", "Ours.")


def test_the_setting_says_where_they_are_from_any_folder(package, monkeypatch):
    settings = package / "pyproject.toml"
    text = settings.read_text().replace("[tool.idlc]\n", '[tool.idlc]\ntemplates = "../mine"\n')
    settings.write_text(text)
    write(package, "node/publisher.py.jinja", PUBLISHER)
    monkeypatch.chdir("demo")
    assert main(TALKER) == 0
    assert '"""Ours."""' in (package / "demo/talker.py").read_text()


def test_the_files_of_packages_can_be_replaced(package, monkeypatch):
    write(package, "package/README.md.jinja", "# {{ package.name }}, ours\n")
    write(package, "package/launch.py.jinja", "# no launch description\n")
    monkeypatch.chdir(package.parent)
    assert main(["scaffold", "package", "other", "--templates", "mine"]) == 0
    other = package.parent / "other"
    assert (other / "README.md").read_text() == "# other, ours\n"
    assert (other / "launch/other_launch.py").read_text() == "# no launch description\n"


def test_a_launch_file_that_cannot_list_nodes_is_for_the_user(package, capsys):
    shutil.rmtree(package / "launch")
    write(package, "package/launch.py.jinja", "# no launch description\n")
    assert main([*TALKER, "--templates", "../mine"]) == 0
    assert "note: `launch/demo_launch.py` is not edited" in capsys.readouterr().out
    assert (package / "launch/demo_launch.py").read_text() == "# no launch description\n"


def test_idlcs_own_can_be_included_and_shared_parts_too(package):
    write(package, "_ours.jinja", "    # {{ part.word }}: ours\n")
    write(
        package,
        "node/publisher.py.jinja",
        '\n{% include "_ours.jinja" %}\n{% include "idlc/node/publisher.py.jinja" %}\n',
    )
    assert main([*TALKER, "--templates", "../mine"]) == 0
    text = (package / "demo/talker.py").read_text()
    assert "    # chatter: ours\n" in text
    assert '"""Publish a message on chatter."""' in text


def test_copies_write_what_idlcs_own_write(package, tmp_path, monkeypatch):
    """Also in the sandbox, which only users' templates need."""
    words = [word for name in templates.names() for word in ("--copy", name)]
    assert main(["scaffold", "templates", *words, "--templates", str(tmp_path / "mine")]) == 0
    for case in ("nodes", "lifecycle"):
        folder = tmp_path / case
        folder.mkdir()
        monkeypatch.chdir(folder)
        commands = (FOLDER / case / "commands").read_text().splitlines()
        mine = f" --templates {tmp_path / 'mine'}"
        carry_out("\n".join(line + mine * ("scaffold" in line) for line in commands), monkeypatch)
        assert tree(folder) == tree(FOLDER / case / "out")


def test_they_are_listed_with_those_that_replace_them(package, capsys):
    capsys.readouterr()
    assert main(["scaffold", "templates"]) == 0
    assert capsys.readouterr().out.split() == list(templates.names())
    assert main(["scaffold", "templates", "--copy", "node/service.py.jinja", "--dry-run"]) == 0
    assert not (package / "templates").exists()
    assert main(["scaffold", "templates", "--copy", "node/service.py.jinja"]) == 0
    said = capsys.readouterr().out
    assert "created templates/node/service.py.jinja" in said
    assert 'note: set `templates = "templates"` in [tool.idlc]' in said
    assert main(["scaffold", "templates", "--list", "--templates", "templates"]) == 0
    assert re.search(
        r"node/service.py.jinja +replaced by templates/node/service.py.jinja\n",
        capsys.readouterr().out,
    )


def test_a_copy_that_was_edited_is_not_replaced(package, capsys):
    copying = ["scaffold", "templates", "--copy", "node/service.py.jinja"]
    assert main(copying) == 0
    copy = package / "templates/node/service.py.jinja"
    copy.write_text("ours")
    assert main(copying) == 1
    assert "IDL620" in capsys.readouterr().err
    assert copy.read_text() == "ours"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--copy", "node/publsher.py.jinja"], "did you mean `node/publisher.py.jinja`"),
        (["--copy", "client"], "`node/client.py.jinja` or `node_test/client.py.jinja`"),
        (["--copy", "message/module.py.jinja"], "there is no template"),
        (["--copy", "../x"], "there is no template"),
        (["--list", "--copy", "node/client.py.jinja"], "do not go together"),
        (["--templates", "nowhere"], "IDL602"),
    ],
)
def test_wrong_words_are_explained(package, capsys, words, said):
    assert main(["scaffold", "templates", *words]) == 2
    assert said in capsys.readouterr().err


#: Texts of node/publisher.py.jinja, and what is said of each.
BROKEN = {
    "no end of a block": ("\n{% for line in part.create %}\n", ":2:"),
    "an unknown tag": ("\n\n    {% whatever %}\n", ":3:8"),
    "an unknown name": ("{{ prat.word }}", "'prat' is undefined"),
    "an unknown attribute": ("\n{{ part.wrod }}", ":2:9"),
    "a part of nothing": ("{{ part.word.x.y }}", "has no attribute 'x'"),
    "an unknown filter": ("{{ part.word | shout }}", "no filter named 'shout'"),
    "an unknown test": ("{{ part.word is odd_one }}", "'odd_one'"),
    "no number": ("{{ part.word + 1 }}", "can only concatenate str"),
    "nothing to divide": ("{{ 1 // 0 }}", "by zero"),
    "too many turns": ("{% for n in range(10000000) %}x{% endfor %}", "range too big"),
    "a missing include": ('{% include "node/missing.jinja" %}', "no template `node/missing.jinja`"),
    "a broken include": ('{% include "_broken.jinja" %}', "mine/_broken.jinja:2:1"),
    "itself": ('{% include "node/publisher.py.jinja" %}', "never ends"),
    "itself by another": ('{% include "_again.jinja" %}', "never ends"),
    "its own parent": ('{% extends "node/publisher.py.jinja" %}', "never ends"),
    "many brackets": ("{{ " + "(" * 5000 + ")" * 5000 + " }}", "IDL623"),
    "many blocks": ("{% if 1 %}" * 500 + "{% endif %}" * 500, "IDL623"),
    "a lone surrogate": ('    # {{ "\\ud800" }}', "U+D800"),
    "a NUL": ('    # {{ "\\0" }}', "not valid Python"),
    "no Python": ("    def {{", "IDL623"),
    "open brackets": ("    x = ((((\n", "not valid Python"),
    "another version": ("{# idlc templates 99 #}", "version 99"),
    "UTF-16": ("{# ä #}".encode("utf-16"), "IDL603"),
    "Latin-1": ("\n{# ä #}".encode("latin-1"), "mine/node/publisher.py.jinja:2:4"),
}


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_one_is_a_problem_at_its_place(package, capsys, what):
    text, said = BROKEN[what]
    write(package, "node/publisher.py.jinja", text)
    write(package, "_broken.jinja", "{# fine #}\n{% if %}\n" if what == "a broken include" else "")
    write(package, "_again.jinja", '{% include "node/publisher.py.jinja" %}\n')
    before = tree(package)
    capsys.readouterr()
    status = main([*TALKER, "--templates", "../mine"])
    output = capsys.readouterr()
    assert status in (1, 2), output
    assert said in output.err
    assert "IDL6" in output.err
    assert "mine/" in output.err
    assert tree(package) == before


#: What templates of a stranger's repository might try.
ESCAPES = [
    "{{ ''.__class__.__mro__[1].__subclasses__() }}",
    "{{ cycler.__init__.__globals__.os.system('touch ran') }}",
    "{{ self.__init__.__globals__.__builtins__.open('ran', 'w') }}",
    "{{ lipsum.__globals__['os'].mkdir('ran') }}",
    "{{ part | attr('__class__') | attr('__init__') }}",
    "{{ '{0.__class__.__init__.__globals__}'.format(part) }}",
    "{{ '%s' | format(part.__struct_fields__) }}",
    "{{ part.__reduce__() }}",
    "{{ node._replace(name='x') }}",
    "{{ (part.log if false else '').join.__self__ }}",
    '{% include "../../secret.jinja" %}',
    '{% include "/etc/passwd" %}',
    '{% import "../secret.jinja" as secret %}{{ secret }}',
]


@pytest.mark.parametrize("text", ESCAPES)
def test_nothing_gets_out_of_the_sandbox(package, capsys, text):
    (package / "secret.jinja").write_text("the secret")
    (package.parent / "secret.jinja").write_text("the secret")
    write(package, "node/publisher.py.jinja", text)
    before = tree(package)
    assert main([*TALKER, "--templates", "../mine"]) == 2
    said = capsys.readouterr().err
    assert "IDL623" in said
    assert "the secret" not in said
    assert tree(package) == before
    assert not (package / "ran").exists()


def test_mutated_templates_end_in_files_or_in_problems(package, capsys):
    """`SEED` chooses others."""
    chance = random.Random(SEED)
    pieces = ["{{ ", " }}", "{% ", " %}", "{#", "if", "for x in", "endfor", "part.", ".", "'", "\n"]
    pieces += ["\0", "ä", "\u2028", "\r", "[", "(", "-", "include 'node/publisher.py.jinja'"]
    words = ["--subscriber", "std_msgs/String:heard", "--timer", "1", "--lifecycle"]
    for n in range(60):
        shutil.rmtree(package.parent / "mine", ignore_errors=True)
        name = chance.choice([one for one in templates.names() if one.startswith("node")])
        text = templates.copy(name)
        for _ in range(chance.randint(1, 3)):
            start = chance.randrange(len(text))
            end = min(len(text), start + chance.choice([0, 0, 1, 3, 20]))
            text = text[:start] + chance.choice(["", *pieces]) + text[end:]
        write(package, name, text)
        before = tree(package)
        capsys.readouterr()
        status = main([*TALKER, *words, "--templates", "../mine", "--dry-run"])
        said = capsys.readouterr().err
        assert status in (0, 1, 2), (n, name, said, text)
        assert "Traceback (most" not in said
        assert tree(package) == before


@pytest.mark.parametrize("what", ["a file", "a pipe", "nothing", "no string"])
def test_a_folder_that_is_none_is_reported(package, capsys, what):
    value = '"../mine"'
    if what == "a file":
        (package.parent / "mine").write_text("")
    elif what == "a pipe":
        (package.parent / "mine/node").mkdir(parents=True)
        os.mkfifo(package.parent / "mine/node/publisher.py.jinja")
    elif what == "no string":
        value = "7"
    settings = package / "pyproject.toml"
    text = settings.read_text().replace("[tool.idlc]\n", f"[tool.idlc]\ntemplates = {value}\n")
    settings.write_text(text)
    assert main(TALKER) == 2
    assert "IDL6" in capsys.readouterr().err
    assert not (package / "demo/talker.py").exists()


def views() -> dict[str, list[str]]:
    """Return the attributes that templates may use, by the headings of the document."""
    found: dict[str, list[str]] = {}

    def add(path: str, view: type, without: tuple[str, ...] = ()) -> None:
        hints = typing.get_type_hints(view)
        names = getattr(view, "__struct_fields__", None) or getattr(view, "_fields", ())
        properties = [name for name, value in vars(view).items() if isinstance(value, property)]
        found[path] = sorted({*names, *properties} - set(without))
        for name in names:
            for inner in (hints[name], *typing.get_args(hints[name])):
                if hasattr(inner, "_fields"):
                    add(f"{path}.{name}", inner)

    add("node", NodeView)
    add("test", ViewOfTest)
    add("package", Package)
    for folder, base, function in (("node", Part, "node"), ("node_test", PartOfTest, "test")):
        add(f"part in {folder}/", base)
        for role in ROLES:
            view = typing.get_type_hints(getattr(role, function))["return"]
            if view is not base:
                add(f"part in {folder}/{role.name}.py.jinja", view, base.__struct_fields__)
    return found


def documented() -> dict[str, list[str]]:
    """Return the attributes that the document lists, by its headings."""
    found = {}
    for heading, text in re.findall(r"(?ms)^### `([^\n]+)`\n(.*?)(?=^##|\Z)", DOCUMENT):
        found[heading] = sorted(re.findall(r"(?m)^\| `(\w+)` \|", text))
    return found


def test_the_document_lists_every_attribute():
    assert documented() == views()


def test_the_document_lists_every_template():
    listed = DOCUMENT.partition("## The templates\n")[2].partition("\n## ")[0]
    named = [name for row in re.findall(r"(?m)^\| (.+?) \|", listed) for name in row.split(", ")]
    assert sorted(name.strip("`") for name in named if "/" in name) == list(templates.names())


def test_an_attribute_that_changes_makes_a_new_version():
    """Raise idlc.scaffold.templates.VERSION if one of the recorded is gone, then refresh."""
    now = {f"{view}: {name}" for view, names in views().items() for name in names}
    known = set(RECORD.read_text(encoding="utf-8").splitlines()) if RECORD.exists() else set()
    if refresh.wanted("templates"):
        RECORD.parent.mkdir(exist_ok=True)
        RECORD.write_text("".join(f"{line}\n" for line in sorted(now | known)), encoding="utf-8")
        refresh.refreshed()
    assert known - now == set(), "templates that use these would break"
    assert now - known == set(), "IDLC_REFRESH=templates records new ones"


def test_each_role_has_its_templates_and_a_golden_tree():
    commands = "".join(path.read_text() for path in FOLDER.glob("*/commands"))
    for role in ROLES:
        assert f"node/{role.name}.py.jinja" in templates.names()
        assert f"node_test/{role.name}.py.jinja" in templates.names()
        assert f"{role.option} " in commands
