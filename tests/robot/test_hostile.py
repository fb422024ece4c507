"""Tokens and attachments from anybody are read or ignored, and take up bounded memory.

test_node_hostile.py does the same with the messages of a node.
"""

import random
import re
import tracemalloc
from itertools import islice

import pytest

from idlc.robot import keys
from idlc.robot.graph import Graph
from idlc.robot.keys import EntityKind, pack_attachment, parse_attachment, parse_token
from idlc.robot.names import is_absolute, is_namespace, is_node_name
from tests.robot.test_graph import Tokens, entity
from tests.robot.test_keys import TOKENS
from tests.support.rounds import SEED, rounds

COUNT = rounds(60_000)
STRANGE = "/%:,;*$#?@~.\0\n\\\"' a9_\u202e\U0001f916\u0663\uff11\u00b2\u0430"
#: The parts of a token that contain names: enclave, namespace, node, name, type and hash.
NAMES = {
    number: re.compile(pattern, re.ASCII)
    for number, pattern in {
        6: r"(%[A-Za-z_]\w*)+",
        7: r"(%[A-Za-z_]\w*)+",
        8: r"[A-Za-z_]\w*",
        9: r"(%[A-Za-z_]\w*)+",
        10: r"[a-z]\w*::(msg|srv|action)::dds_::[A-Za-z]\w*_",
        11: r"\w+",
    }.items()
}


def mutated(rng, text):
    """Return text with one to four changes."""
    characters = list(text)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(characters))
        match rng.randrange(4):
            case 0:
                characters[at] = rng.choice(STRANGE)
            case 1:
                del characters[at : at + rng.randint(1, 30)]
            case 2:
                characters[at:at] = characters[: rng.randrange(len(characters))]
            case 3:
                characters[at] = chr(rng.randrange(0xD800))
        characters = characters or ["x"]
    return "".join(characters)


def is_sound(end):
    """Return whether an entity contains only what a node or an endpoint can have."""
    names = is_namespace(end.enclave) and is_namespace(end.namespace) and is_node_name(end.node)
    if end.kind is EntityKind.NODE:
        return names and (end.name, end.type, end.hash) == ("", "", "")
    key = end.key
    return names and is_absolute(end.name) and key.isascii() and not set("*$?# \n") & set(key)


@pytest.mark.rounds
def test_mutated_tokens_are_ignored_or_contain_valid_names():
    rng = random.Random(SEED)
    tokens, expected = Tokens(), set()
    graph = Graph(tokens, 0)
    for _ in range(COUNT):
        token = mutated(rng, rng.choice(TOKENS))
        tokens.update(token, True)
        if end := parse_token(token):
            expected.add(token)
            assert is_sound(end), token
            assert len(end.gid) == 16
        gone = rng.choice([token, mutated(rng, token)])
        tokens.update(gone, False)
        expected.discard(gone)
    assert {end.token for end in graph.entities()} == expected
    assert COUNT // 100 < len(expected) < COUNT // 2
    for token in expected:
        tokens.update(token, False)
    assert graph.entities() == ()


@pytest.mark.parametrize("place", NAMES)
def test_every_byte_and_odd_digits_in_each_name(place):
    parts = "@ros2_lv/0/f1/0/1/MP/%en/%ns%sub/node/%a%bc/pkg::msg::dds_::Type_/RIHS01_0a/::,:,:,:,,"
    parts = parts.split("/")
    good = parts[place]
    for character in [*map(chr, range(256)), *STRANGE]:
        for at in range(len(good) + 1):
            parts[place] = text = good[:at] + character + good[at:]
            end = parse_token("/".join(parts))
            assert end is None or is_sound(end)
            if character != "/":  # with one, the parts are others
                assert (end is not None) == bool(NAMES[place].fullmatch(text)), parts


@pytest.mark.rounds
def test_mutated_attachments_are_refused_or_read():
    rng = random.Random(SEED)
    numbers = [0, 1, -1, 2**31, 2**63 - 1, -(2**63)]
    read = 0
    for _ in range(COUNT):
        whole = pack_attachment(rng.choice(numbers), rng.choice(numbers), rng.randbytes(16))
        data = bytearray(whole[: rng.randint(0, 40)] + rng.randbytes(rng.randint(0, 3)))
        for _ in range(rng.randint(0, 3)):
            if data:
                data[rng.randrange(len(data))] = rng.randrange(256)
        attachment = parse_attachment(bytes(data))
        assert (attachment is not None) == (len(data) >= 33 and data[16] == 16)
        if attachment is not None:
            read += 1
            assert pack_attachment(*attachment) == data[:33]
    assert COUNT // 20 < read < COUNT // 2


def test_a_robot_with_ten_thousand_endpoints_takes_little_memory():
    made = [entity(EntityKind.PUBLISHER, n, name=f"/topic_{n}").token for n in range(10_000)]
    tracemalloc.start()
    try:
        graph = Graph(Tokens(*made), 0)
        assert len(graph.entities()) == 10_000
        assert not graph.is_full
        assert tracemalloc.get_traced_memory()[1] < 16 * 2**20
    finally:
        tracemalloc.stop()


def tokens_of(length):
    """Yield ever new valid tokens, as short as possible or with this number of characters."""
    for number in range(1 << 30):
        token = entity(EntityKind.NODE, number, node="n").token
        yield token if length is None else f"{token}/".ljust(length, "\u202e")


@pytest.mark.parametrize("length", [None, 300, keys.MOST_TOKEN, keys.MOST_TOKEN + 1])
def test_a_flood_of_tokens_is_cut(length):
    limit, tokens = 2 * 2**20, Tokens()
    graph = Graph(tokens, 0, limit)
    tracemalloc.start()
    try:
        for token in islice(tokens_of(length), 10_000):
            tokens.update(token, True)
            tokens.update(token, True)
        assert tracemalloc.get_traced_memory()[1] < 1.5 * limit
    finally:
        tracemalloc.stop()
    assert len(graph.entities()) < 5_000
    assert graph.is_full == (length != keys.MOST_TOKEN + 1)
    # there is room again when others go
    known = graph.entities()
    for end in known:
        tokens.update(end.token, False)
    late = entity(EntityKind.PUBLISHER)
    tokens.update(late.token, True)
    assert graph.entities() == (late,)
