"""Whatever a client sends, the server lives on; it ends when the client does."""

import io
import json
import os
import random
import signal
import subprocess
import sys
from io import BytesIO

import pytest

from idlc.editor.server import FILE_METHODS, METHODS, Server
from tests.editor.test_golden_replay import notification, request
from tests.support.waiting import LIMIT, read_line


def frame(message):
    body = message if isinstance(message, bytes) else json.dumps(message).encode()
    return b"Content-Length: %d\r\n\r\n%b" % (len(body), body)


def run(*parts, status=0):
    """Return what a server answers to bytes or messages, after which nothing more comes."""
    data = b"".join(part if isinstance(part, bytes) else frame(part) for part in parts)
    done = subprocess.run(
        [sys.executable, "-m", "idlc", "lsp"],
        input=data,
        capture_output=True,
        check=False,
    )
    assert done.stderr == b""
    assert done.returncode == status
    return list(messages_in(done.stdout))


def messages_in(data):
    while data:
        head, _, rest = data.partition(b"\r\n\r\n")
        length = int(head.split(b":")[1])
        yield json.loads(rest[:length])
        data = rest[length:]


def beginning(**more):
    params = {"capabilities": {}, "processId": None, "rootUri": None, **more}
    return {**request("initialize", params), "id": "first"}


END = [{**request("shutdown", None), "id": "last"}, notification("exit", None)]


def errors(found):
    return [one["error"]["code"] for one in found if "error" in one]


def test_the_exit_status_says_whether_it_was_asked_to_end():
    assert run(beginning(), *END)[-1] == {"jsonrpc": "2.0", "id": "last", "result": None}
    run(beginning(), notification("exit", None), status=1)
    run(beginning(), status=1)  # the client is gone
    run(status=1)


def test_the_order_of_a_session_is_held():
    found = run(
        request("textDocument/hover", {}),
        notification("textDocument/didOpen", {"textDocument": 3}),
        beginning(),
        beginning(),
        request("no/suchMethod", {}),
        notification("no/suchNotification", {}),
        request("$/alsoUnknown", {}),
        *END[:1],
        request("textDocument/hover", {}),
        *END[1:],
    )
    assert errors(found) == [-32002, -32600, -32601, -32601, -32600]


def test_what_is_no_message_is_answered_or_passed_over():
    found = run(
        b"GET / HTTP/1.1\r\n\r\n",
        frame(b"{not json"),
        frame(b"[]"),
        frame(b"3"),
        frame(b'{"id": 1.5, "method": "initialize"}'),
        frame(b'{"jsonrpc": "2.0"}'),
        frame(b'{"id": 7, "result": "nobody asked"}'),
        frame(b"\xff\xfe"),
        frame(b"[" * 100_000),
        frame(b'{"id": 1, "method": "initialize", "params": ' + b"[" * 100_000),
        b"Content-Length: -5\r\n\r\n",
        b"Content-Length: 99999999999999999999\r\n\r\n",
        b"x" * 20_000 + b"\r\n",
        beginning(),
        *END,
    )
    assert errors(found) == [-32700, -32600, -32600, -32600, -32700, -32700, -32700]
    assert found[-1]["id"] == "last"


def test_wrong_parameters_are_refused():
    found = run(
        beginning(),
        *(
            request(name, params)
            for name in METHODS | FILE_METHODS
            for params in (None, [], {"textDocument": 1})
        ),
        notification("textDocument/didChange", {"textDocument": {"uri": "x"}}),
        notification("textDocument/didOpen", {}),
        *END,
    )
    assert set(errors(found)) <= {-32602, -32603}
    assert -32603 not in errors(found)
    assert sum(one.get("method") == "window/logMessage" for one in found) == 2


@pytest.fixture(scope="module")
def workspace(package):
    files = {"msg/A.msg": "B b\nfloat64 speed  # [m/s]\n", "msg/B.msg": "int8 x\n"}
    return package(files)


def opened(folder, text="int8 x\n", name="msg/A.msg"):
    uri = (folder / name).as_uri()
    item = {"uri": uri, "languageId": "rosmsg", "version": 1, "text": text}
    return uri, notification("textDocument/didOpen", {"textDocument": item})


def changed(uri, text, version, where=None):
    one = {"text": text} if where is None else {"text": text, "range": where}
    document = {"uri": uri, "version": version}
    params = {"textDocument": document, "contentChanges": [one]}
    return notification("textDocument/didChange", params)


def span(*numbers):
    line, start, last, end = numbers
    return {
        "start": {"line": line, "character": start},
        "end": {"line": last, "character": end},
    }


