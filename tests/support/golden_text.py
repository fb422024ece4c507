"""Golden text cases: what was typed, the files there were, and what idlc said, in one file.

A case begins with command lines (`$ idlc check in`), run one after the other. Then come sections,
`-- path --` with a file's content, and the expected `-- stdout --`, `-- stderr --` and
`-- exit --` of the last command (outputs are those of all commands together). A missing section
expects nothing, and status 0. Besides idlc there are a few commands that make what text cannot:

    hex PATH DIGITS     a file of these bytes         size PATH N        a file of N zero bytes
    append PATH TEXT    a line more in a file         remove PATH        one file less
    fifo PATH           a named pipe                  link PATH TARGET   a symbolic link
    break STAGE         let a stage of idlc fail      list DIR           print the files in DIR
    graph [PATH]        let idlc see the nodes of a file, or have no rclpy
    record PATH TEXT    an MCAP file of what a text says (recorded_text.py)
"""

from __future__ import annotations

import os
import re
import shlex
from pathlib import Path
from typing import NamedTuple

from idlc.cli.main import main
from idlc.version import __version__
from tests.support import recorded_text
from tests.support.recorded_graph import RecordedGraph, end, take_the_place

EXPECTED = ("stdout", "stderr", "exit")
_SECTION = re.compile(r"^-- (.+) --\n", re.MULTILINE)

#: What `break` replaces by a function that fails.
STAGES = {
    "parse": "idlc.language.parse.parse",
    "link": "idlc.model.link.link",
    "check": "idlc.compiler.verdicts.check",
    "render": "idlc.generate.python.render.render_package",
}


class Case(NamedTuple):
    """One case; `head` holds its command lines and comments."""

    head: str
    sections: dict[str, str]

    @property
    def commands(self) -> list[list[str]]:
        lines = (line[2:] for line in self.head.splitlines() if line.startswith("$ "))
        return [shlex.split(line) for line in lines]

    @property
    def files(self) -> dict[str, str]:
        return {path: text for path, text in self.sections.items() if path not in EXPECTED}


def read(text: str) -> Case:
    head, *rest = _SECTION.split(text)
    return Case(head, dict(zip(rest[::2], rest[1::2], strict=True)))


def write(case: Case, found: dict[str, str]) -> str:
    """Return the text of a case with what was found as what is expected."""
    sections = {**case.files, **{name: found[name] for name in EXPECTED if found[name]}}
    return case.head + "".join(f"-- {name} --\n{text}" for name, text in sections.items())


def only_rclpy(package: str) -> list[Path]:
    """Stand for a Python in which nodes run and no interfaces are installed."""
    return [Path("/nowhere")] if package == "rclpy" else []


def run(case: Case, folder: Path, capsys, monkeypatch) -> dict[str, str]:
    """Return what each expected section should hold, made independent of idlc's version."""
    monkeypatch.chdir(folder)
    monkeypatch.setattr("idlc.project.prefixes.ament_prefixes", lambda: ())
    monkeypatch.delenv("ROS_DISTRO", raising=False)
    monkeypatch.setattr("idlc.project.prefixes.python_folders", only_rclpy)
    for path, text in case.files.items():
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8", newline="")
    status = 0
    for name, *words in case.commands:
        if name == "idlc":
            status = main(words)
        elif name == "break":
            monkeypatch.setattr(STAGES[words[0]], _fail)
        elif name == "graph":
            take_the_place(monkeypatch, _graph(words[0]) if words else None)
        else:
            _PREPARATIONS[name](*words)
    out, err = capsys.readouterr()
    found = {"stdout": out, "stderr": err, "exit": f"{status}\n" if status else ""}
    return {name: _normal(text) for name, text in found.items()}


def _normal(text: str) -> str:
    """Return an output without what changes with idlc itself: its version, its support files."""
    return re.sub(r": \d+ files from", ": <n> files from", text.replace(__version__, "<version>"))


def _graph(path: str) -> RecordedGraph:
    """Return the graph of a file with a line for each end: node, role, name, type, hash."""
    lines = Path(path).read_text(encoding="utf-8").splitlines()
    return RecordedGraph(end(*line.split()) for line in lines)


def _fail(*_, **__):
    raise ZeroDivisionError("as the case asked for")


def _hex(path: str, digits: str) -> None:
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    Path(path).write_bytes(bytes.fromhex(digits))


def _size(path: str, number: str) -> None:
    _hex(path, "")
    os.truncate(path, int(number))


def _append(path: str, text: str) -> None:
    with Path(path).open("a", encoding="utf-8") as file:
        file.write(text + "\n")


def _fifo(path: str) -> None:
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    os.mkfifo(path)


def _record(path: str, text: str) -> None:
    recorded_text.write(path, Path(text).read_text(encoding="utf-8"))


def _list(folder: str) -> None:
    for path in sorted(path.as_posix() for path in Path(folder).rglob("*") if path.is_file()):
        print(path)


_PREPARATIONS = {
    "hex": _hex,
    "size": _size,
    "append": _append,
    "fifo": _fifo,
    "remove": lambda path: Path(path).unlink(),
    "link": lambda path, target: Path(path).symlink_to(target),
    "list": _list,
    "record": _record,
}
