"""The verdict `wire` is what really happens to old bytes, and `hash` what happens to RIHS01."""

import importlib
from collections import Counter

import pytest

from idlc.generate.python.render import render_package
from idlc.versions.packages import compare
from tests.support import evolution, reference_cdr
from tests.support.evolution import Evolution, compile_texts, old_bytes_are_misread
from tests.support.rounds import FUZZING, rounds

EDITS = rounds(20_000) if FUZZING else 20_000
PARTS = 16
STEPS = 25


@pytest.mark.parametrize(
    "part",
    [part if part < 1 else pytest.param(part, marks=pytest.mark.long) for part in range(PARTS)],
)
def test_the_verdict_is_what_happens(part):
    disagreements = []
    seen = Counter()
    for number in range(part, EDITS // STEPS, PARTS):
        history = Evolution(number)
        before = compile_texts(texts := history.texts())
        for step in range(STEPS):
            kind = history.edit()
            after = compile_texts(new_texts := history.texts())
            levels = {}
            for change in compare(before, after).changes:
                name = change.subject.partition(".")[0]
                levels[name] = levels.get(name, frozenset()) | change.levels
            for name in "ABC":
                said = levels.get(f"p/msg/{name}", frozenset())
                happened = what_happens(before, after, name, number * STEPS + step, "wire" in said)
                seen[kind, tuple(sorted(happened))] += 1
                if said & {"wire", "hash"} != happened:
                    disagreements.append((kind, name, texts, new_texts, said, happened))
            before, texts = after, new_texts
    assert not disagreements, "\n\n".join(map(str, disagreements[:3]))
    assert len(seen) > 20, "too one-sided to show much"


def what_happens(before, after, name, seed, suspected):
    """Return the levels that experience shows; look harder for damage where it is said to be."""
    full = evolution.ir.TypeName("p", "msg", name)
    found = set()
    if before.describer.hash(str(full)) != after.describer.hash(str(full)):
        found.add("hash")
    tries = 400 if suspected else 2 if found else 1
    if any(old_bytes_are_misread(before, after, full, seed * 1000 + n) for n in range(tries)):
        found.add("wire")
    return found


def test_the_generated_codec_reads_old_bytes_as_the_reference_does(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    compared = failed = 0
    for number in range(24):
        history = Evolution(number)
        before = compile_texts(history.texts())
        for _ in range(3):
            history.edit()
        package = f"evolved{number}"
        after = compile_texts(history.texts(), package)
        classes = generated(after, package, tmp_path)
        for step, name in enumerate("ABC" * 4):
            old = before.messages[evolution.ir.TypeName("p", "msg", name)]
            new = after.messages[evolution.ir.TypeName(package, "msg", name)]
            value = evolution.Values(step, before.messages).message(old)
            data, _ = reference_cdr.encode(old, value, before.messages)
            try:
                expected, _ = reference_cdr.decode(new, data, after.messages)
            except reference_cdr.ERRORS:
                errors = importlib.import_module(f"{package}._idlc")
                with pytest.raises(errors.DecodeError):
                    getattr(classes, name).deserialize(HEADER + data)
                failed += 1
            else:
                found = getattr(classes, name).deserialize(HEADER + data).to_dict()
                assert plain(found) == plain(expected)
                compared += 1
    assert compared > 100
    assert failed > 20


HEADER = b"\x00\x01\x00\x00"


def generated(model, package, folder):
    for file in render_package(model):
        path = folder / package / file.path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(file.text, encoding="utf-8")
    return importlib.import_module(f"{package}.msg")


def plain(value):
    """Return a value with lists for arrays and numbers for bytes, and NaN equal to itself."""
    if isinstance(value, dict):
        return {name: plain(item) for name, item in value.items()}
    if isinstance(value, bytes):
        return value[0] if len(value) == 1 else [*value]
    if isinstance(value, (str, int)):
        return value
    if isinstance(value, float):
        return repr(value)
    return [plain(item) for item in value]