def test_ten_thousand_changes_are_followed_by_few_checks(workspace):
    uri, first = opened(workspace)
    changes = (
        changed(uri, "flot64 y\n" if number % 2 else "", number, span(0, 0, 1 - number % 2, 0))
        for number in range(2, 10_002)
    )
    asked = request("textDocument/diagnostic", {"textDocument": {"uri": uri}})
    found = run(
        beginning(rootUri=workspace.as_uri()), first, *changes, {**asked, "id": "last one"}, *END
    )
    (answer,) = [one for one in found if one.get("id") == "last one"]
    assert [one["code"] for one in answer["result"]["items"]] == ["IDL201"]
    told = [one for one in found if one.get("method") == "textDocument/publishDiagnostics"]
    assert len(told) < 100


def test_a_huge_document_is_refused_as_the_command_line_refuses_it(workspace):
    uri, first = opened(workspace, "int8 x\n" * 2_500_000)
    asked = request("textDocument/diagnostic", {"textDocument": {"uri": uri}})
    found = run(beginning(rootUri=workspace.as_uri()), first, asked, *END)
    (items,) = [one["result"]["items"] for one in found if "items" in (one.get("result") or {})]
    assert [one["code"] for one in items] == ["IDL604"]


@pytest.mark.parametrize("seed", range(3))
def test_any_request_about_any_text_is_answered(workspace, seed):
    """Random pieces of text, and every request at random places, also beyond the end."""
    rng = random.Random(seed)
    pieces = ["int8", " ", "\n", "\r\n", "\t", "A", "B b", "#", "[", "<=", "=", "---\n", "é", "😀"]
    pieces += ["@optional ", "\ufeff", "3", "'", "string<=", "std_msgs/", "X=1", "idlc: ignore["]
    pieces += ["\x0b", "\u2028", "\x00", "/", "float64[3] f [1, 2]\n", "# [m/s]\n"]
    uri, first = opened(workspace, "")
    parts = [beginning(rootUri=workspace.as_uri()), first]
    count = 0
    for version in range(2, 42):
        text = "".join(rng.choice(pieces) for _ in range(rng.randrange(30)))
        where = None
        if rng.random() < 0.7:
            where = span(*(rng.choice([0, 0, 1, 2, 3, 7, 10**9]) for _ in range(4)))
        parts.append(changed(uri, text, version, where))
        for name in METHODS | FILE_METHODS:
            if name in ("workspace/textDocumentContent", "codeLens/resolve"):
                continue
            place = {"line": rng.randrange(4), "character": rng.randrange(12)}
            params = {
                "textDocument": {"uri": uri},
                "position": place,
                "positions": [place],
                "range": span(0, 0, rng.randrange(5), 3),
                "context": {"diagnostics": []},
                "newName": rng.choice(["abc", "ABC", "Abc", "", "é"]),
                "query": "a",
                "files": [],
                "command": "idlc.addDependency",
                "arguments": [uri, "std_msgs"],
            }
            count += 1
            parts.append({**request(name, params), "id": count})
    found = run(*parts, *END)
    answers = {one["id"]: one for one in found if "method" not in one}
    assert len(answers) == count + 2
    assert [one for one in found if one.get("method") == "window/logMessage"] == []
    assert set(errors(found)) <= {-32803}


def test_a_cancelled_request_is_not_begun(workspace):
    uri, first = opened(workspace)
    asked = [
        {**request("textDocument/diagnostic", {"textDocument": {"uri": uri}}), "id": number}
        for number in range(200)
    ]
    cancel = notification("$/cancelRequest", {"id": 199})
    found = run(beginning(rootUri=workspace.as_uri()), first, *asked, cancel, *END)
    answers = {one["id"]: one for one in found if "id" in one and "method" not in one}
    assert len(answers) == 202
    assert answers[199]["error"]["code"] == -32800
    assert "result" in answers[0]


