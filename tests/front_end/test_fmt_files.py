"""`idlc fmt` and the user's files."""

import os
import stat

import pytest

from idlc.cli.main import main

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
    assert "1 file with errors left alone" in capsys.readouterr().out


def test_a_layout_that_would_change_the_meaning_is_never_written(here, monkeypatch, capsys):
    monkeypatch.setattr("idlc.syntax.format.format_file", lambda _: "int16 a\n")
    (here / "A.msg").write_text("int8 a\n")
    assert main(["fmt"]) == 3
    assert (here / "A.msg").read_text() == "int8 a\n"
    assert "IDL901" in capsys.readouterr().err
