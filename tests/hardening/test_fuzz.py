"""Everything that idlc reads may come from anybody: any bytes end in an answer, none in a crash.

`make fuzz` saves what it finds in tests/hardening/corpus/, which is tried here for ever after.
"""

import shutil
from pathlib import Path

import pytest

from tests.support import fuzzing
from tests.support.examples import given, settings, st
from tests.support.rounds import FUZZING, SEED, rounds


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / ".git").mkdir()
    return tmp_path


def attempt(target, data, folder):
    place = folder / "place"
    place.mkdir()
    try:
        fuzzing.TARGETS[target](data, place)
    except BaseException as error:
        if FUZZING:
            raise AssertionError(f"saved as {fuzzing.keep(target, data)}") from error
        raise
    finally:
        shutil.rmtree(place)


@pytest.mark.parametrize("target", fuzzing.TARGETS)
def test_what_once_found_a_bug(target, folder):
    corpus = fuzzing.saved(target)
    assert corpus
    for data in corpus:
        attempt(target, data, folder)


@pytest.mark.rounds
@pytest.mark.parametrize("target", fuzzing.TARGETS)
def test_mutated_files(target, folder):
    for data in fuzzing.inputs(target, SEED, rounds(60)):
        attempt(target, data, folder)


@pytest.mark.rounds
@pytest.mark.parametrize("target", fuzzing.TARGETS)
def test_arbitrary_bytes(target, folder):
    @settings(max_examples=rounds(15), deadline=None, database=None)
    @given(st.binary(max_size=200) | st.text(max_size=100).map(lambda text: text.encode("utf-8")))
    def any_bytes(data):
        attempt(target, data, folder)

    any_bytes()


def test_the_corpus_is_small():
    assert sum(path.stat().st_size for path in Path(fuzzing.CORPUS).rglob("*")) < 300_000
