"""The examples of docs/language.md mean to the installed rosidl what their arrows say."""

from pathlib import Path

import pytest
from rosidl_adapter import convert_to_idl

from tests.ros.test_verdict_live import ask_rosidl
from tests.support import language_book

BOOK = language_book.BOOK.read_text(encoding="utf-8")


@pytest.mark.long
def test_examples(tmp_path):
    examples = [one for one in language_book.examples(BOOK) if not one.distro]
    outcomes = ask_rosidl([example.case for example in examples], tmp_path)
    wrong = []
    for example, outcome in zip(examples, outcomes, strict=True):
        found = language_book.told_by_rosidl(example, outcome)
        if found != language_book.without_codes(example):
            wrong.append((example.place, example.shown, found, example.arrows))
    assert wrong == []


def test_the_idl_file(tmp_path):
    example, shown = language_book.idl_shown(BOOK)
    path = tmp_path / "msg" / "Example.msg"
    path.parent.mkdir()
    path.write_text(example.shown, encoding="utf-8")
    written = convert_to_idl(tmp_path, "demo", Path("msg/Example.msg"), tmp_path / "idl")
    assert language_book.idl_text(written.read_text(encoding="utf-8")) == shown
