"""Upgraded messages are those that a reader of JSON by field names makes of the old ones."""

import pickle

import numpy as np
import pytest

import idlc
from idlc.recordings.columns.values import Columns
from tests.support import upgrades
from tests.support.examples import given, settings, st
from tests.support.rounds import rounds


@pytest.mark.rounds
@settings(max_examples=rounds(100))
@given(st.data())
def test_it_is_what_a_reader_of_json_makes_of_it(tmp_path_factory, data):
    pair = data.draw(upgrades.pairs())
    folder = tmp_path_factory.mktemp("types")
    old, new = upgrades.load(folder / "old", pair.old), upgrades.load(folder / "new", pair.new)
    upgrade = idlc.upgrade(old, new)
    values = data.draw(st.lists(upgrades.messages(pair.old, "M0"), min_size=1, max_size=3))
    messages = [old.from_dict(each) for each in values]
    wanted = [new.from_dict(upgrades.by_names(pair, "M0", each)) for each in values]
    payloads = [message.serialize() for message in messages]

    assert upgrade.many(payloads) == [message.serialize() for message in wanted]
    big = [message.serialize(byteorder="big") for message in messages]
    if not upgrade.plan.same:
        assert upgrade.many(map(memoryview, big)) == upgrade.many(payloads)
    made = [upgrade.message(message) for message in messages]
    assert made == wanted
    for message in made:
        message.validate()
    assert all(type(message) is new for message in made)
    assert pickle.loads(pickle.dumps(upgrade)).many(payloads) == upgrade.many(payloads)
    if upgrade.plan.same:
        assert upgrade.many(payloads) == payloads


@pytest.mark.rounds
@settings(max_examples=rounds(60))
@given(st.data())
def test_columns_are_those_of_the_new_bytes(tmp_path_factory, data):
    pair = data.draw(upgrades.pairs())
    folder = tmp_path_factory.mktemp("types")
    old, new = upgrades.load(folder / "old", pair.old), upgrades.load(folder / "new", pair.new)
    upgrade = idlc.upgrade(old, new)
    values = data.draw(st.lists(upgrades.messages(pair.old, "M0"), max_size=4))
    payloads = [
        old.from_dict(each).serialize(byteorder=data.draw(st.sampled_from(["little", "big"])))
        for each in values
    ]
    names = data.draw(st.none() | st.lists(st.sampled_from(paths(pair.new, "M0")), max_size=4))
    options = {"fields": names}
    wanted = new.to_columns(upgrade.many(payloads), **options)
    assert parts(upgrade.columns(payloads, **options)) == parts(wanted)
    assert upgrade.arrow(payloads).equals(new.to_arrow(upgrade.many(payloads)), check_metadata=True)


def paths(types, name):
    """Return the path of each field of a type, at any depth."""
    found = []
    for field in types[name]:
        inside = paths(types, field.element) if field.element in types else []
        found += [field.name, *(f"{field.name}.{path}" for path in inside)]
    return found


def parts(column):
    """Return all that a column consists of."""
    if isinstance(column, Columns):
        inside = {name: parts(column[name]) for name in column.keys()}  # noqa: SIM118
        return inside, list(inside), len(column), dict(column.times)
    if isinstance(column, np.ndarray):
        return column.dtype, column.shape, column.tobytes()
    return type(column), column.offsets.tolist(), column.size, parts(column.values)


@settings(max_examples=20)
@given(st.data())
def test_new_messages_share_nothing_with_old_ones(tmp_path_factory, data):
    pair = data.draw(upgrades.pairs())
    folder = tmp_path_factory.mktemp("types")
    old, new = upgrades.load(folder / "old", pair.old), upgrades.load(folder / "new", pair.new)
    message = old.from_dict(data.draw(upgrades.messages(pair.old, "M0")))
    made = idlc.upgrade(old, new).message(message)
    assert not {*mutable(message)} & {*mutable(made)}


def mutable(value):
    """Yield the identity of each object in a message that can be changed."""
    if hasattr(type(value), "get_fields_and_field_types"):
        yield id(value)
        for slot in type(value).__slots__:
            yield from mutable(getattr(value, slot))
    elif hasattr(value, "__setitem__"):
        yield id(value)
        for element in value:
            yield from mutable(element)
