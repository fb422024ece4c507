"""docs/contributing/: each page's steps, done in a copy of the project, lead to what works.

A step names a file. A block of `diff` edits it, any other block is its whole text, and `console`
shows commands and lines that they print.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from tests.support.paths import DOCS, ROOT

PAGES = DOCS / "contributing"
COPIED = ("idlc", "templates", "tests", "docs", "golden/diag", "golden/gen", "examples")
#: What `make test` looks at here: the whole suite takes minutes.
TESTS = ("rules", "golden_diag", "check", "command_line")


@pytest.fixture
def copy(tmp_path):
    ignored = shutil.ignore_patterns("__pycache__", "*.jpg", "corpus", "ros")
    for name in COPIED:
        shutil.copytree(ROOT / name, tmp_path / name, ignore=ignored)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def blocks(page: str):
    """Yield the file that a step is about, a block's language and the block, in order."""
    path = ""
    pattern = r"^\d+\. (?:`([\w/.-]+)`)?|^   (`{3,})(\w+)\n(.*?)^   \2$"
    for found in re.finditer(pattern, page, re.MULTILINE | re.DOTALL):
        if found[2]:
            yield path, found[3], textwrap.dedent(found[4])
        else:
            path = found[1] or ""


def place(copy: Path, path: str) -> Path:
    """Return where a file is; tests have moved before."""
    whole = copy / path
    return whole if whole.exists() else next(copy.glob(f"tests/**/{whole.name}"), whole)


def edited(text: str, diff: str) -> str:
    lines = diff.splitlines()
    old = "".join(f"{line[1:]}\n" for line in lines if not line.startswith("+"))
    new = "".join(f"{line[1:]}\n" for line in lines if not line.startswith("-"))
    assert f"\n{text}".count(f"\n{old}") == 1, f"not there, or not once:\n{old}"
    return f"\n{text}".replace(f"\n{old}", f"\n{new}")[1:]


def run(copy: Path, command: str) -> str:
    words = shlex.split(command)
    if words[:2] == ["make", "test"]:
        files = [str(path) for name in TESTS for path in copy.glob(f"tests/**/test_{name}.py")]
        chosen = shlex.split(words[2].removeprefix("ARGS="))
        command = shlex.join(["python", "-m", "pytest", "-q", "-x", *chosen, *files])
    script = (
        f"idlc() {{ '{sys.executable}' -m idlc \"$@\"; }}\n"
        f"python() {{ '{sys.executable}' \"$@\"; }}\n"
        f"set -e\n{command}\n"
    )
    first = {"PYTHONPATH": str(copy), "PYTHONUTF8": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        ["/bin/sh", "-c", script],
        cwd=copy,
        env={**os.environ, **first},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.mark.long
@pytest.mark.parametrize("name", ["a rule", "a command"])
def test_the_steps_lead_to_what_works(name, copy):
    text = (PAGES / "add.md").read_text(encoding="utf-8")
    page = text.partition(f"## Add {name}\n")[2].partition("\n## ")[0]
    kinds = []
    for path, language, block in blocks(page):
        kinds.append(language)
        if language == "diff":
            file = place(copy, path)
            file.write_text(edited(file.read_text(encoding="utf-8"), block), encoding="utf-8")
        elif language == "console":
            said = ""
            for line in block.splitlines():
                if line.startswith("$ "):
                    said = run(copy, line[2:])
                else:
                    assert f"{line}\n" in said
        else:
            assert path
            assert not (copy / path).exists()
            (copy / path).write_text(block, encoding="utf-8")
    assert kinds[-1] == "console"
    assert len(kinds) > 2


def test_every_file_that_is_named_is_there():
    for page in (*PAGES.glob("*.md"), ROOT / "CONTRIBUTING.md"):
        text = page.read_text(encoding="utf-8")
        made = {path for path, language, _ in blocks(text) if language not in ("diff", "console")}
        for path in set(re.findall(r"`((?:idlc|tests|golden|docs|templates)/[\w/.-]+)`", text)):
            assert path in made or place(ROOT, path).exists(), f"{page.name}: {path}"
        for link in re.findall(r"\]\(([^)#:]+)\)", text):
            assert (page.parent / link).exists(), f"{page.name}: {link}"
