"""What an editor does to files when it is told to: fixes, remarks, other names."""

import pytest
from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException

from idlc.cli.main import main
from idlc.editor.documents import Places
from idlc.editor.parts import Position
from tests.support.editor import at, between

FILES = {
    "package.xml": '<package format="3">\n  <name>demo</name>\n</package>\n',
    "CMakeLists.txt": 'rosidl_generate_interfaces(demo "msg/Wheel.msg" "msg/Drive.msg")\n',
    "msg/Drive.msg": "uint8 FAST=2  # quick\nuint8 mode 2  # FAST, see `speed`\nfloat64 speed\n",
    "msg/Wheel.msg": "Drive drive\n",
    "msg/Plain.msg": "bool ok\n",
    "srv/Stop.srv": "demo/Drive[] drives\n---\n",
}
CAPABILITIES = lsp.ClientCapabilities(
    workspace=lsp.WorkspaceClientCapabilities(
        workspace_edit=lsp.WorkspaceEditClientCapabilities(
            document_changes=True,
            resource_operations=[lsp.ResourceOperationKind.Rename],
            change_annotation_support=lsp.ChangeAnnotationsSupportOptions(),
        )
    )
)


@pytest.fixture(scope="module")
def server(editor, package):
    folder = package(FILES)
    return editor(folder, capabilities=CAPABILITIES), folder


@pytest.fixture
def opened(server):
    """Return a function that opens a file of the package with some text."""
    one, folder = server
    uris = []

    def open_(text, name="msg/Drive.msg"):
        uris.append(one.open(folder / name, text))
        return uris[-1]

    yield one, folder, open_
    for uri in uris:
        one.close(uri)


def applied(edits, text):
    """Return a text with the edits of one document made, as an editor makes them."""
    places = Places(text, "utf-16")

    def offset(position):
        return places.offset(Position(position.line, position.character))

    for edit in sorted(edits, key=lambda one: offset(one.range.start), reverse=True):
        start, end = offset(edit.range.start), offset(edit.range.end)
        text = text[:start] + edit.new_text + text[end:]
    return text


def edits_of(change):
    """Return the edits of a change by the name of the file."""
    return {
        one.text_document.uri.rpartition("/")[2]: one.edits
        for one in change.document_changes
        if isinstance(one, lsp.TextDocumentEdit)
    }


def actions(one, uri, where, only=None):
    params = lsp.CodeActionParams(
        text_document=lsp.TextDocumentIdentifier(uri=uri),
        range=where,
        context=lsp.CodeActionContext(diagnostics=[], only=only),
    )
    return {each.title: each for each in one.ask(lsp.TEXT_DOCUMENT_CODE_ACTION, params)}


@pytest.mark.parametrize(
    ("text", "title", "expected"),
    [
        ("flot64 x\n", "Write `float64`", "float64 x\n"),
        ("Plan w\n", "Write `Plain`", "Plain w\n"),
        ("std_msgs/Heder h\n", "Write `Header`", "std_msgs/Header h\n"),
        ("std_msg/Header h\n", "Write `std_msgs`", "std_msgs/Header h\n"),
        ("Header header\n", "Write `std_msgs/Header`", "std_msgs/Header header\n"),
        ("int8 someName\n", "Write `some_name`", "int8 some_name\n"),
        ("time t\n", "Write `builtin_interfaces/Time`", "builtin_interfaces/Time t\n"),
        ("  int8 x\n", "Remove", "int8 x\n"),
    ],
)
def test_a_problem_offers_what_was_meant(opened, text, title, expected):
    one, _, open_ = opened
    uri = open_(text)
    found = actions(one, uri, between(0, 0, len(text) - 1))
    name = next(name for name in found if name.startswith(title))
    assert applied(edits_of(found[name].edit)["Drive.msg"], text) == expected
    assert found[name].is_preferred
    assert found[name].diagnostics


@pytest.mark.parametrize(
    ("text", "title", "expected"),
    [
        ("int32 x = 5 # five\n", "Write `int32 x 5`", "int32 x 5 # five\n"),
        ("int32 x = 5 # five\n", "Write `X`", "int32 X = 5 # five\n"),
        ("int8 x[3]  # three\n", "Write `int8[3] x`", "int8[3] x  # three\n"),
        ("string<=3 s 'abcde'\n", "Raise the bound to 5", "string<=5 s 'abcde'\n"),
        ("int8 x\nint16 x", "Remove this line", "int8 x\n"),
    ],
)
def test_choices_are_left_to_the_user(opened, text, title, expected):
    one, _, open_ = opened
    found = actions(one, open_(text), lsp.Range(start=at(0, 0), end=at(9, 0)))
    assert applied(edits_of(found[title].edit)["Drive.msg"], text) == expected
    assert not found[title].is_preferred


def test_what_would_not_help_is_not_offered(opened):
    one, _, open_ = opened
    text = "qqqqqq/Zzzz x\n"
    found = actions(one, open_(text), between(0, 0, 10))
    assert not found


def test_a_dependency_is_declared_in_its_own_file(opened):
    one, _, open_ = opened
    uri = open_("std_msgs/Header header\n")
    found = actions(one, uri, between(0, 0, 1))
    edits = edits_of(found["Add `<depend>std_msgs</depend>`"].edit)
    assert "<depend>std_msgs</depend>" in applied(edits["package.xml"], FILES["package.xml"])


