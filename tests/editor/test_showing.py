"""What an editor shows around the text: hints, lenses, colours, folds, selections, links."""

import shutil
import subprocess

import pytest
from lsprotocol import types as lsp

from idlc.editor import descriptions
from idlc.editor.parts import DocumentParams, VersionedUri
from idlc.editor.problems import rest
from idlc.editor.protocol import TYPES
from idlc.editor.state import ServerState
from tests.support.editor import at, between
from tests.support.tools import tool
from tests.support.waiting import wait_for

STOP = """\
# Stops the robot.
# At once.

Wheel[2] wheels
string why 'x'  # [1]
uint8 how
---
uint8 OK=1
bool ok
"""
FILES = {"srv/Stop.srv": STOP, "msg/Wheel.msg": "uint8 side\nfloat64 radius\n"}


@pytest.fixture(scope="module")
def server(editor, package):
    folder = package(FILES)
    shutil.rmtree(folder / ".git")
    git(folder, "init", "-q")
    git(folder, "add", ".")
    git(folder, "commit", "-qm", "first")
    return editor(folder, options={"idlc": {"against": "git:HEAD"}}), folder


def git(folder, *words):
    who = ("-c", "user.name=test", "-c", "user.email=test@example.org")
    subprocess.run([tool("git"), *who, *words], cwd=folder, check=True)


@pytest.fixture
def opened(server):
    one, folder = server
    uri = one.open(folder / "srv/Stop.srv")
    yield one, uri
    one.close(uri)


def document(uri):
    return lsp.TextDocumentIdentifier(uri=uri)


def whole():
    return lsp.Range(start=at(0, 0), end=at(100, 0))


def test_hints_say_where_fields_stand_on_the_wire(opened):
    one, uri = opened
    params = lsp.InlayHintParams(text_document=document(uri), range=whole())
    found = one.ask(lsp.TEXT_DOCUMENT_INLAY_HINT, params)
    assert [(each.position, each.label) for each in found] == [
        (at(3, 15), "@0, 32 B"),
        (at(4, 10), "@32, ≥5 B"),
        (at(5, 9), "@≥37, 1 B"),
        (at(8, 7), "@0, 1 B"),
    ]
    params = lsp.InlayHintParams(text_document=document(uri), range=between(4, 0, 20))
    assert len(one.ask(lsp.TEXT_DOCUMENT_INLAY_HINT, params)) == 1
    one.change(uri, "int8 x\nint9 y\n---\n")
    params = lsp.InlayHintParams(text_document=document(uri), range=whole())
    assert one.ask(lsp.TEXT_DOCUMENT_INLAY_HINT, params) == ()


def lenses(one, uri):
    found = one.ask(lsp.TEXT_DOCUMENT_CODE_LENS, lsp.CodeLensParams(text_document=document(uri)))
    return [one.ask(lsp.CODE_LENS_RESOLVE, each).command.title for each in found]


def test_lenses_say_hash_users_and_what_changes_break(server):
    one, folder = server
    uri = one.open(folder / "msg/Wheel.msg")
    type_hash, users, breaks = lenses(one, uri)
    assert type_hash.startswith("RIHS01_")
    assert users == "1 use"
    assert breaks == "no breaking changes against git:HEAD"
    one.change(uri, "uint8 side\nfloat32 radius\n")
    assert lenses(one, uri)[2] == "breaks: wire, hash, source for 1 user against git:HEAD"
    one.change(uri, "uint8 side\nfloat33 radius\n")
    assert lenses(one, uri)[0] == "no type hash: there are errors"
    one.close(uri)


def test_each_word_has_its_kind(opened):
    one, uri = opened
    params = lsp.SemanticTokensParams(text_document=document(uri))
    data = one.ask(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, params).data
    lines = STOP.split("\n")
    line = start = 0
    found = []
    for down, across, length, kind, _ in zip(*[iter(data)] * 5, strict=True):
        line, start = line + down, across if down else start + across
        found.append((lines[line][start : start + length], TYPES[kind]))
    assert found == [
        ("# Stops the robot.", "comment"),
        ("# At once.", "comment"),
        ("Wheel", "struct"),
        ("2", "number"),
        ("wheels", "property"),
        ("string", "type"),
        ("why", "property"),
        ("'x'", "string"),
        ("# [1]", "comment"),
        ("uint8", "type"),
        ("how", "property"),
        ("---", "keyword"),
        ("uint8", "type"),
        ("OK", "enumMember"),
        ("1", "number"),
        ("bool", "type"),
        ("ok", "property"),
    ]
    params = lsp.SemanticTokensRangeParams(text_document=document(uri), range=between(7, 0, 10))
    assert len(one.ask(lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_RANGE, params).data) == 15


def test_sections_and_comments_fold(opened):
    one, uri = opened
    params = lsp.FoldingRangeParams(text_document=document(uri))
    found = one.ask(lsp.TEXT_DOCUMENT_FOLDING_RANGE, params)
    assert [(each.start_line, each.end_line, each.kind) for each in found] == [
        (0, 1, "comment"),
        (0, 5, "region"),
        (7, 8, "region"),
    ]


def test_a_selection_grows(opened):
    one, uri = opened
    params = lsp.SelectionRangeParams(text_document=document(uri), positions=[at(3, 2)])
    (found,) = one.ask(lsp.TEXT_DOCUMENT_SELECTION_RANGE, params)
    ranges = []
    while found:
        ranges.append(found.range)
        found = found.parent
    assert ranges[:3] == [between(3, 0, 5), between(3, 0, 8), between(3, 0, 15)]
    assert ranges[-1] == lsp.Range(start=at(0, 0), end=at(9, 0))


