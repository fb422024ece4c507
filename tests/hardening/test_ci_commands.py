"""Text of others in the output of each command: no CI system finds a command in it."""

import io
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from mcap.writer import Writer

from idlc.cli import app, messages, output, scaffold, streams
from idlc.diagnostics import ci
from tests.support import recorded_text
from tests.support.files import write, write_all
from tests.support.hostile import run
from tests.support.paths import ROOT
from tests.support.repositories import git

#: What each system looks for, and whether blanks only may stand before it; not idlc's own table.
OBEYED = {
    "##vso[": False,
    "##[": False,
    "::": True,
    "##teamcity[": False,
    "section_start:": False,
    "section_end:": False,
    "travis_fold:": False,
    "travis_time:": False,
}
PAYLOADS = (
    "##vso[task.prependpath]/tmp",
    "##[error]forged",
    "::error::forged",
    "##teamcity[x]",
    "section_start:1:x",
    "section_end:1:x",
    "travis_fold:start:x",
    "travis_time:start:x",
)
ALL = " ".join(PAYLOADS)
ITEM = "\n".join((f"# {ALL}", *(f"int8 f{at}  # {each}" for at, each in enumerate(PAYLOADS)), ""))
BAD = f"int8 bad-name  # {ALL}\nstring s '{ALL}\n::error::forged\n  ##vso[x]\n"
#: The words with which each command shows text of others. Without words, it shows none.
ROWS = {
    "init": [["init", "odd", "--yes"]],
    "gen": [["gen", "odd", "-o", "out"], ["gen", "bad", "-o", "out", "--format", "github"]],
    "check": [
        *(["check", "bad", "--format", each] for each in ("text", "json", "github", "gitlab")),
        *(["check", "bad", "--format", each] for each in ("junit", "sarif")),
        ["check", "bad"],
        ["check", ALL],
    ],
    "breaking": [
        *(["breaking", "good", "--against", "old", "--format", f] for f in ("text", "github")),
        ["breaking", "good", "--against", f"git:{ALL}"],
        ["breaking", "good", "--against", "a.mcap"],
    ],
    "fmt": [["fmt", "bad", "--check"], ["fmt", "wide", "--diff"]],
    "show": [
        *(
            ["show", "good/msg/A.msg", "--package", "good", "--format", each]
            for each in ("text", "json")
        ),
        *(
            ["show", "good/msg/A.msg", "--package", "good", "--format", each]
            for each in ("ros2idl", "mcap", "jsonschema")
        ),
        *(
            ["show", "good/msg/A.msg", "--package", "good", "--format", each]
            for each in ("hash", "type-description")
        ),
        ["show", "a.mcap", "--format", "hash"],
        ["show", ALL, ALL, "--format", "hash"],
        ["show", "a.mcap"],
        ["show", "a.mcap", f"/t{PAYLOADS[0]}"],
        ["show", "a.mcap", "--format", "json"],
    ],
    "columns": [
        ["columns", "a.mcap", f"/t{PAYLOADS[0]}", "--format", "text"],
        ["columns", "a.mcap", ALL],
    ],
    "upgrade": [
        ["upgrade", "a.mcap", "--to", "good", "--diff"],
        ["upgrade", ALL, "--to", "good"],
    ],
    "echo": [["echo", ALL, "/x"]],
    "call": [["call", ALL, "/x"]],
    "record": [["record", ALL, "/x"]],
    "list": [["list", "-I", "good"], ["list", ALL]],
    "router": [["router", "--listen", ALL]],
    "docs": [["docs", "bad", "-o", "site"]],
    "lsp": [["lsp", ALL]],
    "scaffold": [
        ["scaffold", "package", ALL],
        ["scaffold", "interface", "msg", ALL],
        ["scaffold", "node", ALL, "--role", "publish"],
    ],
    "doctor": [["doctor"]],
    "explain": [["explain", ALL]],
}


