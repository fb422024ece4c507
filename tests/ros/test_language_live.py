"""The examples of docs/language.md mean to the installed rosidl what their arrows say."""

import language_book
from test_verdict_live import ask_rosidl

BOOK = language_book.BOOK.read_text(encoding="utf-8")


def test_examples(tmp_path):
    examples = list(language_book.examples(BOOK))
    outcomes = ask_rosidl([example.case for example in examples], tmp_path)
    wrong = []
    for example, outcome in zip(examples, outcomes, strict=True):
        found = language_book.told_by_rosidl(example, outcome)
        if found != language_book.without_codes(example):
            wrong.append((example.place, example.shown, found, example.arrows))
    assert wrong == []
