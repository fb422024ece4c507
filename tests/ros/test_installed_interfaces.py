"""idlc over the interface files that ROS 2's own packages ship."""

import sys
from pathlib import Path

import pytest
from rosidl_parser.definition import Message
from rosidl_parser.parser import parse_idl_string

from idlc.cli.main import main
from idlc.diagnostics.report import Report
from idlc.diagnostics.source import Source
from idlc.language.format import format_file
from idlc.language.parse import parse
from idlc.model import ir
from idlc.model.idl_text import idl
from idlc.model.lowering.lower import lower
from tests.language.test_format import assert_only_the_layout_changes

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


@pytest.mark.long
def test_the_idl_is_what_rosidl_made_of_the_same_file():
    compared = 0
    for path in FILES:
        installed = path.with_suffix(".idl")
        if installed.exists():
            name = ir.TypeName(path.parts[-3], path.suffix[1:], path.stem)
            text = idl(lower(parse(Source(str(path), read(path))), name, Report()))
            assert structures(text) == structures(installed.read_text(encoding="utf-8")), path
            compared += 1
    assert compared > 100


def structures(text):
    """Names, types, annotations and constants, as rosidl's own parser reads them."""
    content = parse_idl_string(text)
    return [
        (
            message.structure.namespaced_type.name,
            [(member.name, type(member.type).__name__) for member in message.structure.members],
            [
                [(one.name, str(one.value)) for one in member.annotations]
                for member in message.structure.members
            ],
            [(constant.name, constant.value) for constant in message.constants],
        )
        for message in content.get_elements_of_type(Message)
    ]
