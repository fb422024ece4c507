"""idlc over the interface files that ROS 2's own packages ship."""

import sys
from pathlib import Path

from test_format import assert_only_the_layout_changes

from idlc.cli.main import main
from idlc.model import ir
from idlc.syntax.format import format_file
from idlc.syntax.parse import parse
from idlc.text.source import Source

SHARE = Path(sys.prefix) / "share"
FILES = sorted(path for kind in ir.KINDS for path in SHARE.glob(f"*/{kind}/*.{kind}"))


def read(path):
    return path.read_bytes().decode("utf-8")


def test_fmt_leaves_nine_lines_in_ten_alone():
    changed = total = 0
    for path in FILES:
        text = read(path)
        assert_only_the_layout_changes(text, path.suffix[1:])
        once = format_file(parse(Source(str(path), text)))
        before, after = ([line for line in t.split("\n") if line.strip()] for t in (text, once))
        total += len(before)
        changed += sum(a != b for a, b in zip(before, after, strict=True))
    assert total > 1000, "no interface files: are the ROS 2 wheels installed?"
    assert changed < total / 10


def test_check_finds_advice_but_no_errors(capsys):
    for words in ([], ["--select", "all"]):
        assert main(["check", str(SHARE), *words]) == 0
        assert "error[" not in capsys.readouterr().out