def test_types_lead_to_their_files(opened):
    one, uri = opened
    params = lsp.DocumentLinkParams(text_document=document(uri))
    (found,) = one.ask(lsp.TEXT_DOCUMENT_DOCUMENT_LINK, params)
    assert found.range == between(3, 0, 5)
    assert found.target.endswith("msg/Wheel.msg")


MODES = """\
uint8 MODE_SLOW=0
uint8 MODE_FAST=2
uint8 OTHER=2
uint8 mode 2
float64 speed 0.5
int8[] gains [1, 2]
string name 'abcdefghijklmnopqrstuvwxyzabcdefghijklmnopqrstuvwxyz'
bool plain
"""


def test_a_lens_tells_defaults_and_which_constants_they_are(editor, package):
    folder = package({"msg/Modes.msg": MODES, "srv/Go.srv": "int8 a\n---\n# text\nint8 b 3\n"})
    one = editor(folder)
    uri = one.open(folder / "msg/Modes.msg")
    found = one.ask(lsp.TEXT_DOCUMENT_CODE_LENS, lsp.CodeLensParams(text_document=document(uri)))
    last = one.ask(lsp.CODE_LENS_RESOLVE, found[-1])
    assert last.range.start == at(3, 0)
    assert last.command.title == (
        "defaults: mode MODE_FAST, speed 0.5, gains [1, 2], "
        "name 'abcdefghijklmnopqrstuvwxyzabcdefghijklm…"
    )
    uri = one.open(folder / "srv/Go.srv")
    assert lenses(one, uri)[1:] == ["defaults: b 3"]
    settings = lsp.DidChangeConfigurationParams(settings={"idlc": {"defaultLens": False}})
    one.tell(lsp.WORKSPACE_DID_CHANGE_CONFIGURATION, settings)
    assert len(lenses(one, uri)) == 1


WATCHES = lsp.ClientCapabilities(
    workspace=lsp.WorkspaceClientCapabilities(
        code_lens=lsp.CodeLensWorkspaceClientCapabilities(refresh_support=True),
        did_change_watched_files=lsp.DidChangeWatchedFilesClientCapabilities(
            dynamic_registration=True
        ),
    )
)
TABLE = """\
[tool.idlc.breaking]
against = "git:HEAD"
[[tool.idlc.breaking.allow]]
at = "demo/msg/Old.*"
reason = "nobody has it"
until = 2999-12-31
"""


@pytest.mark.parametrize("worktree", [False, True])
def test_what_pyproject_compares_with_is_followed(editor, package, worktree):
    files = {"pyproject.toml": TABLE, "msg/Old.msg": "int8 x\n", "msg/New.msg": "int8 x\n"}
    folder = package(files)
    shutil.rmtree(folder / ".git")
    git(folder, "init", "-q")
    git(folder, "add", ".")
    git(folder, "commit", "-qm", "first")
    if worktree:
        other = folder.parent / "other"
        git(folder, "worktree", "add", "-q", str(other))
        folder = other
    one = editor(folder, capabilities=WATCHES)
    asked = one.answer_all()
    uri, old = (one.open(folder / f"msg/{name}.msg", "int16 x\n") for name in ("New", "Old"))
    assert lenses(one, old)[2] == "no breaking changes against git:HEAD"
    assert lenses(one, uri)[2] == "breaks: wire, hash, source for 0 users against git:HEAD"
    (folder / "msg/New.msg").write_text("int16 x\n")
    git(folder, "commit", "-aqm", "second")
    wait_for(lambda: lsp.WORKSPACE_CODE_LENS_REFRESH in [method for method, _ in asked])
    assert lenses(one, uri)[2] == "no breaking changes against git:HEAD"


def test_what_cannot_be_compared_is_said(editor, package):
    """One broken file of the old version says nothing of the others."""
    files = {"pyproject.toml": TABLE, "msg/Old.msg": "int9 x\n", "msg/New.msg": "int8 x\n"}
    folder = package(files)
    shutil.rmtree(folder / ".git")
    git(folder, "init", "-q")
    git(folder, "add", ".")
    git(folder, "commit", "-qm", "first")
    one = editor(folder)
    uri, old = (one.open(folder / f"msg/{name}.msg", "int16 x\n") for name in ("New", "Old"))
    assert lenses(one, old)[2] == "not compared: there are errors in git:HEAD"
    assert lenses(one, uri)[2] == "breaks: wire, hash, source for 0 users against git:HEAD"
    shutil.rmtree(folder / ".git/objects")
    (folder / ".git/refs/heads").rename(folder / ".git/refs/gone")
    assert lenses(one, uri)[2].startswith("not compared: cannot read `git:HEAD`: ")


def test_it_looks_at_git_while_nothing_is_said(package):
    folder = package({"pyproject.toml": TABLE, "msg/New.msg": "int8 x\n"})
    shutil.rmtree(folder / ".git")
    git(folder, "init", "-q")
    git(folder, "add", ".")
    git(folder, "commit", "-qm", "first")
    asked = []
    client = {"workspace": {"codeLens": {"refreshSupport": True}}}
    said = {"capabilities": client, "workspaceFolders": [{"uri": folder.as_uri(), "name": ""}]}
    state = ServerState(said, lambda *_: None, lambda method, *_: asked.append(method))
    document = DocumentParams(VersionedUri((folder / "msg/New.msg").as_uri()))
    rest(state)
    for lens in descriptions.lenses(state.context(document.text_document.uri), document):
        descriptions.resolve(state, lens)
    rest(state)
    assert asked == []
    git(folder, "commit", "-qm", "second", "--allow-empty")
    rest(state)
    rest(state)
    assert asked == ["workspace/codeLens/refresh"]
