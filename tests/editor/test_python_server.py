"""What a server for Python shows of generated classes: the comments of the interface, its lines."""

import sys
from pathlib import Path

import pytest
from lsprotocol import types as lsp

from idlc.cli.main import main
from tests.support.editor import at

DRIVE = """\
# How fast to drive.

uint8 MODE_FAST=2  # as fast as can be
float64 speed 0.5  # forwards [m/s]
Wheel wheel
"""
PROGRAM = """\
from demo.msg import Drive

message = Drive()
print(message.speed, message.wheel.radius, Drive.MODE_FAST)
"""


@pytest.fixture(scope="module")
def shown(editor, package, tmp_path_factory):
    folder = package({"msg/Drive.msg": DRIVE, "msg/Wheel.msg": "float32 radius  # [m]\n"})
    place = tmp_path_factory.mktemp("program").resolve()
    assert main(["gen", str(folder), "-o", str(place / "demo")]) == 0
    (place / "program.py").write_text(PROGRAM)
    server = Path(sys.executable).with_name("basedpyright-langserver")
    one = editor(
        place,
        command=(str(server), "--stdio"),
        capabilities=lsp.ClientCapabilities(
            text_document=lsp.TextDocumentClientCapabilities(
                hover=lsp.HoverClientCapabilities(content_format=[lsp.MarkupKind.Markdown])
            )
        ),
    )
    uri = one.open(place / "program.py", language="python")

    def ask(method, kind, word):
        line = 2 if word == "Drive" else 3
        column = PROGRAM.splitlines()[line].index(word) + 1
        document = lsp.TextDocumentIdentifier(uri=uri)
        params = kind(text_document=document, position=at(line, column))
        return one.ask(method, params)

    return ask, place


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("speed", ["float64 speed [m/s]. forwards (msg/Drive.msg)"]),
        ("radius", ["float32 radius [m] (msg/Wheel.msg)"]),
        ("MODE_FAST", ["uint8 MODE_FAST. as fast as can be (msg/Drive.msg)"]),
        ("Drive", ["How fast to drive.", "Defined in msg/Drive.msg:3"]),
    ],
)
def test_hover_has_comment_unit_and_the_line(shown, word, expected):
    ask, _ = shown
    text = ask(lsp.TEXT_DOCUMENT_HOVER, lsp.HoverParams, word).contents.value.replace("\\", "")
    for one in expected:
        assert one in text, text


@pytest.mark.parametrize(
    ("word", "path", "text"),
    [
        ("speed", "demo/msg/_drive.py", "    speed: float"),
        ("radius", "demo/msg/_wheel.py", "    radius: float"),
        ("Drive", "demo/msg/_drive.py", "class Drive(_idlc.Message):  # noqa"),
    ],
)
def test_a_definition_is_in_the_class(shown, word, path, text):
    ask, place = shown
    (found,) = ask(lsp.TEXT_DOCUMENT_DEFINITION, lsp.DefinitionParams, word)
    assert found.uri == (place / path).as_uri()
    assert (place / path).read_text().splitlines()[found.range.start.line] == text
