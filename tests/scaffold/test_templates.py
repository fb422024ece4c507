"""Templates of a user's own: they replace idlc's, and a broken one is a problem at its line."""

import os
import random
import shutil
from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.project.templates import verbatim
from idlc.scaffold import templates
from idlc.scaffold.roles import ROLES
from tests.scaffold.test_command import FOLDER, carry_out, nothing_installed, tree

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


PUBLISHER = verbatim("node/publisher.py.jinja").replace("Publish a message", "Say something")


def test_one_that_is_replaced_is_used_and_the_others_are_idlcs(package):
    assert main(TALKER) == 0
    before = (package / "demo/talker.py").read_text()
    write(package, "node/publisher.py.jinja", PUBLISHER)
    assert main([*TALKER, "--templates", "../mine", "--force"]) == 0
    after = (package / "demo/talker.py").read_text()
    assert after == before.replace("Publish a message on", "Say something on")
    assert after != before


def test_the_setting_says_where_they_are_from_any_folder(package, monkeypatch):
    settings = package / "pyproject.toml"
    text = settings.read_text().replace("[tool.idlc]\n", '[tool.idlc]\ntemplates = "../mine"\n')
    settings.write_text(text)
    write(package, "node/publisher.py.jinja", PUBLISHER)
    monkeypatch.chdir("demo")
    assert main(TALKER) == 0
    assert "Say something on" in (package / "demo/talker.py").read_text()


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


def test_parts_can_be_shared(package):
    write(package, "_ours.jinja", "    # {{ part.word }}: ours\n")
    shared = '{% if section == "methods" %}\n\n{% include "_ours.jinja" %}\n{% endif %}\n'
    write(package, "node/timer.py.jinja", verbatim("node/timer.py.jinja") + shared)
    assert main([*TALKER, "--timer", "1", "--templates", "../mine"]) == 0
    assert "    # tick: ours\n" in (package / "demo/talker.py").read_text()


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


def test_they_are_listed_and_copied(package, capsys):
    capsys.readouterr()
    assert main(["scaffold", "templates"]) == 0
    assert capsys.readouterr().out.split() == list(templates.names())
    assert main(["scaffold", "templates", "--copy", "node/service.py.jinja", "--dry-run"]) == 0
    assert not (package / "templates").exists()
    assert main(["scaffold", "templates", "--copy", "node/service.py.jinja"]) == 0
    said = capsys.readouterr().out
    assert "created templates/node/service.py.jinja" in said
    assert 'note: set `templates = "templates"` in [tool.idlc]' in said


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
        (["--copy", "message/module.py.jinja"], "no such template"),
        (["--copy", "../x"], "no such template"),
    ],
)
def test_wrong_words_are_explained(package, capsys, words, said):
    assert main(["scaffold", "templates", *words]) == 2
    assert said in capsys.readouterr().err


#: Texts of node/publisher.py.jinja, and what is said of each.
BROKEN = {
    "no end of a block": ("\n{% for line in part.create %}\n", ":2:"),
    "an unknown tag": ("\n\n    {% whatever %}\n", ":3:5"),
    "an unknown name": ("{{ prat.word }}", "'prat' is undefined"),
    "an unknown attribute": ("\n  {{ part.wrod }}", ":2:3"),
    "a part of nothing": ("{{ part.word.x.y }}", "has no attribute 'x'"),
    "an unknown filter": ("{{ part.word | shout }}", "no filter named 'shout'"),
    "an unknown test": ("{{ part.word is odd_one }}", "'odd_one'"),
    "no number": ("{{ part.word + 1 }}", "can only concatenate str"),
    "nothing to divide": ("{{ 1 // 0 }}", "by zero"),
    "too many turns": ("{% for n in range(10000000) %}x{% endfor %}", "range too big"),
    "a missing include": (
        '{% include "node/missing.jinja" %}',
        "no such template: `node/missing.jinja`",
    ),
    "a broken include": ('{% include "_broken.jinja" %}', "mine/_broken.jinja:2:1"),
    "itself": ('{% include "node/publisher.py.jinja" %}', "nested too deeply"),
    "itself by another": ('{% include "_again.jinja" %}', "nested too deeply"),
    "its own parent": ('{% extends "node/publisher.py.jinja" %}', "nested too deeply"),
    "many brackets": ("{{ " + "(" * 5000 + ")" * 5000 + " }}", "IDL623"),
    "many blocks": ("{% if 1 %}" * 500 + "{% endif %}" * 500, "IDL623"),
    "a lone surrogate": ('    # {{ "\\ud800" }}', "may place Code and Text"),
    "a NUL": ("    # \0", "null bytes"),
    "no Python": ("    def {{", "IDL623"),
    "open brackets": ("    x = ((((\n", "invalid Python"),
    "a text of its own": ("    # {{ part.word | upper }}", "may place Code and Text"),
    "a literal": ("    # {{ 'literal' }}", "may place Code and Text"),
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
    "{{ '%s' | format(part.__class__) }}",
    "{{ part.__reduce__() }}",
    "{{ node._replace(name='x') }}",
    "{{ (part.word if false else '').join.__self__ }}",
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
        text = verbatim(name)
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


def test_each_role_has_its_template_and_a_golden_tree():
    commands = "".join(path.read_text() for path in FOLDER.glob("*/commands"))
    for role in ROLES:
        assert f"node/{role.name}.py.jinja" in templates.names()
        assert f"{role.option} " in commands
