"""Texts that nodes send, damaged as rosidl damages them."""

from random import Random

import pytest

from idlc.diagnostics.report import Report
from idlc.diagnostics.source import INCOMPLETE, Source
from idlc.language.parse import parse
from idlc.model import derive, ir
from idlc.model.describe import individual
from idlc.model.distros import NEWEST
from idlc.model.from_description import defaults_of, message_of, node_texts
from idlc.model.lowering.lower import lower
from tests.robot.fake import damaged, with_damaged_defaults
from tests.support.rounds import SEED, rounds

#: Characters of every plane, those that rosidl escapes, and texts that look like its escapes.
PIECES = ("\t", "\\", "°", "€", "é", "ÿ", "\U0001f600", "\U0010fffd", " ", "'", "a", "b")
PIECES += ("\\t", "\\x41", "\\xc3\\xa9", "\\\\")


def lowered(text, name):
    report = Report()
    return lower(parse(Source("a file", text)), name, report, NEWEST), report


def sent(name, text, damage=damaged):
    """Return what idlc makes of an interface that a node describes and sends."""
    sections = [*map(individual, derive.sections(lowered(text, name)[0]))]
    description = {"type_description": sections[0], "referenced_type_descriptions": sections[1:]}
    if damage is damaged:
        description = with_damaged_defaults(description)
        sections = [description["type_description"], *description["referenced_type_descriptions"]]
    messages = {own.name: own for own in (message_of(part, "/node") for part in sections)}
    sources = {str(name): damage(text)}
    return node_texts([name], sources, messages, defaults_of(description))[name]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("uint8 A=1\n# no damage\n", "uint8 A=1\n# no damage"),
        ("# angle in °\nfloat64 angle\nint32 LIMIT=1000000000", "# angle in °\nfloat64 angle\n!"),
        ("# in °\nint32 retries 1234567890\n", "# in °\nint32 retries 1234567890\n"),
        ("uint8 B=1\t# one\nuint8 state 1\n", "uint8 B=1\t# one\nuint8 state 1\n"),
        (
            "# °\nuint8 A=1\nuint8 B=2\nfloat64 f 0.5\n",
            "# °\nuint8 A=1\nuint8 B=2\n!float64 f 0.5\n",
        ),
        ('string s "°C"\n', "!string s\n"),
        ('string s "°C"\n# and a comment\n', 'string s "°C"\n'),
        ("# °\nfloat64 f -inf\n", "!# °\nfloat64 f\n"),
        ("# \\t\nuint8 A=1\nuint8 f\n", "# \\t\nuint8 A=1\nuint8 f\n"),
    ],
)
def test_what_is_whole_is_kept_and_the_rest_is_said_to_be_missing(text, expected):
    result = sent(ir.TypeName("a_msgs", "msg", "Some"), text)
    assert (INCOMPLETE in result) == ("!" in expected)
    assert result.replace(f"{INCOMPLETE}\n", "") == expected.replace("!", "")


@pytest.mark.parametrize("text", ["int8 other\n", "int8 a 3\n", "int8 a\nint8 b\n", "int8", "x\t"])
def test_a_text_that_contradicts_its_description_is_not_used(text):
    result = sent(ir.TypeName("a_msgs", "msg", "Some"), "int8 a 2\n", lambda _: text)
    assert result == f"int8 a 2\n{INCOMPLETE}\n"


def _line(random, number):
    blank, text = random.choice([" ", " ", "\t"]), "".join(random.choices(PIECES, k=4))
    value = random.choice([0, 255, random.getrandbits(30)])
    form = random.choice(
        [
            "# {text}",
            "int32{b}A{n}={v}",
            'string{b}S{n}="{text}"',
            "int32{b}i{n}{b}{v}",
            'string{b}s{n}{b}"{text}"',
            "float64{b}f{n}{b}{v}.5",
            "int32[]{b}l{n}{b}[1, {v}]",
            "float32{b}g{n} -inf",
            "bool{b}p{n}",
            "string[]{b}t{n} ['a', \"b\"]",
        ]
    )
    comment = random.choice(["", "", f"{blank}# {text}"])
    return form.format(b=blank, n=number, v=value, text=text) + comment


@pytest.mark.rounds
def test_every_constant_and_default_is_right_or_said_to_be_missing():
    random, left, whole = Random(SEED), rounds(2000), 0
    while left:
        kind = random.choice([*ir.KINDS])
        parts = ["\n".join(_line(random, n) for n in range(random.randint(0, 6))) for _ in range(3)]
        text = "\n---\n".join(parts[: ir.KINDS.index(kind) + 1]) + random.choice(["\n", "\n", ""])
        name = ir.TypeName("a_msgs", kind, "Some")
        interface, report = lowered(text, name)
        # some nodes are not of ROS 2
        damage = damaged if random.random() < 0.9 else str
        if report.had_errors or (damage is damaged and damaged(text) == text.removesuffix("\n")):
            continue
        left -= 1
        result = sent(name, text, damage)
        again, report = lowered(result, name)
        assert not report.had_errors, result
        whole += INCOMPLETE not in result
        for old, new in zip(derive.sections(interface), derive.sections(again), strict=True):
            facts = [
                (
                    [(field.name, field.type, bool(field.default)) for field in part.fields],
                    {own.name: (own.type, repr(own.value)) for own in part.constants}.items(),
                    {f.name: repr(f.default.value) for f in part.fields if f.default}.items(),
                )
                for part in (old, new)
            ]
            (fields, *every), (others, *left_over) = facts
            assert [each[:2] for each in fields] == [each[:2] for each in others]
            if INCOMPLETE in result:
                assert all(some <= all_ for some, all_ in zip(left_over, every, strict=True)), text
            else:
                assert every == left_over, text
    assert whole
