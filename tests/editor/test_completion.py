"""What may come next, where one types."""

import pytest
from lsprotocol import types as lsp

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.editor import completion
from idlc.language.parse import parse
from idlc.model.ir import PRIMITIVES, TypeName
from idlc.model.lowering.lower import lower
from tests.support.editor import at

MANIFEST = """\
<package format="3">
  <name>demo</name>
  <depend>std_msgs</depend>
</package>
"""


@pytest.fixture(scope="module")
def typing(editor, package):
    """Return a function that types a text up to `|`, and returns what may come next."""
    files = {
        "package.xml": MANIFEST,
        "msg/Drive.msg": "int8 x\n",
        "msg/Wheel.msg": "int8 x\n",
        "srv/Stop.srv": "---\n",
    }
    folder = package(files)
    edits = lsp.WorkspaceClientCapabilities(apply_edit=True)
    one = editor(folder, capabilities=lsp.ClientCapabilities(workspace=edits))
    version = 1

    def complete(text, name="msg/Drive.msg"):
        nonlocal version
        version += 1
        uri = (folder / name).as_uri()
        if version == 2 or uri not in opened:
            opened.add(one.open(folder / name))
        before, _, after = text.partition("|")
        one.change(uri, before + after, version)
        line = before.count("\n")
        place = at(line, len(before) - before.rfind("\n") - 1)
        found = one.ask(
            lsp.TEXT_DOCUMENT_COMPLETION,
            lsp.CompletionParams(lsp.TextDocumentIdentifier(uri=uri), place),
        )
        return {each.label: each for each in found.items}

    opened = set()
    complete.editor, complete.folder = one, folder
    return complete


def test_a_line_begins_with_a_type(typing):
    found = typing("|")
    assert {"float64", "string", "Wheel", "std_msgs/", "geometry_msgs/"} <= found.keys()
    assert not {"Drive", "---"} & found.keys()  # itself; and a message has one section
    assert "---" in typing("|", "srv/Stop.srv")


def test_types_of_a_package_replace_what_was_typed(typing):
    found = typing("std_msgs/He|")
    item = found["std_msgs/Header"]
    assert item.text_edit.new_text == "std_msgs/Header"
    assert item.text_edit.range == lsp.Range(start=at(0, 0), end=at(0, 11))
    assert item.command is None  # package.xml declares it
    assert "std_msgs/String" in typing("std_msgs/|")
    assert "std_msgs/String" not in found  # Neovim leaves it to the server


def test_a_name_alone_finds_its_package(typing):
    found = typing("int8 x\nTwistW|")
    item = found["geometry_msgs/TwistWithCovariance"]
    assert item.filter_text == "TwistWithCovariance"


def test_a_package_that_is_missing_is_declared_with_the_type(typing):
    item = typing("geometry_msgs/Tw|")["geometry_msgs/Twist"]
    edits = []
    client = typing.editor
    client.answer_edits(edits)
    command = lsp.ExecuteCommandParams(item.command.command, item.command.arguments)
    client.ask(lsp.WORKSPACE_EXECUTE_COMMAND, command)
    ((uri, (edit,)),) = edits[0].changes.items()
    assert uri == (typing.folder / "package.xml").as_uri()
    assert edit.new_text == "\n  <depend>geometry_msgs</depend>"
    assert edit.range.start == at(2, 27)
    assert "geometry_msgs" not in (typing.folder / "package.xml").read_text()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("string<=|", "32"),
        ("int8[<=|", "16"),
        ("int8[|", "3"),
        ("std_msgs/Header |", "header"),
        ("geometry_msgs/PoseStamped[] p|", "pose_stamped"),
        ("bool on |", "true"),
        ("int16 a |", "-32768"),
        ("string text |", '""'),
        ("int8[] list |", "[]"),
        ("uint8 LEVEL=|", "255"),
        ("float64 MAX=|", "0.0"),
        ("uint8 FAST=2\nuint8 mode |", "FAST"),
        ("float64 speed  # [|", "m/s"),
        ("float64 speed  # forwards [m|", "m/s"),
        ("float64 speed  # [km/h] idlc: ignore[|", "IDL405"),
    ],
)
def test_what_fits_comes_next(typing, text, expected):
    assert expected in typing(text)


@pytest.mark.parametrize("text", ["int8 x  # a |", "int8 |", "std_msgs/Header header |", "---|"])
def test_where_nothing_fits_nothing_comes(typing, text):
    assert typing(text) == {}


def test_a_constant_is_written_as_its_value(typing):
    item = typing("uint8 FAST=2\nuint8 mode |")["FAST"]
    assert item.text_edit.new_text == "2"
    assert "OTHER" not in typing("uint8 OTHER=3\n---\nuint8 mode |", "srv/Stop.srv")


def test_deprecated_constants_are_marked(typing):
    text = "uint8 FAST=2\nuint8 QUICK=2  # Deprecated: use FAST\nuint8 mode |"
    items = typing(text)
    assert items["QUICK"].tags == (lsp.CompletionItemTag.Deprecated,)
    assert items["FAST"].tags is None


def test_a_type_comes_with_its_definition(typing):
    items = typing("std_msgs/He|")
    answer = typing.editor.ask(lsp.COMPLETION_ITEM_RESOLVE, items["std_msgs/Header"])
    assert "builtin_interfaces/Time stamp" in answer.documentation.value
    assert answer.text_edit == items["std_msgs/Header"].text_edit
    own = typing("Whe|")["Wheel"]
    assert "int8 x" in typing.editor.ask(lsp.COMPLETION_ITEM_RESOLVE, own).documentation.value


@pytest.mark.parametrize("data", [None, 7, [], ["x", "y", "z"], [1, 2, 3], {"uri": []}])
def test_other_items_are_returned_as_they_are(typing, data):
    item = lsp.CompletionItem(label="float64", data=data)
    assert typing.editor.ask(lsp.COMPLETION_ITEM_RESOLVE, item) == item


def test_built_in_types_say_how_large_they_are(typing):
    items = typing("|")
    assert items["float64"].detail == "8 bytes"
    assert items["Wheel"].detail == "demo"


@pytest.mark.parametrize(
    "array", ["", "[]", "[3]", "[12]", "[<=3]", "[0]", "[99999999999999999999]"]
)
@pytest.mark.parametrize("base", [*PRIMITIVES, "string", "wstring", "string<=2", "demo/Drive"])
def test_every_value_that_is_offered_is_one(base, array):
    for value in completion.suggested_values(f"{base}{array}"):
        report = Report()
        source = Source("A.msg", f"{base}{array} a {value}\n")
        lower(parse(source), TypeName("demo", "msg", "A"), report)
        assert not report.had_errors, value


def test_an_array_of_a_length_gets_a_value_of_that_length(typing):
    assert "[0, 0, 0]" in typing("uint8[3] rgb |")
    assert "[]" not in typing("uint8[3] rgb |")
    assert typing("uint8[3] RGB=|") == {}
