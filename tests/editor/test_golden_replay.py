"""Every golden case of `idlc check`, through the server: the same problems, to the byte.

The files of a case are checked by the command line in each of its folders, and by a server whose
workspace is that folder: first from disk, then as texts that were typed and not saved.
"""

import io
import json
import re
from pathlib import Path

import pytest

from idlc.cli.main import main
from idlc.diagnostics.source import Source
from idlc.diagnostics.text import Audience, addressed_to
from idlc.editor import protocol
from idlc.editor.documents import Places, to_path
from idlc.editor.parts import Position
from idlc.editor.protocol import ENCODINGS
from idlc.editor.server import serve
from idlc.project.files import is_folder
from tests.support import golden_text
from tests.support.paths import GOLDEN

TEXTS = {path: path.read_text(encoding="utf-8") for path in sorted(GOLDEN.glob("diag/*.txt"))}
#: What no editor opens.
NOT_EDITED = re.compile(r"^\$ (?:record|break|idlc check .*\.(?:mcap|db3))\b", re.MULTILINE)
CASES = [
    path for path, text in TEXTS.items() if "$ idlc check" in text and not NOT_EDITED.search(text)
]
#: What an editor's settings call the options of a command.
OPTIONS = {"--select": "select", "--ignore": "ignore", "--distro": "distro"}
OPTIONS |= {"--package": "package", "-I": "include", "--exclude": "exclude"}
#: What is about no file, so that no editor could show it: a folder without interfaces.
NOWHERE = {"IDL606"}
#: Cases that are about the call, or in which nothing is wrong.
WITHOUT_PROBLEMS = {"IDL601_unreadable", "IDL605_other_extension", "IDL607_standard_library"}
WITHOUT_PROBLEMS |= {
    "IDL632_unusable_library",
    "IDL633_inconsistent_index",
    "clean_check",
    "distros_clean",
    "exclude",
}
#: Files whose mark an editor drops and the command line counts.
MARKED = {"IDL106_byte_order_mark"}
#: What is opened and typed anew.
TYPED = (".msg", ".srv", ".action", ".xml", ".toml")


def test_there_are_cases():
    assert len(CASES) >= 90


@pytest.mark.parametrize("number", range(len(CASES)), ids=[path.stem for path in CASES])
def test_the_server_says_what_the_command_line_says(number, tmp_path, capsys, monkeypatch):
    case = golden_text.read(TEXTS[CASES[number]])
    golden_text.run(case, tmp_path, capsys, monkeypatch)
    words = [line for line in case.commands if line[:2] == ["idlc", "check"]][-1][2:]
    options = {word: words[at + 1] for at, word in enumerate(words) if word in OPTIONS}
    options.pop("-I", None)  # is seen from the folder of the command
    named = {tmp_path / word for word in words if is_folder(tmp_path / word)}
    compared = 0
    for folder in sorted({tmp_path, *named}):
        monkeypatch.chdir(folder)
        with monkeypatch.context() as patch:  # hints name the settings
            path = "idlc.cli.exit_status.addressed_to"
            patch.setattr(path, lambda _: addressed_to(Audience.SETTINGS))
            expected = by_command_line(options, capsys)
        encoding = ENCODINGS[number % len(ENCODINGS)]
        from_disk, typed = by_server(folder, options, encoding)
        if CASES[number].stem not in MARKED:
            assert from_disk == expected
        assert typed == expected
        compared += len(expected)
    assert bool(compared) == (CASES[number].stem not in WITHOUT_PROBLEMS)


def by_command_line(options, capsys):
    capsys.readouterr()
    main(["check", *(word for pair in options.items() for word in pair), "--format", "json"])
    lines = map(json.loads, capsys.readouterr().out.splitlines())
    return sorted(
        told(one, one["path"]) for one in lines if one["type"] == "diagnostic" and shown(one)
    )


def shown(one):
    return one["path"] and one["code"] not in NOWHERE


