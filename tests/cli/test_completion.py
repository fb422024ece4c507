"""Completion in shells: click's protocol in a process of its own, and a real bash."""

import inspect
import os
import shlex
import subprocess
import sys
from pathlib import Path

import click
import pytest

from idlc.cli.app import COMMANDS, app
from idlc.cli.run import completion
from idlc.diagnostics.codes import CODES
from tests.support import recorded_text

MANIFEST = '<package format="3"><name>greenhouse</name></package>'
CODE = "import sys\nfrom idlc.cli.main import main\nsys.argv = ['idlc']\nmain()\n"


@pytest.fixture(autouse=True)
def package(tmp_path, monkeypatch):
    """The working folder is a package with a message and a service."""
    (tmp_path / "greenhouse").mkdir()
    monkeypatch.chdir(tmp_path / "greenhouse")
    for path, text in {
        "package.xml": MANIFEST,
        "msg/SensorReading.msg": "int8 a\n",
        "srv/Water.srv": "---\n",
        "../more/leg_msgs/msg/Leg.msg": "int8 a\n",
    }.items():
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        Path(path).write_text(text, encoding="utf-8")


def ask(shell, *words, code=CODE):
    """Return what a shell is told when the last of `words` is to be completed."""
    number = words[-1] if shell == "fish" else str(len(words))
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env={
            **os.environ,
            "_IDLC_COMPLETE": f"{shell}_complete",
            "COMP_WORDS": shlex.join(("idlc", *words)),
            "COMP_CWORD": number,
        },
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    return done.stdout


def complete(*words):
    """Return what is offered besides files."""
    lines = [line.partition(",") for line in ask("bash", *words).splitlines()]
    return [value for kind, _, value in lines if kind == "plain"]


def parameters(command):
    """Yield the parameters of a command and of those below it."""
    yield from command.params
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            yield from parameters(command.get_command(context, name))


def test_each_function_that_completes_exists():
    offers = [each._custom_shell_complete for each in parameters(app)]
    variables = [inspect.getclosurevars(offer).nonlocals for offer in offers if offer]
    names = {each["by"] for each in variables if "by" in each}
    assert {"topics", "robot_names", "endpoint"} <= names <= vars(completion).keys()


def test_commands_options_and_choices_are_completed():
    assert complete("e") == ["explain", "echo"]
    assert set(complete("")) == set(COMMANDS)
    assert "--vendor-deps" in complete("gen", "--v")
    assert complete("scaffold", "node", "x", "--qos", "l") == ["latched"]
    assert complete("help", "scaffold", "n") == ["node"]
    assert set(complete("no-such-command", "")) == set(COMMANDS)


def test_types_are_completed_by_any_of_their_names():
    assert complete("show", "std_msgs/He") == ["std_msgs/Header"]
    assert complete("show", "std_msgs/msg/He") == ["std_msgs/msg/Header"]
    assert complete("show", "std_srvs/s") == [
        f"std_srvs/srv/{name}" for name in ("Empty", "SetBool", "Trigger")
    ]
    assert complete("show", "Hea") == ["Header"]
    assert {"std_msgs/", "std_srvs/", "sensor_msgs/"} <= set(complete("show", "s"))
    assert "std_srvs/Trigger" in complete("show", "std_sr"), "what is in the only package"
    assert complete("show", "greenhouse/") == ["greenhouse/SensorReading", "greenhouse/Water"]
    assert complete("show", "-I", "../more", "leg_msgs/L") == ["leg_msgs/Leg"]
    assert "file,std_msgs/He" in ask("bash", "show", "std_msgs/He").split()


def test_an_endpoint_is_completed_with_types_of_its_kind():
    node = ("scaffold", "node", "watcher")
    assert complete(*node, "--publisher", "std_msgs/He") == ["std_msgs/Header"]
    assert complete(*node, "--subscriber", "Sens") == ["SensorReading"]
    assert complete(*node, "--publisher", "Imu") == [], "only the package's own go without one"
    assert complete(*node, "--service", "std_srvs/T") == ["std_srvs/Trigger"]
    assert complete(*node, "--service", "Wa") == ["Water"]
    assert complete(*node, "--publisher", "std_srvs/") == []
    assert complete(*node, "--action-server", "example_interfaces/") == [
        "example_interfaces/Fibonacci"
    ]
    before = ("--publisher", "std_msgs/Header:header@2", "--qos", "latched")
    assert complete(*node, *before, "--client", "std_srvs/S") == ["std_srvs/SetBool"]


def test_packages_are_completed():
    assert complete("list", "std_") == ["std_msgs", "std_srvs"]
    assert complete("list", "green") == ["greenhouse"]


def test_codes_and_rules_are_completed():
    assert complete("explain", "IDL20") == sorted(code for code in CODES if code[:5] == "IDL20")
    assert complete("explain", "wide-") == ["wide-string"]
    assert complete("check", "--ignore", "sty") == ["style"]
    assert complete("check", "--select", "style,wide") == ["style,wide-string"]


@pytest.mark.parametrize(
    ("shell", "told"),
    [
        ("bash", "plain,std_msgs/Header"),
        ("zsh", "plain\nstd_msgs/Header\n_"),
        ("fish", "plain,std_msgs/Header"),
    ],
)
def test_each_shell_is_told_in_its_way(shell, told):
    assert told in ask(shell, "show", "std_msgs/He")


@pytest.mark.parametrize("words", [("show", "std_msgs/"), ("explain", "w"), ("gen", "--")])
def test_a_key_press_imports_nothing_heavy(words):
    heavy = {"jinja2", "lark", "numpy", "rich"}
    code = f"import atexit\n{CODE.replace('main()', 'atexit.register(told); main()')}"
    code = code.replace(
        "import sys\n", "import sys\ndef told(): print('imported', *sys.modules)\n", 1
    )
    imported = ask("bash", *words, code=code).splitlines()[-1].split()
    assert imported[0] == "imported"
    assert not heavy & set(imported)


def test_a_real_bash_completes_with_it():
    script = f"""
idlc() {{ '{sys.executable}' -c "$PROGRAM"; }}
env() {{ command env "${{@:1:$#-1}}" '{sys.executable}' -c "$PROGRAM"; }}
eval "$(_IDLC_COMPLETE=bash_source idlc)"
compopt() {{ :; }}
COMP_WORDS=(idlc scaffold node x --publisher std_msgs/He)
COMP_CWORD=5
_idlc_completion idlc
echo "${{COMPREPLY[@]}}"
complete -p idlc
"""
    done = subprocess.run(
        ["/usr/bin/env", "bash", "--norc", "-c", script],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PROGRAM": CODE},
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    first, second = done.stdout.splitlines()
    assert first == "std_msgs/Header"
    assert "_idlc_completion idlc" in second


def test_topics_of_a_recording_are_completed():
    text = "@ /wheels demo/msg/Wheels\nint32 a\n@ /whistle demo/msg/Whistle\nint32 a\n"
    recorded_text.write("drive.mcap", text)
    assert complete("show", "drive.mcap", "/wh") == ["/wheels", "/whistle"]
    assert "/wheels" in complete("gen", "drive.mcap", "/whe")
    assert complete("show", "nothing.mcap", "") == []