def test_a_new_file_is_added_to_cmake(opened):
    one, _, open_ = opened
    uri = open_("bool new\n", "msg/Fresh.msg")
    (problem,) = [each for each in one.pull(uri) if each.code == "IDL464"]
    assert "does not pass `msg/Fresh.msg` to `rosidl_generate_interfaces`" in problem.message
    found = actions(one, uri, between(0, 0, 1))
    edits = edits_of(found["Add `msg/Fresh.msg` to the files in this call"].edit)
    assert applied(edits["CMakeLists.txt"], FILES["CMakeLists.txt"]) == (
        'rosidl_generate_interfaces(demo "msg/Wheel.msg" "msg/Drive.msg" "msg/Fresh.msg")\n'
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("wstring x\n", "wstring x  # idlc: ignore(IDL421) TODO: reason\n"),
        ("wstring x  # text\n", "wstring x  # text idlc: ignore(IDL421) TODO: reason\n"),
        (
            "wstring<=3[] x  # idlc: ignore(IDL423) it is so\n",
            "wstring<=3[] x  # idlc: ignore(IDL423, IDL421) it is so\n",
        ),
    ],
)
def test_a_warning_can_be_ignored_with_a_reason(opened, text, expected):
    one, _, open_ = opened
    uri = open_(text)
    found = actions(one, uri, between(0, 0, 1))
    change = edits_of(found["Ignore IDL421 here"].edit)["Drive.msg"]
    assert applied(change, text) == expected
    one.change(uri, expected)
    assert "IDL421" not in {each.code for each in one.pull(uri)}


def test_fixing_all_is_what_the_command_line_does(opened, tmp_path, capsys):
    one, _, open_ = opened
    text = "int8   a\n  int8 b\n   int8 c # x\n"
    uri = open_(text)
    found = actions(one, uri, between(0, 0, 0), only=["source.fixAll"])
    (action,) = found.values()
    (tmp_path / "msg").mkdir()
    (tmp_path / "msg/Drive.msg").write_text(text)
    main(["check", "--fix", str(tmp_path)])
    capsys.readouterr()
    expected = (tmp_path / "msg/Drive.msg").read_text()
    assert applied(edits_of(action.edit)["Drive.msg"], text) == expected
    assert action.kind == "source.fixAll.idlc"
    assert actions(one, uri, between(0, 0, 0), only=["refactor"]) == {}


def rename(one, uri, line, character, new):
    document = lsp.TextDocumentIdentifier(uri=uri)
    params = lsp.PrepareRenameParams(text_document=document, position=at(line, character))
    place = one.ask(lsp.TEXT_DOCUMENT_PREPARE_RENAME, params)
    params = lsp.RenameParams(text_document=document, position=at(line, character), new_name=new)
    return place, one.ask(lsp.TEXT_DOCUMENT_RENAME, params)


def test_a_field_is_renamed_and_says_what_that_breaks(opened):
    one, _, open_ = opened
    text = FILES["msg/Drive.msg"]
    uri = open_(text)
    place, change = rename(one, uri, 2, 9, "velocity")
    assert place.placeholder == "speed"
    assert applied(edits_of(change)["Drive.msg"], text) == text.replace("speed", "velocity")
    (note,) = change.change_annotations.values()
    assert note.needs_confirmation
    assert note.label == "Rename speed to velocity"
    assert "breaks hash, source" in note.description
    assert "demo/msg/Wheel, demo/srv/Stop" in note.description


def test_a_constant_is_renamed_where_comments_name_it(opened):
    one, _, open_ = opened
    text = FILES["msg/Drive.msg"]
    _, change = rename(one, open_(text), 0, 7, "QUICK")
    assert applied(edits_of(change)["Drive.msg"], text) == text.replace("FAST", "QUICK")


def test_an_interface_is_renamed_with_its_file_and_users(opened):
    one, folder, open_ = opened
    uri = open_(FILES["msg/Wheel.msg"], "msg/Wheel.msg")
    place, change = rename(one, uri, 0, 2, "Motion")
    assert place.placeholder == "Drive"
    texts = {name: text for path, text in FILES.items() if (name := path.rpartition("/")[2])}
    after = {name: applied(some, texts[name]) for name, some in edits_of(change).items()}
    assert after == {
        "Wheel.msg": "Motion drive\n",
        "Stop.srv": "demo/Motion[] drives\n---\n",
        "CMakeLists.txt": texts["CMakeLists.txt"].replace("Drive", "Motion"),
    }
    (move,) = [one for one in change.document_changes if isinstance(one, lsp.RenameFile)]
    assert move.new_uri == (folder / "msg/Motion.msg").as_uri()
    params = lsp.RenameFilesParams(
        files=[lsp.FileRename(old_uri=(folder / "msg/Drive.msg").as_uri(), new_uri=move.new_uri)]
    )
    assert edits_of(one.ask(lsp.WORKSPACE_WILL_RENAME_FILES, params)).keys() == after.keys()


@pytest.mark.parametrize(
    ("line", "character", "new", "why"),
    [
        (2, 9, "Speed", "is not a valid name"),
        (2, 9, "mode", "`mode` already exists"),
        (0, 7, "fast", "is not a valid name"),
    ],
)
def test_names_that_cannot_be_are_refused(opened, line, character, new, why):
    one, _, open_ = opened
    with pytest.raises(JsonRpcException, match=why):
        rename(one, open_(FILES["msg/Drive.msg"]), line, character, new)


def test_nothing_is_ever_written(opened):
    _, folder, _ = opened
    found = {
        path.relative_to(folder).as_posix(): path.read_text()
        for path in folder.rglob("*")
        if path.is_file() and ".git" not in path.parts
    }
    assert found == FILES