def commands_in(text):
    """Yield the lines in which a CI system finds a command."""
    for line in text.replace("\r", "\n").splitlines():
        for prefix, at_start in OBEYED.items():
            place = line.strip().lower()
            # GitHub knows no command with a colon in its name
            if place.startswith(prefix) and place[2:3] != ":" if at_start else prefix in place:
                yield line


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Packages whose every text is a command."""
    here = tmp_path_factory.mktemp("ci")
    os.chdir(here)
    write_all(
        {
            "good/msg/A.msg": ITEM,
            "old/msg/A.msg": ITEM.replace("int8", "int16"),
            "bad/msg/A.msg": BAD,
            f"bad/msg/{PAYLOADS[1]}.msg": "int8 a\n",
            "wide/msg/A.msg": "".join(f"int8   f{n} # {each}\n" for n, each in enumerate(PAYLOADS)),
            "odd/package.xml": f"<package><name>odd</name><license>{ALL}</license></package>",
            "odd/setup.py": f"raise SystemExit({ALL!r})\n",
            "odd/odd/__init__.py": "",
            "odd/msg/A.msg": ITEM,
        }
    )
    git("init", "-q", cwd=here)
    recorded_text.write(
        "a.mcap", f"@ /t{PAYLOADS[0]} good/msg/A\n{ITEM}@ /u{PAYLOADS[1]} x/msg/B\n"
    )
    yield here
    os.chdir(ROOT)


def test_every_command_has_a_row():
    assert set(ROWS) == set(app.COMMANDS)
    assert {words[1] for words in ROWS["scaffold"]} == set(scaffold.command.overview)


@pytest.mark.parametrize("command", ROWS)
def test_no_command_of_others_is_printed(command, folder):
    for words in ROWS[command]:
        said = run(words, folder)
        own = ("::error ", "::warning ", "::notice ") if "github" in words else ()
        lines = [*commands_in(said.stdout), *commands_in(said.stderr)]
        assert [line for line in lines if not (own and line.startswith(own))] == [], words
        for line in lines:  # nor inside of idlc's own commands
            assert not [p for p, at_start in OBEYED.items() if p in line and not at_start], words


def test_a_table_of_its_own_would_be_noticed():
    table = {
        prefix.text: prefix.place is ci.LinePart.START
        for every in ci.SYSTEMS.values()
        for prefix in every
    }
    assert table == OBEYED


@pytest.mark.parametrize(
    "words", [["fmt", "p", "--diff"], ["columns", "a.mcap", "/t", "--format", "csv"]], ids=" ".join
)
def test_exact_text_is_refused_or_written_to_a_file(words, here):
    write("p/msg/A.msg", f"int8   a  # x {PAYLOADS[0]}\nint8 b\n")
    data = f"{PAYLOADS[0]}\0".encode()
    with Path("a.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
        channel = writer.register_channel("/t", "cdr", schema)
        writer.add_message(channel, 1, b"\0\1\0\0" + len(data).to_bytes(4, "little") + data, 1)
        writer.finish()
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "idlc", *words]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert (done.returncode, [*commands_in(done.stdout)]) == (2, [])
    assert "error: the output contains a line that a CI system" in done.stderr
    with Path("exact").open("w") as file:
        subprocess.run(command, stdout=file, env=environment, check=False)
    assert PAYLOADS[0] in Path("exact").read_text(encoding="utf-8")


class Message:
    """A message of a robot."""

    def __init__(self, text):
        self.text = text

    def to_dict(self):
        return {"data": self.text, "list": [self.text], "more": {"number": 1.5, "long": "y " * 90}}


@pytest.mark.parametrize("style", ["yaml", "json", "csv"])
def test_messages_of_a_robot(style):
    every = [*PAYLOADS, *(f"a\n  {each}\r{each}" for each in PAYLOADS), "y " * 49 + PAYLOADS[2]]
    every += ["\x1b[2J\x07\0", "\u202ex\u200b\ufeff", "1e3", "0x1f", "é", ""]
    for text in every:
        sent = Message(text)
        stream = streams.GuardedStream(io.StringIO())
        try:
            for piece in messages.texts(style, [sent.to_dict()]):
                output.lines(piece, style, stream)
        except ci.SpeakingError:
            assert style == "csv"
            continue
        said = stream._stream.getvalue()
        assert [*commands_in(said)] == []
        if style != "csv":
            assert said.isprintable() or "\n" in said
            read = (
                yaml.safe_load(said.removesuffix("---\n")) if style == "yaml" else json.loads(said)
            )
            assert read["data"] == text


@pytest.mark.parametrize("form", [ci.Form.TEXT, ci.Form.JSON, ci.Form.COMMANDS])
def test_pieces_of_a_prefix(form):
    for payload in PAYLOADS:
        for cut in range(len(payload)):
            stream = streams.GuardedStream(io.StringIO())
            stream.form = form
            for piece in ("a\n  ", payload[:cut], payload[cut:], "\n"):
                stream.write(piece)
            said = stream._stream.getvalue()
            found = [line for line in commands_in(said) if form is ci.Form.TEXT or "::" not in line]
            assert found == [], (payload, cut)
