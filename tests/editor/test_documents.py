"""Problems of documents as an editor opens, changes, saves and closes them."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from lsprotocol import types as lsp

from idlc.cli.main import main
from idlc.editor.problems import publish
from idlc.editor.state import ServerState
from tests.support.editor import at, between

PULLS = lsp.ClientCapabilities(
    text_document=lsp.TextDocumentClientCapabilities(diagnostic=lsp.DiagnosticClientCapabilities()),
    workspace=lsp.WorkspaceClientCapabilities(
        diagnostics=lsp.DiagnosticWorkspaceClientCapabilities(refresh_support=True)
    ),
)


@pytest.fixture
def opened(server):
    """Return an editor, its folder, and a function that opens a file until the test is over."""
    one, folder = server
    uris = []

    def open_(name, text=None):
        uris.append(one.open(folder / name, text))
        return uris[-1]

    yield one, folder, open_
    for uri in uris:
        one.close(uri)


@pytest.fixture(scope="module")
def server(editor, package):
    files = {"msg/Drive.msg": "float64 speed\n", "msg/Wheel.msg": "Drive drive\n"}
    folder = package(files)
    return editor(folder), folder


def codes(found):
    return [one.code for one in found]


def test_problems_are_told_as_one_types(opened):
    one, _, open_ = opened
    uri = open_("msg/Drive.msg")
    one.change(uri, "flot64 speed\n", 2)
    (found,) = one.wait(uri, 2)
    assert (found.code, found.severity) == ("IDL201", lsp.DiagnosticSeverity.Error)
    assert found.range == between(0, 0, 6)
    assert "hint: did you mean `float64`?" in found.message
    assert found.code_description.href.endswith("/IDL201.md")
    one.change(uri, "a", 3, between(0, 3, 3))
    assert one.wait(uri, 3) == []
    one.change(uri, "int8 a\nint8 a\n", 4)
    (found,) = one.wait(uri, 4)
    (related,) = found.related_information
    assert related.location == lsp.Location(uri=uri, range=between(0, 5, 6))


def test_one_document_is_what_another_refers_to(opened):
    one, _, open_ = opened
    wheel, drive = open_("msg/Wheel.msg"), open_("msg/Drive.msg")
    assert one.pull(wheel) == []
    one.change(drive, "Wheel wheel\n")
    assert codes(one.pull(wheel) + one.pull(drive)) == ["IDL210"]  # they contain each other
    one.close(drive)
    assert one.pull(wheel) == []  # what was not saved does not count any more
    one.open(drive, "int8 x\n")


def test_a_file_that_is_not_saved_yet_is_one_of_the_package(opened):
    one, _, open_ = opened
    wheel = open_("msg/Wheel.msg", "Novel novel\n")
    assert codes(one.pull(wheel)) == ["IDL201"]
    new = open_("msg/Novel.msg", "int9 x\n")
    assert one.pull(wheel) == []
    assert codes(one.pull(new)) == ["IDL201"]


@pytest.mark.parametrize("can_refresh", [False, True])
def test_an_error_of_a_missing_file_ends_when_it_is_there(editor, package, can_refresh):
    """Clients that request problems request them for changed documents only, unless asked to."""
    folder = package({"msg/Wheel.msg": "Late late\n"})
    client = lsp.ClientCapabilities(
        text_document=PULLS.text_document,
        workspace=lsp.WorkspaceClientCapabilities(
            diagnostics=lsp.DiagnosticWorkspaceClientCapabilities(refresh_support=can_refresh)
        ),
    )
    one = editor(folder, capabilities=client)
    asked = one.answer_all()
    assert (one.answer.capabilities.diagnostic_provider is not None) == can_refresh
    uri = one.open(folder / "msg/Wheel.msg")
    assert codes(one.pull(uri) if can_refresh else one.wait(uri)) == ["IDL201"]
    asked.clear()
    one.problems.clear()
    (folder / "msg/Late.msg").write_text("int8 x\n")
    document = lsp.TextDocumentIdentifier(uri=uri)
    one.tell(lsp.TEXT_DOCUMENT_DID_SAVE, lsp.DidSaveTextDocumentParams(text_document=document))
    if can_refresh:
        assert one.pull(uri) == []
        one.ask(lsp.TEXT_DOCUMENT_DIAGNOSTIC, lsp.DocumentDiagnosticParams(document))
        assert (lsp.WORKSPACE_DIAGNOSTIC_REFRESH, None) in asked
        assert one.problems == {}
    else:
        assert one.wait(uri) == []


def test_a_draft_without_a_file_is_checked_by_what_it_looks_like(editor, package, monkeypatch):
    folder = package({"msg/Drive.msg": "int8 x\n"})
    monkeypatch.chdir(folder)
    one = editor()
    uri = one.open("untitled:Untitled-1", "Drive drive\nDrve other\n---\n")
    (found,) = one.wait(uri, 1)
    assert (found.code, found.range) == ("IDL201", between(1, 0, 4))
    params = lsp.HoverParams(lsp.TextDocumentIdentifier(uri=uri), at(0, 1))
    assert "**demo/msg/Drive**" in one.ask(lsp.TEXT_DOCUMENT_HOVER, params).contents.value
    one.open("untitled:Untitled-2", "not an interface", "plaintext")
    one.close(uri)
    assert one.pull(uri) == []


def test_files_that_change_on_disk_are_noticed(opened):
    one, folder, open_ = opened
    wheel = open_("msg/Wheel.msg", "Fresh fresh\n")
    assert codes(one.pull(wheel)) == ["IDL201"]
    path = folder / "msg/Fresh.msg"
    path.write_text("int8 x\n")
    tell_of(one, path, lsp.FileChangeType.Created)
    assert one.pull(wheel) == []
    path.rename(folder / "msg/Other.msg")
    tell_of(one, path, lsp.FileChangeType.Deleted)
    assert codes(one.pull(wheel)) == ["IDL201"]
    (folder / "msg/Other.msg").unlink()
    save(one, wheel)
    assert codes(one.pull(wheel)) == ["IDL201"]


def save(one, uri):
    """Tell the server that a document was saved; it looks at the disk then."""
    document = lsp.TextDocumentIdentifier(uri=uri)
    params = lsp.DidSaveTextDocumentParams(text_document=document)
    one.tell(lsp.TEXT_DOCUMENT_DID_SAVE, params)


def tell_of(one, path, kind):
    changes = [lsp.FileEvent(uri=path.as_uri(), type=kind)]
    params = lsp.DidChangeWatchedFilesParams(changes=changes)
    one.tell(lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES, params)


def test_settings_and_package_xml_have_their_problems_in_their_own_files(opened):
    one, folder, open_ = opened
    manifest = open_("package.xml")
    settings = one.open(folder / "pyproject.toml", "[tool.idlc]\npahts = []\n", "toml")
    (found,) = one.pull(settings)
    assert (found.code, found.range) == ("IDL611", between(1, 0, 5))
    one.close(settings)
    text = '<package format="3">\n  <name>demo</name>\n  <depend>nav_msgs</depend>\n</package>\n'
    one.change(manifest, text)
    (found,) = one.pull(manifest)
    assert (found.code, found.range.start) == ("IDL452", at(2, 2))
    assert found.tags == (lsp.DiagnosticTag.Unnecessary,)
    one.change(manifest, "<package>", 3)
    assert codes(one.pull(manifest)) == ["IDL610"]


def test_rules_for_recordings_have_problems_that_follow_the_disk(opened):
    one, folder, open_ = opened
    drive = open_("msg/Drive.msg")
    rules = folder / "upgrade/drive.py"
    rules.parent.mkdir()
    pair = 'OLD = ("demo/msg/{}", "RIHS01_{:064}")\nNEW = ("demo/msg/Gone", "RIHS01_{:064}")\n'
    for text, problems in {pair.format("Drive", 1, 2): ["IDL665"], "def a(:\n": ["IDL664"]}.items():
        rules.write_text(text)
        save(one, drive)
        assert codes(one.pull(rules.as_uri())) == problems
    rules.unlink()
    save(one, drive)
    assert one.pull(rules.as_uri()) == one.pull(drive) == []


def test_settings_of_the_editor_count(opened):
    one, _, open_ = opened
    uri = open_("msg/Drive.msg", "float64 speed  # [km/h]\n")
    assert codes(one.pull(uri)) == ["IDL405"]
    settle(one, {"idlc": {"ignore": "IDL405"}})
    assert one.pull(uri) == []
    settle(one, {"idlc": {"ignore": 3}})
    assert one.pull(uri) == []  # a mistake changes nothing
    assert "invalid settings for idlc" in one.told[-1]
    settle(one, {"idlc": {}})
    assert codes(one.pull(uri)) == ["IDL405"]


def settle(one, settings):
    params = lsp.DidChangeConfigurationParams(settings=settings)
    one.tell(lsp.WORKSPACE_DID_CHANGE_CONFIGURATION, params)


def test_a_file_of_no_workspace_is_checked_with_its_package(server, package):
    one, _ = server
    other = package({"msg/A.msg": "B b\n", "msg/B.msg": "int9 x\n"}, "other")
    uri = one.open(other / "msg/A.msg")
    assert one.pull(uri) == []
    assert codes(one.pull((other / "msg/B.msg").as_uri())) == ["IDL201"]
    one.close(uri)
    assert one.pull((other / "msg/B.msg").as_uri()) == []
    (other / "package.xml").unlink()
    uri = one.open(other / "msg/B.msg")
    assert codes(one.pull(uri)) == ["IDL201"]
    one.close(uri)


def test_folders_come_and_go(server, package):
    one, _ = server
    other = package({"msg/A.msg": "int9 x\n"}, "another")
    folder = lsp.WorkspaceFolder(uri=other.as_uri(), name="another")
    uri = (other / "msg/A.msg").as_uri()
    for added, removed, expected in (([folder], [], ["IDL201"]), ([], [folder], [])):
        event = lsp.WorkspaceFoldersChangeEvent(added=added, removed=removed)
        params = lsp.DidChangeWorkspaceFoldersParams(event=event)
        one.tell(lsp.WORKSPACE_DID_CHANGE_WORKSPACE_FOLDERS, params)
        assert codes(one.pull(uri)) == expected


@pytest.mark.parametrize(
    ("offered", "agreed", "column"),
    [
        (["utf-8", "utf-16"], "utf-8", 12),
        (["utf-16"], "utf-16", 10),
        (["x", "utf-32"], "utf-32", 9),
    ],
)
def test_positions_are_counted_as_agreed(editor, package, offered, agreed, column):
    general = lsp.GeneralClientCapabilities(position_encodings=offered)
    folder = package({"msg/A.msg": ""})
    one = editor(folder, capabilities=lsp.ClientCapabilities(general=general))
    assert one.answer.capabilities.position_encoding == agreed
    uri = one.open(folder / "msg/A.msg", "int8 x\r\nstring a '😀\"\r\n")
    one.change(uri, "é", 2, between(1, column + 1, column + 1))
    one.change(uri, "int8 y\n", 3, between(10**6, 0, 10**6))  # beyond the end is the end
    symbols = lsp.DocumentSymbolParams(text_document=lsp.TextDocumentIdentifier(uri=uri))
    found = one.ask(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL, symbols)
    assert [each.name for each in found] == ["x", "a", "y"]
    one.change(uri, "string a '😀' flot\n", 4)
    (problem,) = one.pull(uri)
    assert problem.range.start == at(0, 9)


def test_a_client_that_asks_gets_nothing_pushed(editor, package):
    folder = package({"msg/A.msg": "int9 x\n", "msg/B.msg": "int8 x\n"})
    one = editor(folder, capabilities=PULLS)
    params = lsp.WorkspaceDiagnosticParams(previous_result_ids=[])
    (report,) = one.ask(lsp.WORKSPACE_DIAGNOSTIC, params).items
    assert report.uri == (folder / "msg/A.msg").as_uri()
    known = lsp.PreviousResultId(uri=report.uri, value=report.result_id)
    params = lsp.WorkspaceDiagnosticParams(previous_result_ids=[known])
    (again,) = one.ask(lsp.WORKSPACE_DIAGNOSTIC, params).items
    assert again.kind == "unchanged"
    uri = one.open(folder / "msg/A.msg", "int8 x\n")
    assert one.pull(uri) == []
    (gone,) = one.ask(lsp.WORKSPACE_DIAGNOSTIC, params).items
    assert (gone.kind, gone.items) == ("full", ())
    assert one.problems == {}


def test_what_the_server_can_do_is_what_it_says(editor, package):
    words = [sys.executable, "-m", "idlc", "lsp", "--check"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    said = json.loads(done.stdout)
    answer = editor(package({})).answer
    assert said["serverInfo"]["name"] == answer.server_info.name == "idlc"
    assert said["capabilities"]["hoverProvider"] is answer.capabilities.hover_provider is True
    providers = {name for name in said["capabilities"] if name.endswith("Provider")}
    assert len(providers) == 21


def test_line_ends_of_windows_stay_those_of_the_document(editor, package):
    text = "# Text.\r\nflot64 x\r\nint8   y\r\n"
    folder = package({"msg/A.msg": text})
    one = editor(folder)
    uri = one.open(folder / "msg/A.msg")
    (problem,) = one.pull(uri)
    assert problem.range == between(1, 0, 6)
    one.change(uri, "float64", 2, between(1, 0, 6))
    assert one.pull(uri) == []
    options = lsp.FormattingOptions(tab_size=4, insert_spaces=True)
    params = lsp.DocumentFormattingParams(lsp.TextDocumentIdentifier(uri=uri), options)
    (edit,) = one.ask(lsp.TEXT_DOCUMENT_FORMATTING, params)
    assert (edit.range, edit.new_text) == (
        lsp.Range(start=at(2, 0), end=at(3, 0)),
        "int8 y\r\n",
    )


def test_a_mark_of_utf_8_counts_as_on_the_command_line(editor, package, capsys):
    folder = package({"msg/A.msg": "\ufeffint8 x\n", "msg/B.msg": "int8 x\n"})
    one = editor(folder)
    uri = (folder / "msg/A.msg").as_uri()
    main(["check", str(folder), "--format", "json"])
    lines = capsys.readouterr().out.splitlines()
    told = [found["code"] for line in lines if "code" in (found := json.loads(line))]
    assert codes(one.pull(uri)) == told
    one.open(uri, "int8 x\n")  # editors open it without the mark
    assert one.pull(uri) == []


def test_a_folder_may_be_a_symbolic_link(editor, package, tmp_path):
    folder = package({"msg/A.msg": "B b\n", "msg/B.msg": "int9 x\n"})
    link = tmp_path / "link"
    link.symlink_to(folder, target_is_directory=True)
    one = editor(link)
    uri = one.open(link / "msg/A.msg")
    assert one.pull(uri) == []
    assert codes(one.wait((link / "msg/B.msg").as_uri())) == ["IDL201"]
    # the same file by its other name, as some editors open it
    other = one.open(folder / "msg/A.msg", "B b\nflot64 y\n")
    assert codes(one.pull(other)) == ["IDL201"]


def test_a_folder_without_settings_or_packages_is_looked_at(editor, tmp_path):
    one = editor(tmp_path)
    uri = one.open(tmp_path / "A.msg", "flot64 x\n")
    assert codes(one.pull(uri)) == ["IDL201"]
    (tmp_path / "B.txt").write_text("x")
    assert one.pull((tmp_path / "B.txt").as_uri()) == []


def test_files_that_change_while_the_editor_says_nothing(editor, package):
    """For a client that watches nothing, long after its last message."""
    folder = package({"msg/Wheel.msg": "float64 radius\n"})
    one = editor(folder)
    uri = one.open(folder / "msg/Wheel.msg")
    assert one.wait(uri) == []
    for name in ("New", "Newer"):
        path = folder / f"msg/{name}.msg"
        path.write_text("flot64 x\n")
        assert "IDL201" in codes(one.wait(path.as_uri()))


def test_hints_name_settings_because_an_editor_has_no_options(editor, package):
    folder = package({"msg/Wheel.msg": "other/Tyre tyre\nnowhere/Tyre tyre2\n"})
    (folder.parent / "other/msg").mkdir(parents=True)
    (folder.parent / "other/msg/Tyre.msg").write_text("float64 x\n")
    one = editor(folder)
    found = one.wait(one.open(folder / "msg/Wheel.msg"))
    beside, unknown = (problem.message for problem in found if problem.code == "IDL202")
    assert "add `..` to `include` in [tool.idlc] of pyproject.toml" in beside
    assert "add `DIR` to `include` in [tool.idlc] of pyproject.toml" in unknown


def test_the_text_that_counts_is_that_of_the_document_which_is_edited():
    """Of a file that is open by two spellings of its URI."""
    state = ServerState({}, lambda *_: None, lambda *_: None)
    for name in ("A", "%41"):
        item = {"uri": f"file:///x/{name}.msg", "languageId": "rosmsg", "version": 1}
        params = {"textDocument": {**item, "text": f"# {name}\n"}}
        state.handle_notification("textDocument/didOpen", params)
    path = Path("/x/A.msg")
    assert state.texts()[path] == state.document_at(path).data


def test_problems_of_a_file_that_was_renamed_meanwhile_are_withdrawn(package):
    """Neovim opens, renames and closes a file, all between two publications."""
    folder = package({"msg/A.msg": "flot64 x\n"})
    published = []
    state = ServerState(
        {"workspaceFolders": [{"uri": folder.as_uri(), "name": ""}]},
        lambda _, params: published.append((params["uri"], bytes(params["diagnostics"]) != b"[]")),
        lambda *_: None,
    )
    uri = (folder / "msg/A.msg").as_uri()
    document = {"uri": uri, "languageId": "rosmsg", "version": 0, "text": "flot64 x\n"}
    publish(state)
    state.handle_notification("textDocument/didOpen", {"textDocument": document})
    (folder / "msg/A.msg").unlink()
    state.handle_notification("textDocument/didClose", {"textDocument": {"uri": uri}})
    publish(state)
    assert published == [(uri, True), (uri, False)]
