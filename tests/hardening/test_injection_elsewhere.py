"""Hostile text in what is shown, compared and documented, on a terminal, and in the action."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from idlc.cli.run import gen
from tests.hardening.test_injection import FILE_NAMES, PLACES, colourful
from tests.support.hostile import PAYLOADS, assert_harmless, assert_untouched, on_a_terminal, run
from tests.support.paths import ROOT
from tests.support.rounds import FUZZING
from tests.tasks.test_docs import Page

__all__ = ["colourful"]  # a fixture
SHELL = shutil.which("sh") or "sh"
#: Elements of pages, and the attributes that they may have.
ELEMENTS = {
    *("html", "head", "meta", "title", "link", "body", "header", "main", "script", "a", "label"),
    *("span", "input", "ol", "ul", "li", "p", "pre", "code", "small", "h1", "h2", "h3", "div"),
    *("table", "thead", "tbody", "tr", "th", "td", "svg", "rect", "path", "text", "defs", "marker"),
    *("details", "summary", "strong", "em", "br", "nav", "section", "g"),
}


@pytest.fixture(scope="module")
def accepted(tmp_path_factory):
    """A folder with each payload where it is accepted, in packages `old` and `new`."""
    folder = tmp_path_factory.mktemp("accepted")
    (folder / ".git").mkdir()
    for version in ("old", "new"):
        (folder / version / "msg").mkdir(parents=True)
    for place, text in PLACES.items():
        for payload, attack in PAYLOADS.items():
            number = list(PLACES).index(place) * 1000 + list(PAYLOADS).index(payload)
            for version, word in (("old", "x"), ("new", attack)):
                path = folder / version / "msg" / f"A{number}.msg"
                path.write_text(text.replace("{}", word), encoding="utf-8")
    for line in run(["check", "new", "--format", "json"], folder).stdout.splitlines():
        found = json.loads(line)
        if found.get("severity") == "error":
            for version in ("old", "new"):
                (folder / version / "msg" / Path(found["path"]).name).unlink(missing_ok=True)
    assert len(list((folder / "new/msg").iterdir())) > len(PLACES) * len(PAYLOADS) / 2
    return folder


@pytest.mark.parametrize("style", ["text", "json", "jsonschema"])
def test_what_is_shown(style, accepted):
    for path in sorted((accepted / "new/msg").iterdir()):
        words = ["show", f"new/msg/{path.name}", "--package", "demo", "--format", style]
        said = run(words, accepted)
        assert said.status == 0
        assert_harmless(said.stdout + said.stderr)
        assert style == "text" or json.loads(said.stdout)
    assert_untouched(accepted)


@pytest.mark.parametrize("style", ["text", "ros2idl", "mcap"])
def test_what_is_shown_on_a_terminal(style, tmp_path):
    text = "".join(f"# {attack}\nint8 a{n}\n" for n, attack in enumerate(PAYLOADS.values()))
    (tmp_path / "A.msg").write_text(text.replace("\\", "/"), encoding="utf-8")
    said = on_a_terminal(["show", "A.msg", "--package", "demo", "--format", style], tmp_path)
    assert "forged" in said
    assert_harmless(said)


@pytest.mark.parametrize("against", ["old", "new"])
@pytest.mark.parametrize("style", ["text", "json", "github", "gitlab", "sarif", "junit"])
def test_what_is_compared(style, against, accepted):
    versions = [against, *({"old", "new"} - {against})]
    said = run(
        ["breaking", versions[1], "--against", versions[0], "--package", "demo", "--format", style],
        accepted,
    )
    assert said.status == 1
    lines = said.stdout.splitlines()
    if style == "github":
        assert len(lines) > 100
        assert re.match(
            r"::notice title=idlc breaking::\d+ breaking changes \([^:]+: [^:]+$", lines.pop()
        )
        assert all(
            re.match(r"::(error|warning|notice) file=\w+/msg/A\d+\.msg,", one) for one in lines
        )
        lines = [line.lstrip(":") for line in lines]
    assert_harmless("\n".join(lines) + said.stderr)
    if style == "json":
        assert {json.loads(line)["type"] for line in lines} <= {"change", "diagnostic", "summary"}
    assert_untouched(accepted)


def test_what_is_documented(accepted):
    assert run(["docs", "new", "-o", "site", "--package", "demo"], accepted).status == 0
    pages = list((accepted / "site").rglob("*.html"))
    assert len(pages) > 100
    for path in pages:
        text = path.read_text(encoding="utf-8")
        page = Page(text)
        assert {tag for tag, _ in page.tags} <= ELEMENTS
        for tag, attributes in page.tags:
            assert not [name for name in attributes if name.startswith("on")]
            assert (tag != "script") or re.fullmatch(
                r"(\.\./)?(index|search)\.js", attributes["src"]
            )
        for link in page.links:
            assert re.fullmatch(r"(\.\./)?[\w/.-]*(#[\w.-]+)?", link), link
    index = (accepted / "site/index.js").read_text(encoding="utf-8")
    assert index.isascii()
    assert json.loads(index.partition("=")[2].strip().removesuffix(";"))
    assert_untouched(accepted)


def test_names_while_watching(tmp_path, monkeypatch):
    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(gen.time, "sleep", interrupted)
    for number, name in enumerate(FILE_NAMES.values()):
        here = tmp_path / str(number)
        (here / name / "msg").mkdir(parents=True)
        (here / name / "msg/A.msg").write_text("int8 a\n", encoding="utf-8")
        said = run(["gen", f"./{name}", "-o", "out/demo", "--package", "demo", "--watch"], here)
        assert "watching" in said.stderr
        assert_harmless(said.stdout + said.stderr)


@pytest.mark.long
def test_the_actions_script_obeys_no_name(tmp_path):
    commands = tmp_path / "bin"
    commands.mkdir()
    for name, words in (("idlc", f'"{sys.executable}" -m idlc'), ("python", f'"{sys.executable}"')):
        (commands / name).write_text(f'#!/bin/sh\nexec {words} "$@"\n')
        (commands / name).chmod(0o755)
    for number, name in enumerate(FILE_NAMES.values()):
        here = tmp_path / "here" / str(number)
        (here / "pkg" / name / "msg").mkdir(parents=True)
        (here / "pkg" / name / "msg/A.msg").write_text("int8   a\n", encoding="utf-8")
        (here / "event.json").write_text(
            json.dumps({"pull_request": {"title": name, "base": {"sha": name}}}), encoding="utf-8"
        )
    environment = {
        **{k: v for k, v in os.environ.items() if not k.startswith(("GITHUB_", "IDLC_", "GIT_"))},
        "PATH": f"{commands}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "PYTHONUTF8": "1",
    }
    for number in list(range(len(FILE_NAMES)))[:: 1 if FUZZING else 6]:
        here = tmp_path / "here" / str(number)
        name = list(FILE_NAMES.values())[number]
        for paths in (".", "$(touch CANARY) ; touch CANARY"):
            subprocess.run(
                [SHELL, str(ROOT / ".ci/action")],
                cwd=here,
                env={
                    **environment,
                    "IDLC_PATHS": paths,
                    "IDLC_SARIF": "out.sarif",
                    "GITHUB_EVENT_PATH": str(here / "event.json"),
                    "GITHUB_OUTPUT": str(here / "output"),
                },
                capture_output=True,
                check=False,
            )
        assert (here / "output").read_text(encoding="utf-8") == "sarif=out.sarif\n" * 2, name
        assert_untouched(here)
