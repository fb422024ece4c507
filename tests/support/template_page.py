"""The part of docs/contributing/templates.md that shows templates beside what they write."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jinja2
import pytest
from jinja2.runtime import Macro

from idlc.cli.main import main
from idlc.project.templates import code, environment, html
from idlc.scaffold.init import SERVICES
from tests.support import recorded_text
from tests.support.files import write
from tests.support.paths import DOCS, ROOT

PAGE = DOCS / "contributing" / "templates.md"
TEMPLATES = ROOT / "templates"
_PART = re.compile(r"(?<=<!-- templates -->\n).*?(?=<!-- end -->)", re.DOTALL)

FILES = {
    "demo/package.xml": '<package format="3">\n  <name>demo</name>\n'
    "  <depend>std_msgs</depend>\n</package>\n",
    "demo/msg/Drive.msg": "# How fast to drive.\nfloat64 speed 0.5  # forward [m/s]\n"
    "string[] names\nuint8 FAST=1\n",
    "old/demo/msg/Drive.msg": "float32 speed\n",
    "bare/msg/Level.msg": "uint8 level\n",
    "more/package.xml": '<package format="3">\n  <name>more</name>\n'
    "  <depend>std_msgs</depend>\n</package>\n",
    "more/msg/Stamped.msg": "std_msgs/Header header\n",
    "more/srv/Stop.srv": "bool now\n---\nbool stopped\n",
    "more/action/Turn.action": "float64 angle\n---\n---\nfloat64 left\n",
}
#: Lines of further outputs of one template that are shown.
MOST_LINES = 120
PERSON = ("--maintainer", "Ada", "--email", "ada@example.com")
#: Commands and the folder that each runs in. A template shows what it wrote in the first of them.
COMMANDS = [
    (".", ("gen", "demo", "-o", "out/demo")),
    (".", ("gen", "more", "-o", "out/more", "--vendor-deps")),
    (".", ("gen", "demo", "-o", "light/demo", "--runtime", "installed")),
    (".", ("gen", "demo", "--ament", "prefix")),
    (".", ("gen", "bare", "--package", "bare", "--ament", "prefix")),
    (".", ("docs", "demo", "more", "-o", "site")),
    (".", ("scaffold", "package", "robot", *PERSON)),
    (".", ("scaffold", "package", "--interfaces", "robot_msgs", "Drive", *PERSON)),
    ("robot", ("scaffold", "interface", "msg", "Level", "uint8 level")),
    (
        "robot",
        (
            *("scaffold", "node", "talker", "--publisher", "std_msgs/String:chatter"),
            *("--subscriber", "std_msgs/Bool:stop", "--timer", "2.0", "--param", "gain:float=1.0"),
        ),
    ),
    (
        "robot",
        (
            *("scaffold", "node", "server", "--service", "std_srvs/SetBool:power"),
            *("--action-server", "example_interfaces/Fibonacci:count"),
        ),
    ),
    (
        "robot",
        (
            *("scaffold", "node", "asker", "--client", "std_srvs/SetBool:power"),
            *("--action-client", "example_interfaces/Fibonacci:count"),
        ),
    ),
    (
        "robot",
        (
            *("scaffold", "node", "managed", "--lifecycle", "--timer", "1.0"),
            *("--action-client", "example_interfaces/Fibonacci:count"),
        ),
    ),
    (".", ("upgrade", "rec.mcap", "--to", "bare", "--write-rules", "bare/upgrade")),
    (
        "robot",
        (
            *("scaffold", "node", "bridge", "--translate", "../old/demo", "../demo"),
            *("--topic", "demo/Drive:drive:drive_v2"),
        ),
    ),
    *[("robot", ("init", "--ci", service, "--yes")) for service in SERVICES],
]


def written(text: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return the page with its generated part made anew; commands run in an empty folder."""
    outputs = _outputs(folder, monkeypatch)
    sections = "\n".join(line for path in _names() for line in _section(path, outputs))
    text, count = _PART.subn(lambda _: f"\n{sections}\n", text)
    assert count == 1
    return text


def _names() -> list[str]:
    """Return the names of all files of templates, in the order of the page."""
    paths = (path for path in TEMPLATES.rglob("*") if path.is_file())
    return sorted(path.relative_to(TEMPLATES).as_posix() for path in paths)


def _outputs(folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, dict[int, list[str]]]:
    """Return the texts that each template wrote, by the number of the command."""
    outputs: dict[str, dict[int, list[str]]] = {}
    started: list[tuple[str, ...]] = []

    def note(name: str, text: str) -> None:
        text = text.replace(str(folder), "/ws")
        texts = outputs.setdefault(name, {}).setdefault(len(started) - 1, [])
        if text.strip() and text not in texts:
            texts.append(text)

    _record(note, monkeypatch)
    # the page is one, whether ROS 2 with its comments is installed or not
    monkeypatch.setattr("sys.prefix", str(folder / "nowhere"))
    for path, text in FILES.items():
        write(folder / path, text)
    recorded_text.write(folder / "rec.mcap", "@ /level bare/msg/Level\nuint8 height\n")
    for place, words in COMMANDS:
        started.append(words)
        monkeypatch.chdir(folder / place)
        assert main(list(words)) == 0, words
    return outputs


def _record(note: Callable[[str, str], None], monkeypatch: pytest.MonkeyPatch) -> None:
    """Have templates, and the macros of templates, note what they write."""
    for each in (environment(), code(), html()):
        for name in each.list_templates(extensions=["jinja"]):
            template = each.get_template(name)
            monkeypatch.setattr(template, "root_render_func", _noting(name, template, note))
    invoke = Macro._invoke

    def noting(self: Macro, arguments: list[Any], autoescape: bool) -> str:
        text = invoke(self, arguments, autoescape)
        path = Path(self._func.__code__.co_filename)
        note(path.relative_to(TEMPLATES).as_posix(), str(text))
        return text

    monkeypatch.setattr(Macro, "_invoke", noting)


def _noting(
    name: str, template: jinja2.Template, note: Callable[[str, str], None]
) -> Callable[[jinja2.runtime.Context], Iterator[str]]:
    render = template.root_render_func

    def noting(context: jinja2.runtime.Context) -> Iterator[str]:
        parts = list(render(context))
        note(name, "".join(parts))
        yield from parts

    return noting


def _section(name: str, outputs: dict[str, dict[int, list[str]]]) -> Iterator[str]:
    text = (TEMPLATES / name).read_text(encoding="utf-8")
    yield f"### {name}"
    yield ""
    commands = {number: texts for number, texts in outputs.get(name, {}).items() if texts}
    if not name.endswith(".jinja") or commands == {} or commands[min(commands)] == [text]:
        assert "{{" not in text, f"no command writes {name}"
        yield "It is written as it is:"
        yield ""
        yield from _block(_language(name), text)
        return
    number = min(commands)
    yield from _block("jinja", text)
    yield f"`idlc {' '.join(COMMANDS[number][1])}` writes:"
    yield ""
    lines = 0
    for output in commands[number]:
        lines += output.count("\n") + 1
        if lines <= MOST_LINES or output is commands[number][0]:
            yield from _block(_language(name.removesuffix(".jinja")), output)


def _language(name: str) -> str:
    return {"py": "python", "md": "markdown", "txt": "cmake"}.get(name.rpartition(".")[2], "text")


def _block(language: str, text: str) -> Iterator[str]:
    yield f"````{language}"
    yield text.strip("\n")
    yield "````"
    yield ""
