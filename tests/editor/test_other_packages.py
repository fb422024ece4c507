"""Files that are open in the editor count in the checks of other packages, too."""

import io
import json

import pytest

from idlc.editor.problems import diagnostics
from idlc.editor.server import Server

FILES = {
    ".git/HEAD": "",
    "a/package.xml": "<package><name>a</name></package>",
    "a/msg/A.msg": "int8 x\n",
    "b/package.xml": "<package><name>b</name><depend>a</depend></package>",
    "b/pyproject.toml": "[tool.idlc]\ninclude = ['..']\n",
    "b/msg/B.msg": "a/A a\n",
}
#: Both packages in one folder of the workspace, and each in its own.
FOLDERS = pytest.mark.parametrize("folders", [["."], ["a", "b"]])


class Client:
    def __init__(self, top, folders):
        self.top = top
        self.server = Server(io.BytesIO(), io.BytesIO())
        roots = [{"uri": (top / name).as_uri(), "name": name} for name in folders]
        self.server.answer("initialize", {"capabilities": {}, "workspaceFolders": roots})

    def uri(self, name):
        return (self.top / name).as_uri()

    def open(self, name, text):
        item = {"uri": self.uri(name), "languageId": "rosmsg", "version": 1, "text": text}
        self.server.handle_notification("textDocument/didOpen", {"textDocument": item})

    def problems(self, name):
        """Return the codes of a file's problems."""
        return [one.code for one in diagnostics(self.server.state).get(self.uri(name), [])]

    def types(self, name, line):
        """Return the types that are offered at the end of a line."""
        place = {"line": line.count("\n"), "character": len(line.rpartition("\n")[2])}
        params = {"textDocument": {"uri": self.uri(name)}, "position": place}
        answer = self.server.answer("textDocument/completion", params)
        return [item["label"] for item in json.loads(self.server.encode(answer))["items"]]


@pytest.fixture
def start(tmp_path, monkeypatch):
    """Return a function that starts a server in folders of the workspace."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return lambda folders: Client(tmp_path.resolve(), folders)


@FOLDERS
def test_the_open_text_of_a_message_counts_where_another_package_uses_it(start, folders):
    client = start(folders)
    assert client.problems("b/msg/B.msg") == []
    client.open("a/msg/A.msg", "b/B b\n")
    assert "IDL212" in client.problems("b/msg/B.msg")


@FOLDERS
def test_a_message_without_a_file_can_be_used_by_another_package(start, folders):
    client = start(folders)
    text = "a/New n\n"
    client.open("b/msg/B.msg", text)
    assert client.problems("b/msg/B.msg") == ["IDL201"]
    client.open("a/msg/New.msg", "int8 x\n")
    assert client.problems("b/msg/B.msg") == []


@FOLDERS
def test_the_messages_of_another_package_are_listed_as_they_are_open(start, folders):
    """Those in folders that a check leaves out are none of the package."""
    client = start(folders)
    client.open("b/msg/B.msg", "a/")
    assert client.types("b/msg/B.msg", "a/") == ["a/A"]
    client.open("a/msg/New.msg", "int8 x\n")
    client.open("a/build/Copy.msg", "int8 x\n")
    assert client.types("b/msg/B.msg", "a/") == ["a/A", "a/New"]
