"""Each golden/diag/*.txt says what it says; every code has a case and a page with examples.

`IDLC_REFRESH='diag/IDL2*' pytest tests/check/test_golden_diag.py` rewrites the cases that
match, and fails, so that the changes are looked at.
"""

import os
import re
import subprocess
import sys

import pytest

from idlc.cli.main import main
from idlc.diagnostics.codes import CODES
from idlc.diagnostics.explain import page
from tests.support import golden_text, refresh
from tests.support.paths import GOLDEN

FOLDER = GOLDEN / "diag"
CASES = sorted(FOLDER.glob("*.txt"))

#: Codes whose page cannot show how to trigger them: what runs, and what fails, is not in files.
NOT_ON_DEMAND = {"IDL114", "IDL530", "IDL531", "IDL640", "IDL641", "IDL642", "IDL901"}
#: Recordings are no text either.
NOT_ON_DEMAND |= {"IDL652", "IDL653", "IDL654", "IDL655", "IDL656", "IDL661", "IDL662", "IDL663"}


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_golden_case(path, tmp_path, capsys, monkeypatch):
    text = path.read_text(encoding="utf-8")
    case = golden_text.read(text)
    found = golden_text.run(case, tmp_path, capsys, monkeypatch)
    if refresh.wanted(f"diag/{path.stem}"):
        path.write_text(golden_text.write(case, found), encoding="utf-8")
        refresh.refreshed()
    assert golden_text.write(case, found) == text


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_a_second_fix_changes_nothing(path, tmp_path, capsys, monkeypatch):
    case = golden_text.read(path.read_text(encoding="utf-8"))
    case = case._replace(head="$ idlc check . --fix\n")

    def files():
        return {file: file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()}

    golden_text.run(case, tmp_path, capsys, monkeypatch)
    fixed = files()
    assert main(["check", ".", "--fix"]) in (0, 1, 2)
    assert files() == fixed


@pytest.mark.parametrize("code", CODES)
def test_every_code_has_a_case(code):
    named = [path for path in CASES if path.stem.startswith(code)]
    assert any(f"[{code}]" in path.read_text(encoding="utf-8") for path in named)


def parts(code: str, title: str) -> tuple[dict[str, str], list[str]]:
    """Return the files and the commands of a section of a code's page."""
    text = page(code)
    assert text is not None, f"idlc/diagnostics/explain/{code}.md is missing"
    section = text.partition(f"\n## {title}\n")[2].partition("\n## ")[0]
    blocks = dict(re.findall(r"^```(\S+)\n(.*?)^```$", section, re.MULTILINE | re.DOTALL))
    console = blocks.pop("console", "$ idlc check .\n")
    commands = [line[2:] for line in console.splitlines() if line.startswith("$ ")]
    assert blocks or commands
    return blocks, commands


@pytest.fixture
def tried(tmp_path, monkeypatch, capsys):
    """Return what idlc says to the example of a page, as pasted into a shell in an empty folder."""

    def run(code: str, title: str) -> str:
        files, commands = parts(code, title)
        folder = tmp_path / title / "demo"
        # an empty repository ends the search for settings, unless the example makes a real one
        ends = {} if any(line.startswith("git") for line in commands) else {".git/HEAD": ""}
        for path, text in {**ends, **files}.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text, encoding="utf-8")
        monkeypatch.chdir(folder)
        if all(re.fullmatch(r"idlc [\w ./-]+", line) for line in commands):
            for line in commands:
                main(line.split()[1:])
            return "".join(capsys.readouterr())
        idlc = f"idlc() {{ '{sys.executable}' -m idlc \"$@\"; }}"
        done = subprocess.run(
            ["/bin/sh", "-c", "\n".join((idlc, *commands))],
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, "PYTHONUTF8": "1"},
        )
        return done.stdout + done.stderr

    monkeypatch.setattr("idlc.project.prefixes.runs_nodes", lambda: True)
    return run


@pytest.mark.parametrize("code", sorted(set(CODES) - NOT_ON_DEMAND))
def test_every_page_shows_how_to_get_the_code_and_how_to_avoid_it(code, tried):
    bad = tried(code, "Bad")
    assert f"[{code}]" in bad, bad
    good = tried(code, "Good")
    assert f"[{code}]" not in good, good
    assert "error[" not in good, good


@pytest.mark.parametrize("code", CODES)
def test_every_code_is_explained(code, capsys):
    assert main(["explain", code.lower()]) == 0
    text = capsys.readouterr().out
    assert text.startswith(f"# {code} {CODES[code].slug}\n\n")
    assert [line for line in text.splitlines() if line.startswith("## ")] == [
        "## Why",
        "## Bad",
        "## Good",
    ]


def test_no_hint_is_lost():
    """golden/hints.txt has the number of different hints that the cases of each code have."""
    hints = {code: set() for code in CODES}
    for path in CASES:
        code = None
        for line in path.read_text(encoding="utf-8").splitlines():
            problem = re.match(r"(?:error|warning)\[(IDL\d+)\]", line)
            code = problem[1] if problem else code
            if code and (hint := re.match(r" +(?:= hint: )(.*)", line)):
                hints[code].add(re.sub("`[^`]*`", "``", hint[1]))
    counts = "".join(f"{code} {len(words)}\n" for code, words in hints.items())
    record = GOLDEN / "hints.txt"
    if refresh.wanted("hints"):
        record.write_text(counts, encoding="utf-8")
        refresh.refreshed()
    assert counts == record.read_text(encoding="utf-8"), "fewer hints are worse, more go on record"
