"""The verdict `wire` is what really happens to old bytes, and `hash` what happens to RIHS01."""

import os
from collections import Counter

import evolution
import pytest
from evolution import Evolution, compile_texts, old_bytes_are_misread

from idlc.model.changes.packages import compare

EDITS = int(os.environ.get("IDLC_EVOLUTION_EDITS", "20000"))
PARTS = 8
STEPS = 25


@pytest.mark.parametrize("part", range(PARTS))
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
