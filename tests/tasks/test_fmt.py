"""`idlc fmt` and the user's files."""

import os
import random
import stat

import pytest

from idlc.cli.main import main
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.language.definition import parse_definition
from idlc.language.parse import parse
from idlc.language.tree import Constant, Fault
from idlc.model.ir import TypeName
from idlc.tasks.fmt import laid_out

LOOSE = "float64   speed# [m/s]"
TIDY = "float64 speed  # [m/s]\n"


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "msg").mkdir()
    return tmp_path / "msg"


def test_a_file_is_replaced_as_a_whole_and_keeps_its_mode(here):
    file = here / "A.msg"
    file.write_text(LOOSE)
    file.chmod(0o640)
    before = file.stat().st_ino
    assert main(["fmt"]) == 0
    assert file.read_text() == TIDY
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
    assert file.stat().st_ino != before, "written in place: a reader could see half of it"
    assert [path.name for path in here.iterdir()] == ["A.msg"]


def test_what_is_in_order_is_not_touched(here):
    file = here / "A.msg"
    file.write_text(TIDY)
    os.utime(file, (1, 1))
    assert main(["fmt", "."]) == 0
    assert file.stat().st_mtime == 1


@pytest.mark.parametrize("option", ["--check", "--diff"])
def test_looking_changes_nothing(here, option, capsys):
    file = here / "A.msg"
    file.write_text(LOOSE)
    assert main(["fmt", option]) == 1
    assert file.read_text() == LOOSE
    assert "msg/A.msg" in capsys.readouterr().out


def test_a_link_stays_a_link(here, tmp_path):
    (tmp_path / "real.txt").write_text(LOOSE)
    (here / "A.msg").symlink_to("../real.txt")
    assert main(["fmt"]) == 0
    assert (here / "A.msg").is_symlink()
    assert (tmp_path / "real.txt").read_text() == TIDY


def test_files_with_errors_and_line_ends_stay(here, capsys):
    broken = b"float64   a\r\nint8\r\n"
    (here / "Broken.msg").write_bytes(broken)
    (here / "Dos.msg").write_bytes(b"int8   a\r\nint8 b")
    assert main(["fmt"]) == 1
    assert (here / "Broken.msg").read_bytes() == broken
    assert (here / "Dos.msg").read_bytes() == b"int8 a\r\nint8 b\r\n"
    assert "1 file with errors skipped" in capsys.readouterr().out


def test_files_with_other_errors_are_laid_out(here, capsys):
    (here / "A.msg").write_text("flot64   a\nuint8 b   300\n")
    (here / "Broken.msg").write_text("flot64   b\nint8\n")
    assert main(["fmt"]) == 1
    assert (here / "A.msg").read_text() == "flot64 a\nuint8 b 300\n"
    said = capsys.readouterr()
    assert "IDL101" in said.err
    assert "IDL201" not in said.err  # of which `idlc check` tells


WRONG = [
    *("flot64 x", "uint8  x 300", "uint8 x   1.5", 'string<=2   s "a  b"', "uint8[2] a  [1,  2,3]"),
    *("int8 x", "int8   X", "float32  A=1", "demo/X  y", "string s 'a   b", 'string  T = "a  # b"'),
    *("uint8 A =  300", "bool b   yes", "Drive   d 1", "string<=x  s", "uint8[<=0] a", "int8  __a"),
]


@pytest.mark.parametrize("seed", range(40))
def test_a_layout_with_errors_keeps_every_word(seed):
    choose = random.Random(seed)
    comments = ("", "# [m]", "   #  a  b", " # 'x  y'")
    text = "".join(
        f"{choose.choice(WRONG)}{choose.choice(comments)}\n{chr(10) * choose.choice([0, 0, 3])}"
        for _ in range(choose.randrange(1, 8))
    )
    name = TypeName("demo", "msg", "A")
    new = laid_out(Source("A.msg", text), name, Report())
    if new is None:
        return
    assert _definitions(new) == _definitions(text)
    assert laid_out(Source("A.msg", new), name, Report()) == new


def _definitions(text):
    """Return the words and comments of a text as they are written."""
    found = []
    for section in parse(Source("A.msg", text)).sections:
        for line in section.lines:
            body = parse_definition(line.definition) if line.definition else None
            if isinstance(body, Fault):
                found.append(line.definition)
            elif body is not None:
                value = body.value if isinstance(body, Constant) else body.default
                found.append((body.type.whole.text, body.name.text, value and value.text))
            found += [line.comment] if line.comment else []
    return found


def test_a_layout_that_would_change_the_meaning_is_never_written(here, monkeypatch, capsys):
    monkeypatch.setattr("idlc.tasks.fmt.format_file", lambda _: "int16 a\n")
    (here / "A.msg").write_text("int8 a\n")
    assert main(["fmt"]) == 3
    assert (here / "A.msg").read_text() == "int8 a\n"
    assert "IDL901" in capsys.readouterr().err
