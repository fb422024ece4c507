"""The action that updates the generated package: what `idlc gen` does, when somebody chose it."""

import pytest
from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException

from idlc.cli.main import main
from tests.support.editor import between

UPDATE = "idlc.updateGenerated"
SETTINGS = '[tool.idlc]\npaths = ["."]\nout = "out/demo"\n'
FILES = {"pyproject.toml": SETTINGS, "msg/Drive.msg": "float64 speed\n"}


@pytest.fixture
def opened(editor, package, request):
    """Return an editor, the package's folder, and the URI of its message."""
    folder = package(getattr(request, "param", FILES))
    one = editor(folder)
    return one, folder, one.open(folder / "msg/Drive.msg")


def offered(one, uri, only=None):
    params = lsp.CodeActionParams(
        text_document=lsp.TextDocumentIdentifier(uri=uri),
        range=between(0, 0, 0),
        context=lsp.CodeActionContext(diagnostics=[], only=only),
    )
    found = one.ask(lsp.TEXT_DOCUMENT_CODE_ACTION, params)
    return [each.command for each in found if each.kind == "source.updateGenerated.idlc"]


def update(one, uri):
    params = lsp.ExecuteCommandParams(command=UPDATE, arguments=[uri])
    return one.ask(lsp.WORKSPACE_EXECUTE_COMMAND, params)


def test_it_is_offered_until_it_was_done(opened):
    one, folder, uri = opened
    (command,) = offered(one, uri, ["source"])
    assert command.title == "Update the generated package in out/demo"
    assert not (folder / "out").exists()
    update(one, *command.arguments)
    assert one.told[-1].startswith("idlc gen: demo: ")
    assert (folder / "out/demo/msg/_drive.py").exists()
    assert offered(one, uri) == []
    (folder / "msg/More.msg").write_text("int8 x\n")
    uri = one.open(folder / "msg/More.msg")
    assert offered(one, uri)
    assert offered(one, uri, ["quickfix"]) == []


def test_what_it_writes_is_what_gen_writes(opened, monkeypatch, capsys):
    one, folder, uri = opened
    update(one, uri)
    monkeypatch.chdir(folder)
    assert main(["gen", "--check"]) == 0
    capsys.readouterr()


def test_what_is_not_saved_is_not_compiled(opened):
    one, _, uri = opened
    update(one, uri)
    one.change(uri, "float32 speed\n")
    assert offered(one, uri)
    with pytest.raises(JsonRpcException, match=r"save first.*Drive\.msg"):
        update(one, uri)


def test_an_error_is_told_and_changes_nothing(opened):
    one, folder, uri = opened
    update(one, uri)
    module = folder / "out/demo/msg/_drive.py"
    module.write_text("edited = True\n")
    (folder / "msg/Drive.msg").write_text("float32 speed\n")
    one.change(uri, "float32 speed\n")
    update(one, uri)
    assert "nothing was written" in one.told[-1]
    assert "IDL613" in one.told[-1]
    assert module.read_text() == "edited = True\n"
    (folder / "msg/Drive.msg").write_text("flot32 speed\n")
    one.change(uri, "flot32 speed\n", 3)
    update(one, uri)
    assert "IDL201" in one.told[-1]


@pytest.mark.parametrize("opened", [{"msg/Drive.msg": "float64 speed\n"}], indirect=True)
def test_without_settings_it_goes_where_it_is(opened, monkeypatch, capsys):
    one, folder, uri = opened
    assert offered(one, uri) == []
    with pytest.raises(JsonRpcException, match="set `out` in "):
        update(one, uri)
    monkeypatch.chdir(folder)
    main(["gen", ".", "-o", "demo"])
    capsys.readouterr()
    (folder / "msg/Drive.msg").write_text("float32 speed\n")
    one.change(uri, "float32 speed\n")
    assert offered(one, uri)
    update(one, uri)
    assert main(["gen", ".", "-o", "demo", "--check"]) == 0
    capsys.readouterr()


NESTED = {
    "pyproject.toml": '[tool.idlc]\npaths = ["one", "two"]\nout = "out"\n',
    "one/package.xml": '<package format="3"><name>one</name></package>\n',
    "one/pyproject.toml": "[project]\nname = 'one'\n",
    "one/msg/A.msg": "two/B b\n",
    "two/package.xml": '<package format="3"><name>two</name></package>\n',
    "two/msg/B.msg": "int8 x\n",
    "msg/Drive.msg": "float64 speed\n",
}


@pytest.mark.parametrize("opened", [NESTED], indirect=True)
def test_settings_above_a_package_hold_for_it(opened):
    one, folder, uri = opened
    assert offered(one, uri) == []  # that one is not compiled by them
    uri = one.open(folder / "one/msg/A.msg")
    assert offered(one, uri)
    update(one, uri)
    assert (folder / "out/two/msg/_b.py").exists()
    assert offered(one, uri) == []
    assert offered(one, one.open(folder / "two/msg/B.msg")) == []
