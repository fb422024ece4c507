"""The page of templates: each file in templates/, beside what commands write by it."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any
from unittest import mock

import jinja2
from jinja2.runtime import Macro

from idlc.cli.main import main
from idlc.generate.templates import code, environment, html
from idlc.recordings.containers.mcap_writer import ChunkWriter, channel, schema
from idlc.recordings.containers.records import CHANNEL_OP, SCHEMA_OP
from idlc.scaffold.init import SERVICES
from maintenance.website.sources import ROOT

PLACE = "contributing/templates.md"
TEMPLATES = ROOT / "templates"
_HEAD = """\
# Templates

This page shows every file in `templates/` with an output. Python computes and escapes the values;
the template places them. The page [Style](style.md) lists what a template may contain. For a part
of other templates, the page shows the first outputs of the part. `make site` writes this page.

The outputs are for these interfaces:

"""
_LEVEL = "uint8 height\n"
_FILES = {
    "demo/package.xml": '<package format="3">\n  <name>demo</name>\n'
    "  <depend>std_msgs</depend>\n</package>\n",
    "demo/msg/Drive.msg": "# How fast to drive.\nfloat64 speed 0.5  # forward [m/s]\n"
    "string[] names\nuint8 FAST=1\n",
    "bare/msg/Level.msg": "uint8 level\n",
    "more/package.xml": '<package format="3">\n  <name>more</name>\n'
    "  <depend>std_msgs</depend>\n</package>\n",
    "more/msg/Stamped.msg": "std_msgs/Header header\n",
    "more/srv/Stop.srv": "bool now\n---\nbool stopped\n",
    "light/pyproject.toml": '[tool.idlc]\nruntime = "installed"\n',
    "more/action/Turn.action": "float64 angle\n---\n---\nfloat64 left\n",
}
#: Lines of further outputs of one template that are shown.
_MOST_LINES = 120
_PERSON = ("--maintainer", "Ada <ada@example.com>")
#: Commands and the folder that each runs in. A template shows what it wrote in the first of them.
_COMMANDS = [
    (".", ("gen", "demo", "-o", "out/demo")),
    (".", ("gen", "more", "-o", "out/more", "--vendor-deps")),
    ("light", ("gen", "../demo", "-o", "demo")),
    (".", ("gen", "demo", "--ament", "prefix")),
    (".", ("gen", "bare", "--package", "bare", "--ament", "prefix")),
    (".", ("docs", "demo", "more", "-o", "site")),
    (".", ("scaffold", "package", "robot", *_PERSON)),
    (".", ("scaffold", "package", "--interfaces", "robot_msgs", "Drive", *_PERSON)),
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
    ("robot", ("scaffold", "node", "caller", "--client", "std_srvs/SetBool:power")),
    (
        "robot",
        ("scaffold", "node", "sender", "--action-client", "example_interfaces/Fibonacci:count"),
    ),
    (
        "robot",
        (
            *("scaffold", "node", "careful", "--robust", "--publisher", "std_msgs/String:chatter"),
            *("--subscriber", "std_msgs/Bool:stop", "--service", "std_srvs/SetBool:power"),
            *("--action-server", "example_interfaces/Fibonacci:count", "--param", "gain:float=1.0"),
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
    *[("robot", ("init", "--ci", service, "--yes")) for service in SERVICES],
]


def page() -> bytes:
    """Return the page; the commands run in an empty folder."""
    interfaces = "\n".join(
        f"# {path}\n{text}" for path, text in _FILES.items() if not path.endswith(".xml")
    )
    outputs = _outputs()
    sections = "\n".join(line for path in names() for line in _section(path, outputs))
    return f"{_HEAD}```text\n{interfaces}```\n\n## The templates\n\n{sections}".encode()


def names() -> list[str]:
    """Return the names of all files of templates, in the order of the page."""
    paths = (path for path in TEMPLATES.rglob("*") if path.is_file())
    return sorted(path.relative_to(TEMPLATES).as_posix() for path in paths)


def _outputs() -> dict[str, dict[int, list[str]]]:
    """Return the texts that each template wrote, by the number of the command."""
    outputs: dict[str, dict[int, list[str]]] = {}
    started: list[tuple[str, ...]] = []
    with ExitStack() as undo:
        folder = Path(undo.enter_context(tempfile.TemporaryDirectory())).resolve()

        def note(name: str, text: str) -> None:
            text = text.replace(str(folder), "/ws")
            texts = outputs.setdefault(name, {}).setdefault(len(started) - 1, [])
            if text.strip() and text not in texts:
                texts.append(text)

        _record(note, undo)
        # the page is one, whether ROS 2 with its comments is installed or not
        undo.enter_context(mock.patch.dict(os.environ, AMENT_PREFIX_PATH=""))
        undo.enter_context(mock.patch.object(sys, "prefix", str(folder / "nowhere")))
        undo.callback(os.chdir, Path.cwd())
        for path, text in _FILES.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text, encoding="utf-8")
        _write_recording(folder / "rec.mcap")
        for place, words in _COMMANDS:
            started.append(words)
            os.chdir(folder / place)
            with redirect_stdout(StringIO()):
                failed = main(list(words))
            if failed:
                raise SystemExit(f"idlc {' '.join(words)} failed, see above")
    return outputs


def _write_recording(path: Path) -> None:
    with path.open("wb") as file:
        writer = ChunkWriter(file)
        writer.append(SCHEMA_OP, schema(1, "bare/msg/Level", "ros2msg", _LEVEL))
        writer.append(CHANNEL_OP, channel(1, 1, b"/level", b"cdr", {}))
        writer.close()


def _record(note: Callable[[str, str], None], undo: ExitStack) -> None:
    """Have templates, and the macros of templates, note what they write."""
    for each in (environment(), code(), html()):
        for name in each.list_templates(extensions=["jinja"]):
            template = each.get_template(name)
            noting = _noting(name, template, note)
            undo.enter_context(mock.patch.object(template, "root_render_func", noting))
    invoke = Macro._invoke  # noqa: SLF001 (what each call of a macro goes through)

    def noting_macro(self: Macro, arguments: list[Any], autoescape: bool) -> str:
        text = invoke(self, arguments, autoescape)
        path = Path(self._func.__code__.co_filename)
        note(path.relative_to(TEMPLATES).as_posix(), str(text))
        return text

    undo.enter_context(mock.patch.object(Macro, "_invoke", noting_macro))


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
        if "{{" in text:
            raise SystemExit(f"no command in {__name__} writes {name}")
        yield "It is written as it is:"
        yield ""
        yield from _block(_language(name), text)
        return
    number = min(commands)
    yield from _block("jinja", text)
    yield f"`idlc {' '.join(_COMMANDS[number][1])}` writes:"
    yield ""
    lines = 0
    for output in commands[number]:
        lines += output.count("\n") + 1
        if lines <= _MOST_LINES or output is commands[number][0]:
            yield from _block(_language(name.removesuffix(".jinja")), output)


def _language(name: str) -> str:
    return {"py": "python", "md": "markdown", "txt": "cmake"}.get(name.rpartition(".")[2], "text")


def _block(language: str, text: str) -> Iterator[str]:
    yield f"````{language}"
    yield text.strip("\n")
    yield "````"
    yield ""
