"""What a server knows follows from the disk and the open documents, not from the way there."""

import io
import shutil
import tempfile
from pathlib import Path

from idlc.editor.documents import Places
from idlc.editor.problems import diagnostics
from idlc.editor.server import Server
from tests.support.examples import given, settings, st

#: Pieces of text that are put together and cut up, so that names clash, appear and vanish.
PIECES = [
    *("float64 x\n", "a/B b\n", "B b\n", "A[] list\n", "b/A a\n", "int8 X=300\n", "flot32 y\r\n"),
    *("---\n", "# 😀 [km/h]\n", "string s 'é'\n", "x", " ", "\r", "\n", "b/Neu neu\n", "float32"),
    *("float64 speed # [km/h] idlc: ignore[IDL405] why\n", "std_msgs/Header header\n"),
]
TEXTS = st.lists(st.sampled_from(PIECES), max_size=4).map("".join)
MANIFESTS = st.sampled_from(
    [
        f"<package><name>{name}</name>{more}</package>"
        for name in "abc"
        for more in ("", "<depend>std_msgs</depend>", "<depend>a")
    ]
)
SETTINGS = st.sampled_from(
    ["", "[tool.idlc]\nexclude=['b']\n", "[tool.idlc.check]\nignore=['IDL405']\n", "[tool.idlc"]
)
INTERFACES = [
    "a/msg/A.msg",
    "a/msg/B.msg",
    "a/srv/S.srv",
    "b/msg/A.msg",
    "b/msg/Neu.msg",
    "c/B.msg",
]
FILES = [*INTERFACES, "a/package.xml", "b/package.xml", "pyproject.toml", "build/msg/Skipped.msg"]


def text_for(name):
    if name.endswith(".xml"):
        return MANIFESTS
    return SETTINGS if name.endswith(".toml") else TEXTS


STEPS = st.one_of(
    st.sampled_from(FILES).flatmap(
        lambda name: st.tuples(
            st.sampled_from(["open", "change", "write"]), st.just(name), text_for(name)
        )
    ),
    st.tuples(
        st.just("edit"),
        st.sampled_from(INTERFACES),
        st.sampled_from(PIECES),
        st.integers(0, 60),
        st.integers(0, 12),
    ),
    st.tuples(st.sampled_from(["close", "delete", "save"]), st.sampled_from(FILES)),
    st.tuples(st.just("rename"), st.sampled_from(INTERFACES), st.sampled_from(INTERFACES)),
    st.tuples(st.sampled_from(["add", "remove"]), st.sampled_from(["a", "b", "."])),
    st.tuples(st.just("look")),
)


class Client:
    """A server, and the texts that its editor shows."""

    def __init__(self, top, folders, encoding="utf-16"):
        self.top = top
        self.folders = list(folders)
        self.encoding = encoding
        self.texts = {}
        self.server = Server(io.BytesIO(), io.BytesIO())
        client = {"general": {"positionEncodings": [encoding]}}
        roots = [self.folder(one) for one in folders]
        self.server.answer("initialize", {"capabilities": client, "workspaceFolders": roots})

    def folder(self, name):
        return {"uri": (self.top / name).as_uri(), "name": name}

    def uri(self, name):
        return (self.top / name).as_uri()

    def tell(self, method, **params):
        self.server.handle_notification(method, params)

    def open(self, name, text):
        self.texts[name] = text
        item = {"uri": self.uri(name), "languageId": "rosmsg", "version": 1, "text": text}
        self.tell("textDocument/didOpen", textDocument=item)

    def change(self, name, text, where=None):
        document = {"uri": self.uri(name), "version": 2}
        one = {"text": text} if where is None else {"text": text, "range": where}
        self.tell("textDocument/didChange", textDocument=document, contentChanges=[one])

    def close(self, name):
        del self.texts[name]
        self.tell("textDocument/didClose", textDocument={"uri": self.uri(name)})

    def watched(self, *names):
        changes = [{"uri": self.uri(name), "type": 2} for name in names]
        self.tell("workspace/didChangeWatchedFiles", changes=changes)

    def problems(self):
        """Return the problems by document, in no particular order."""
        found = diagnostics(self.server.state)
        return {uri: sorted(map(repr, some)) for uri, some in found.items()}


def carry_out(client, step):  # noqa: C901 - one case for each step
    what, *words = step
    match what, words:
        case (("open" | "change"), [name, text]):
            if name in client.texts:
                client.texts[name] = text
                client.change(name, text)
            elif what == "open":
                client.open(name, text)
        case "write", [name, text]:
            write(client.top / name, text)
            client.watched(name)
        case "edit", [name, new, start, size] if name in client.texts:
            edit(client, name, new, start, size)
        case "close", [name] if name in client.texts:
            client.close(name)
        case "save", [name] if name in client.texts:
            write(client.top / name, client.texts[name])
            client.tell("textDocument/didSave", textDocument={"uri": client.uri(name)})
        case "delete", [name]:
            (client.top / name).unlink(missing_ok=True)
            client.watched(name)
        case "rename", [name, other] if (client.top / name).exists():
            write(client.top / other, "")
            (client.top / name).replace(client.top / other)
            client.watched(name, other)
        case (("add" | "remove"), [name]):
            add = what == "add" and name not in client.folders
            remove = what == "remove" and name in client.folders
            client.folders += [name] * add
            if remove:
                client.folders.remove(name)
            event = {
                "added": [client.folder(name)] * add,
                "removed": [client.folder(name)] * remove,
            }
            client.tell("workspace/didChangeWorkspaceFolders", event=event)
        case "look", []:
            client.problems()


def edit(client, name, new, start, size):
    """Replace some characters, at positions that the server must find in its own text."""
    text = client.texts[name]
    start = min(start, len(text))
    end = min(start + size, len(text))
    places = Places(text, client.encoding)
    where = places.range(start, end)
    # what lies within a line's end cannot be named
    start, end = places.offset(where.start), places.offset(where.end)
    client.texts[name] = text[:start] + new + text[end:]
    ends = {
        key: {"line": at.line, "character": at.character}
        for key, at in (("start", where.start), ("end", where.end))
    }
    client.change(name, new, ends)


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(text.encode())


@settings(max_examples=60, deadline=None)
@given(
    st.lists(STEPS, min_size=1, max_size=12),
    st.sampled_from(["utf-8", "utf-16", "utf-32"]),
    st.sampled_from([["."], ["a", "b"], ["a"], []]),
)
def test_any_edits_end_where_a_fresh_start_begins(steps, encoding, folders):
    top = Path(tempfile.mkdtemp(prefix="idlc-lsp-")).resolve()
    try:
        write(top / ".git/HEAD", "")
        for name, text in {
            "a/package.xml": "<package><name>a</name></package>",
            "a/msg/A.msg": "B b\nfloat64 speed # [km/h]\n",
            "a/msg/B.msg": "b/A a\n",
            "b/msg/A.msg": "int8 x 1000\n",
            "build/msg/Skipped.msg": "flot64 x\n",
        }.items():
            write(top / name, text)
        client = Client(top, folders, encoding)
        client.problems()
        for step in steps:
            carry_out(client, step)
        fresh = Client(top, client.folders, encoding)
        for name, text in client.texts.items():
            fresh.open(name, text)
        texts = {one.uri: one.text for one in client.server.state.documents.values()}
        assert texts == {client.uri(name): text for name, text in client.texts.items()}
        assert client.problems() == fresh.problems()
    finally:
        shutil.rmtree(top)
