"""Text that means harm, and what shows whether it did any."""

from __future__ import annotations

import contextlib
import io
import os
import pty
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from idlc.cli.main import main
from tests.support.paths import ROOT

#: What every payload that gets to run leaves behind, in the folder that it runs in.
CANARY = "CANARY"

#: Payloads by what they try to break out of. None has a line end, which ends every construct of
#: the language anyway; `OTHER_LINE_ENDS` has those that are none to most programs.
PAYLOADS = {
    "docstring": f'"""; open("{CANARY}", "w"); """',
    "docstring, single quotes": f"'''; open('{CANARY}', 'w'); '''",
    "docstring after a backslash": f'\\"""; open("{CANARY}", "w"); \\"""',
    "string": f'" + str(open("{CANARY}", "w")) + "',
    "string, single quotes": f"' + str(open('{CANARY}', 'w')) + '",
    "bytes": f"b'\\x00' + open('{CANARY}', 'w')",
    "call": f"), open('{CANARY}', 'w'), (",
    "dictionary": f'": 0, open("{CANARY}", "w"): "',
    "formatted string": f"{{open('{CANARY}', 'w')}}",
    "old formatting": "%(x)s %s %n {0.__class__} {} {x!r:>999999999}",
    "import": f"__import__('os').system('touch {CANARY}')",
    "coding cookie": f"-*- coding: utf-7 -*- +AAo-open('{CANARY}', 'w')",
    "pragma": "type: ignore mypy: ignore-errors ruff: noqa fmt: off pyright: basic",
    "jinja expression": "{{ ''.__class__.__mro__[1].__subclasses__() }} {{ 7 * 191 }}",
    "jinja statement": "{% for x in range(9) %}forged{% endfor %}{% include '/etc/passwd' %}",
    "jinja comment": "{# hidden #} {% raw %} #} {{ self }}",
    "jinja line statement": "%% for x in y ## z",
    "shell": "$(touch CANARY) `touch CANARY` ; touch CANARY ; | touch CANARY && touch CANARY",
    "option": "--help -rf --output=CANARY",
    "c string": f'"; system("touch {CANARY}"); //',
    "c format": "%s%s%s%n%99999999d",
    "c trigraph": "??/ ??' ??>",
    "c comment": "*/ /* // */",
    "xml": "]]></x><!ENTITY x SYSTEM 'file:///etc/passwd'>&x;<x a='\"'>--><!--",
    "html": "<script>alert(1)</script><img src=x onerror=alert(1)>&lt;&amp;",
    "github": "::error file=app.py,line=1::forged",
    "github, encoded": "%0A::set-output name=x::forged%0D%0A",
    "github, old": "##[error]forged",
    "json": '"}, {"code": "IDL999", "forged": true, "x": "',
    "terminal colour": "\x1b[31mforged\x1b[0m",
    "terminal title": "\x1b]0;forged\x07",
    "terminal clear": "\x1b[2J\x1b[H\x1bc",
    "terminal, 8 bit": "\x9b31m\x9d0;forged\x9c",
    "terminal backspace": "\x08\x08\x08\x08forged\x7f",
    "shift out": "\x0e\x0f\x1a\x16",
    "right to left": "\u202eforged\u202c \u2066x\u2069 \u200f",
    "invisible": "a\u200bb\u00adc\ufeffd\u2060e\U000e0041",
    "private": "\ue000\U0010fffd\ufdd0\uffff",
    "combining": "a" + "\u0301" * 50,
    "nul": "a\0b",
    "unicode escape": "\\u000aopen('CANARY','w') \\N{BULLET}",
    "octal escape": "\\101\\012open('CANARY','w')",
    "backslash": "\\",
    "backslashes": "\\\\ \\\\\\ x\\",
    "quotes": "\"'\"'\"\"\"'''",
    "closing quote": 'x"',
    "closing quotes": 'x""',
    "path": "../../../../etc/passwd",
    "windows path": "C:\\Windows\\system32 \\\\host\\share CON NUL",
    "surrogates": "\U0001f600\U00010000",
}
OTHER_LINE_ENDS = "\x0b\x0c\x1c\x1d\x1e\x85\u2028\u2029"

_SGR = re.compile(r"\x1b\[(0|1|2|31|32|33|36|94|1;31|1;33|1;36)m")


class Said(NamedTuple):
    """What a command printed, and its exit status."""

    status: int
    stdout: str
    stderr: str


def run(words, folder: Path) -> Said:
    """Run idlc in a folder, with colours, and return what it said."""
    out, err = io.StringIO(), io.StringIO()
    before = Path.cwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = main(words)
    finally:
        os.chdir(before)
    assert status in (0, 1, 2), err.getvalue()
    return Said(status, out.getvalue(), err.getvalue())


def on_a_terminal(words, folder: Path) -> str:
    """Run idlc in a folder and return all that a terminal was sent."""
    parent, child = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-m", "idlc", *words],
        cwd=folder,
        env={**os.environ, "PYTHONUTF8": "1", "PYTHONPATH": str(ROOT)},
        stdout=child,
        stderr=child,
    ):
        os.close(child)
        said = b""
        with contextlib.suppress(OSError):  # raised when the other side is closed
            while data := os.read(parent, 1 << 16):
                said += data
    os.close(parent)
    return said.decode().replace("\r\n", "\n")


def assert_harmless(text: str) -> None:
    """Nothing in what idlc printed moves a cursor, hides or starts what a CI system obeys."""
    plain = _SGR.sub("", text)
    bad = {
        f"U+{ord(c):04X}"
        for c in plain
        if c != "\n" and not (c.isprintable() or c in "\U0001f600\U00010000")
    }
    assert not bad, plain
    for line in plain.splitlines():
        assert not line.startswith(("::", "##[", "forged")), plain


def assert_untouched(*folders: Path) -> None:
    """No payload has run."""
    for folder in folders:
        assert not [path for path in folder.rglob("*") if path.name == CANARY], folder
