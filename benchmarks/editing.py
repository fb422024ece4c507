"""What an editor waits for: the language server, over its pipes.

Times are CPU time of the server, which the kernel counts in nanoseconds: the clock on the wall of a
machine with nothing else to do. Packages are of the size of px4_msgs, the largest that is around:
261 messages of 30 lines.
"""

import json
import math
import subprocess
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

from benchmarks.measure import IDLC, Goal, Row
from benchmarks.processes import ENVIRONMENT
from benchmarks.starting import place
from benchmarks.work import Work
from idlc.editor import protocol

LARGE = 261
LINES = 30
#: Changes, and requests, of which the 99th percentile is taken.
TIMES = 200


def rows(work: Work) -> Iterator[Row]:
    start = Goal(at_most=3, than="bare interpreter")
    yield Row("editor", "start, until ready to answer", partial(starting, work), start, rounds=15)
    second = Goal(at_most=1)
    yield Row("editor", "open 1,000 files", partial(opening, work), second, rounds=5)
    change = Goal(at_most=0.02)
    yield Row("editor", "change to problems, p99", partial(changing, work), change, rounds=5)
    complete = Goal(at_most=0.01)
    yield Row("editor", "complete a type, p99", partial(completing, work), complete, rounds=5)


class Client:
    """A client of a server of its own."""

    def __init__(self, python: Path, folder: Path) -> None:
        self._process = subprocess.Popen(
            [python, "-m", "idlc", "lsp"],
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=ENVIRONMENT,
        )
        self._number = 0
        self.ask(
            "initialize", capabilities={}, workspaceFolders=[{"uri": folder.as_uri(), "name": ""}]
        )

    def spent(self) -> float:
        """Return the seconds that the server has worked."""
        tasks = Path(f"/proc/{self._process.pid}/task").glob("*/schedstat")
        return sum(int(one.read_text().split()[0]) for one in tasks) / 1e9

    def tell(self, method: str, **params: object) -> None:
        self._send({"jsonrpc": "2.0", "method": method, "params": params})

    def ask(self, method: str, **params: object) -> object:
        self._number += 1
        self._send({"jsonrpc": "2.0", "id": self._number, "method": method, "params": params})
        return self.until(lambda one: one.get("id") == self._number)["result"]

    def _send(self, message: object) -> None:
        protocol.write(self._process.stdin, json.dumps(message).encode())

    def until(self, wanted) -> dict:
        """Return the first message of the server that is wanted."""
        while True:
            body = protocol.read(self._process.stdout)
            assert body is not None, "the server has ended"
            message = json.loads(body)
            if wanted(message):
                return message

    def problems(self, uri: str, version: int | None = None) -> None:
        """Wait for the problems of a document."""
        self.until(
            lambda one: (
                one.get("method") == "textDocument/publishDiagnostics"
                and one["params"]["uri"] == uri
                and one["params"].get("version") == version
            )
        )

    def end(self) -> None:
        self.ask("shutdown")
        self.tell("exit")
        with self._process:
            pass


def starting(work: Work):
    """Return candidates: the CPU time of a server that is asked for nothing else."""
    python, folder = place(work)

    def serve() -> float:
        before = getrusage(RUSAGE_CHILDREN)
        Client(python, folder).end()
        return cpu_since(before)

    def bare() -> float:
        before = getrusage(RUSAGE_CHILDREN)
        subprocess.run([python, "-c", ""], check=True, env=ENVIRONMENT)
        return cpu_since(before)

    return {IDLC: serve, "bare interpreter": bare}


def cpu_since(before) -> float:
    after = getrusage(RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def package(work: Work, name: str, files: int) -> Path:
    """Return the folder of a package of messages, written on first use."""
    folder = work.folder / name
    if not folder.exists():
        (folder / "msg").mkdir(parents=True)
        manifest = f'<package format="3"><name>{name}</name></package>\n'
        (folder / "package.xml").write_text(manifest, encoding="utf-8")
        for number in range(files):
            (folder / "msg" / f"M{number}.msg").write_text(text(number), encoding="utf-8")
    return folder


def text(number: int) -> str:
    lines = [f"# Message {number}.", "", "uint8 MODE_OFF=0  # nothing runs"]
    lines += [f"float32 value_{line}  # what it is [m/s]" for line in range(LINES - 4)]
    lines += [f"M{number - 1} before"] if number % 8 else ["uint64 timestamp"]
    return "\n".join(lines) + "\n"


def opening(work: Work):
    """Return the candidate that opens a workspace in which one file has a problem."""
    python, _ = place(work)
    folder = package(work, "wide_msgs", 100 if work.quick else 1000)
    wrong = folder / "msg" / "Wrong.msg"
    wrong.write_text("flot64 x\n", encoding="utf-8")

    def open_() -> float:
        client = Client(python, folder)
        client.tell("initialized")
        client.problems(wrong.as_uri())
        taken = client.spent()
        client.end()
        return taken

    return {IDLC: open_}


def session(work: Work) -> tuple[Client, str]:
    """Return a client with a message of a large package open, which has a problem."""
    python, _ = place(work)
    folder = package(work, "large_msgs", LARGE)
    client = Client(python, folder)
    uri = (folder / "msg" / "M100.msg").as_uri()
    item = {"uri": uri, "languageId": "rosmsg", "version": 1, "text": text(100) + "flot64 x\n"}
    client.tell("textDocument/didOpen", textDocument=item)
    client.problems(uri, 1)
    return client, uri


def percentile(times: list[float]) -> float:
    return sorted(times)[math.ceil(len(times) * 0.99) - 1]


def changing(work: Work):
    def change() -> float:
        client, uri = session(work)
        times = []
        for version in range(2, (10 if work.quick else TIMES) + 2):
            place = {"line": LINES, "character": 7 + version % 2}
            begin = client.spent()
            client.tell(
                "textDocument/didChange",
                textDocument={"uri": uri, "version": version},
                contentChanges=[{"range": {"start": place, "end": place}, "text": "y"}],
            )
            client.problems(uri, version)
            times.append(client.spent() - begin)
        client.end()
        return percentile(times)

    return {IDLC: change}


def completing(work: Work):
    def complete() -> float:
        client, uri = session(work)
        times = []
        for version in range(2, (10 if work.quick else TIMES) + 2):
            place = {"line": LINES + 1, "character": 0}
            client.tell(
                "textDocument/didChange",
                textDocument={"uri": uri, "version": version},
                contentChanges=[{"range": {"start": place, "end": place}, "text": "M\n"}],
            )
            client.problems(uri, version)
            begin = client.spent()
            document = {"uri": uri}
            place = {"line": LINES + 1, "character": 1}
            client.ask("textDocument/completion", textDocument=document, position=place)
            times.append(client.spent() - begin)
        client.end()
        return percentile(times)

    return {IDLC: complete}
