"""Messages as YAML, JSON and CSV: what `idlc echo` and `idlc call` print."""

import json
import math

import pytest
import yaml

from idlc.cli.messages import texts


def text(values, style="yaml", **options):
    return "".join(texts(style, [values], **options))


def test_yaml_is_read_as_it_was():
    numbers = [1, -2, 1e20, 1e-7, 0.5, math.inf, -math.inf]
    values = {
        "numbers": numbers * 9,
        "nested": [{"bytes": [0, 255] * 500, "text": "array0x"}] * 40,
        "mixed": [True, False] * 40,
        "texts": ["a", "1", "", "null", "- b", "x: y", "\n"] * 9,
        "short": numbers,
    }
    assert next(yaml.safe_load_all(text(values))) == values
    nan = yaml.safe_load(text({"a": [math.nan] * 40}).partition("---")[0])["a"]
    assert all(map(math.isnan, nan))


@pytest.mark.parametrize("word", ["1e3", "1E5", "-1e-3", ".5", "0o17", "0x1F", "12", "1_0", "on"])
def test_readers_of_yaml_1_2_take_texts_for_texts(word):
    plain = text({"word": word})
    assert yaml.safe_load(plain.partition("---")[0]) == {"word": word}
    assert f"word: '{word}'" in plain


def test_arrays_are_shortened_for_eyes_only():
    values = {"data": [*range(1000)], "points": [{"x": 1.0}] * 33, "few": [*range(32)]}
    brief = yaml.safe_load(text(values, is_brief=True).partition("---")[0])
    assert brief["data"] == [*range(16), "... 1000 in all"]
    assert brief["points"] == [*[{"x": 1.0}] * 16, "... 33 in all"]
    assert brief["few"] == values["few"]
    assert json.loads(text(values, "json", is_brief=True)) == values


def test_json_has_no_numbers_that_are_none():
    line = text({"a": [math.nan, 1.0], "b": math.inf}, "json")
    assert line == '{"a": [null, 1.0], "b": null}\n'


def test_numbers_of_an_image_do_not_pass_through_the_yaml_library(monkeypatch):
    dumped = []
    dump = yaml.dump
    monkeypatch.setattr(
        yaml, "dump", lambda *args, **kw: dumped.append(dump(*args, **kw)) or dumped[0]
    )
    printed = text({"data": [7] * 100_000})
    assert printed.count("7") == 100_000
    assert len(dumped[0]) < 100


def test_yaml_makes_no_class_for_each_message():
    base = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    text({"data": 1})
    count = len(base.__subclasses__())
    for number in range(3):
        assert text({"data": [number] * 40}).count(str(number)) == 40
    assert len(base.__subclasses__()) == count