def told(one, path):
    """Return a problem of the command line with the bytes that it is about."""
    lines = [one["message"]]
    lines += [f"for: {', '.join(one['distros'])}"] if one.get("distros") else []
    lines += [one["detail"]] if one["detail"] else []
    lines += [f"hint: {one['hint']}"] if one["hint"] else []
    place = offsets(one, path) if one["line"] else (0, 0)
    labels = [(offsets(label, label["path"]), label["message"]) for label in one["labels"]]
    severity = {"error": 1, "warning": 2}[one["severity"]]
    return Path(path).resolve().as_posix(), one["code"], severity, place, "\n".join(lines), labels


def offsets(one, path):
    source = Source(path, text_of(path))
    found = []
    for line, column in ((one["line"], one["column"]), (one["end_line"], one["end_column"])):
        offset = source.line_starts[line - 1] + column - 1
        found.append(len(source.text[:offset].encode()))
    return tuple(found)


def text_of(path):
    return Path(path).read_bytes().decode("utf-8", errors="replace")


def by_server(folder, options, encoding):
    """Yield what a server says of files on disk, and of the same texts when they are typed."""
    uri = folder.as_uri()
    lists = {"include", "exclude"}
    settings = {OPTIONS[word]: value for word, value in options.items()}
    settings = {name: [one] if name in lists else one for name, one in settings.items()}
    client = {
        "general": {"positionEncodings": [encoding]},
        "textDocument": {"diagnostic": {}},
    }
    messages = [
        request(
            "initialize",
            {
                "capabilities": client,
                "workspaceFolders": [{"uri": uri, "name": ""}],
                "initializationOptions": settings,
            },
        ),
        notification("initialized", {}),
        request("workspace/diagnostic", {"previousResultIds": []}),
    ]
    for path in sorted(folder.rglob("*")):
        if path.suffix in TYPED and "install" not in path.parts and is_text(path):
            name = path.as_uri()
            item = {"uri": name, "languageId": "rosmsg", "version": 1, "text": "# \n"}
            messages.append(notification("textDocument/didOpen", {"textDocument": item}))
            messages.append(request("textDocument/diagnostic", {"textDocument": {"uri": name}}))
            change = {
                "textDocument": {"uri": name, "version": 2},
                "contentChanges": [{"text": path.read_bytes().decode()}],
            }
            messages.append(notification("textDocument/didChange", change))
    messages += [
        request("workspace/diagnostic", {"previousResultIds": []}),
        request("shutdown", None),
        notification("exit", None),
    ]
    for answer in conversation(messages):
        items = answer.get("result") and answer["result"].get("items")
        if items is not None and "kind" not in answer["result"]:
            yield sorted(
                said(one, item["uri"], encoding)
                for item in items
                for one in item["items"]
                if one["code"] not in NOWHERE
            )


def is_text(path):
    try:
        return path.is_file() and path.stat().st_size < 1 << 20 and bool(path.read_text("utf-8"))
    except UnicodeDecodeError:
        return False


def request(method, params):
    return {"jsonrpc": "2.0", "id": 1, "method": method, "params": params}


def notification(method, params):
    return {"jsonrpc": "2.0", "method": method, "params": params}


def conversation(messages):
    """Return what a server says to messages; it runs here, so that it sees what was patched."""
    given, answers = io.BytesIO(), io.BytesIO()
    for one in messages:
        protocol.write(given, json.dumps(one).encode())
    given.seek(0)
    assert serve(given, answers) == 0
    answers.seek(0)
    found = []
    while (body := protocol.read(answers)) is not None:
        found.append(json.loads(body))
    assert [one for one in found if "error" in one or "logMessage" in one.get("method", "")] == []
    return found


def said(one, uri, encoding):
    """Return a problem of the server with the bytes that it is about."""
    related = [
        (bytes_of(label["location"]["uri"], label["location"]["range"], encoding), label["message"])
        for label in one.get("relatedInformation", ())
    ]
    assert Path(to_path(one["codeDescription"]["href"])).is_file()
    path = to_path(uri).resolve().as_posix()
    place = bytes_of(uri, one["range"], encoding)
    return path, one["code"], one["severity"], place, one["message"], related


def bytes_of(uri, where, encoding):
    path = to_path(uri)
    if not path.is_file() or path.stat().st_size > 1 << 20:
        return (0, 0)
    text = text_of(path)
    places = Places(text, encoding)
    ends = (places.offset(Position(**where[end])) for end in ("start", "end"))
    return tuple(len(text[:end].encode()) for end in ends)