def start(*words, **variables):
    return subprocess.Popen(
        [sys.executable, *(words or ("-m", "idlc", "lsp"))],
        env={**os.environ, **variables},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_it_ends_with_a_client_that_reads_no_more(unbuffered, workspace):
    with start(PYTHONUNBUFFERED=unbuffered) as server:
        server.stdin.write(frame(beginning(rootUri=workspace.as_uri())))
        server.stdin.flush()
        assert read_line(server.stdout)
        server.stdout.close()
        _, first = opened(workspace, "flot64 x\n")
        server.stdin.write(frame(first))
        server.stdin.flush()
        assert server.wait(LIMIT) == 1
        assert server.stderr.read() == b""


def test_it_ends_when_the_client_is_gone_although_the_stream_is_open():
    """Another process holds the stream; the client's number is in `initialize`."""
    with subprocess.Popen([sys.executable, "-c", ""]) as client:
        pass
    impatient = "import idlc.editor.server as s; s.PATIENCE = 0.1; from idlc.cli.main import main"
    with start("-c", f"{impatient}; raise SystemExit(main(['lsp']))") as server:
        server.stdin.write(frame(beginning(processId=client.pid)))
        server.stdin.flush()
        assert server.wait(LIMIT) == 1


def test_an_interrupt_ends_it_quietly():
    with start() as server:
        server.stdin.write(frame(beginning()))
        server.stdin.flush()
        assert read_line(server.stdout)
        server.send_signal(signal.SIGINT)
        server.wait(LIMIT)
        assert b"Traceback" not in server.stderr.read()


@pytest.mark.parametrize("where", ["idlc.model.link.link", "idlc.editor.workspace.list_files"])
def test_what_is_wrong_in_idlc_itself_is_a_problem_and_no_end(where, workspace, monkeypatch):
    from idlc.editor.problems import diagnostics

    def fail(*_):
        raise ZeroDivisionError("as the test asked for")

    server = Server(io.BytesIO(), io.BytesIO())
    roots = [{"uri": workspace.as_uri(), "name": ""}]
    server.answer("initialize", {"capabilities": {}, "workspaceFolders": roots})
    with monkeypatch.context() as patch:
        patch.setattr(where, fail)
        ((uri, (found,)),) = diagnostics(server.state).items()
        assert uri.startswith(workspace.as_uri())
        assert found.code == "IDL901"
        assert "ZeroDivisionError: as the test asked for" in found.message
    uri, message = opened(workspace, "flot64 x\n")
    server.handle_notification(message["method"], message["params"])
    (found,) = diagnostics(server.state)[uri]
    assert found.code == "IDL201"


@pytest.mark.parametrize("words", [[], ["--stdio"], ["--stdio", "--clientProcessId=7"]])
def test_words_that_clients_add_cost_no_time(words):
    code = (
        "import sys; from idlc.cli.main import main; status = main(sys.argv[1:]);"
        "sys.stderr.write(' '.join(sys.modules)); sys.exit(status)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "lsp", *words],
        input=b"".join(map(frame, (beginning(), *END))),
        capture_output=True,
        check=True,
    )
    assert len(list(messages_in(done.stdout))) == 2
    assert not {"click", "msgspec"} & set(done.stderr.decode().split())


def test_words_of_clients_go_with_others():
    words = ["lsp", "--stdio", "--clientProcessId=7", "--check"]
    done = subprocess.run([sys.executable, "-m", "idlc", *words], capture_output=True, check=True)
    assert json.loads(done.stdout)["serverInfo"]["name"] == "idlc"


@pytest.mark.parametrize("half", ["\\ud800", "\\udfff"])
def test_half_a_pair_is_no_text(workspace, half):
    """In JSON it can be written, in UTF-8 it cannot: neither read as a path nor sent back."""
    uri = f'"file:///a{half}.msg"'
    position = '{"line": 0, "character": 0}'
    params = f'{{"textDocument": {{"uri": {uri}}}, "position": {position}}}'
    change = f'{{"textDocument": {{"uri": {uri}, "version": 2}}, "contentChanges": []}}'
    messages = [
        f'{{"jsonrpc": "2.0", "id": 1, "method": "textDocument/hover", "params": {params}}}',
        f'{{"jsonrpc": "2.0", "id": 2, "method": "no{half}", "params": null}}',
        f'{{"jsonrpc": "2.0", "id": "{half}", "method": "textDocument/hover"}}',
        f'{{"jsonrpc": "2.0", "method": "textDocument/didChange", "params": {change}}}',
    ]
    parts = [frame(one.encode()) for one in messages]
    found = run(
        beginning(rootUri=workspace.as_uri()), notification("initialized", {}), *parts, *END
    )
    assert errors(found) == [-32602, -32602, -32600]
    assert found[-1]["id"] == "last"


def test_what_was_answered_or_cancelled_leaves_nothing():
    cancels = [notification("$/cancelRequest", {"id": number}) for number in range(50)]
    asked = [{**request("textDocument/hover", None), "id": number} for number in range(20, 30)]
    parts = [beginning(), *cancels, *asked, *cancels, *END]
    server = Server(BytesIO(b"".join(map(frame, parts))), BytesIO())
    assert server.run() == 0
    kept = {name: value for name, value in vars(server).items() if isinstance(value, (set, dict))}
    assert kept.pop("_initialize")
    assert kept
    assert not any(kept.values())


def test_lines_are_found_in_linear_time():
    """In quadratic time, one of these texts takes hours."""
    code = """
import resource
from idlc.editor.documents import lines_of
resource.setrlimit(resource.RLIMIT_CPU, (20, 20))
for text in ("x", " ", "\\r", "\\n", "\\r\\n", "x\\n", "é"):
    lines = lines_of(text * 1_000_000)
    assert "".join(lines) == text * 1_000_000
    assert not lines[-1].endswith(("\\r", "\\n"))
"""
    subprocess.run([sys.executable, "-c", code], check=True)
