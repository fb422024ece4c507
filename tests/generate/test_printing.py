"""Names in generated code: of any length, and each from its own field alone."""

import ast
import random
import subprocess
import sys

import pytest

from idlc.generate.python.render import render_package
from tests.support import generated, values
from tests.support.rounds import ALL

PARTS = {
    "msg/Number.msg": "int32 value\n",
    "msg/Words.msg": "string text\n",
    "msg/Nothing.msg": "",
    "msg/Deep.msg": "Number inner\nbool flag\n",
    "msg/Mixed.msg": "string name\nfloat64[] values\nNumber number\nWords[] words\n",
}
SINGLE = ["float64", "bool", "byte", "string", "wstring", "string<=9",
          "Number", "Words", "Nothing", "Deep", "Mixed"]  # fmt: skip
KINDS = [
    *SINGLE,
    *(f"{kind}[]" for kind in SINGLE),
    *(f"{kind}[<=7]" for kind in SINGLE),
    *(f"{kind}[2]" for kind in SINGLE),
    *("float64[200]", "uint8[1100]", "byte[1100]", "Deep[6]", "Words[6]", "Mixed[6]"),
]
DEFAULTS = (
    "int32 A_CONSTANT = 1\n"
    f"string A_LONG_CONSTANT = {'constant ' * 9}\n"
    "float64 number 0.5\nfloat64[] numbers [1.0]\nuint8[1] one [7]\n"
    'string[1] text ["a"]\nstring[] texts ["a", "b c", "d"]\n'
)
LENGTHS = range(1, 121, 1 if ALL else 4)


def named(number, length):
    """Return the name of a field: as long as wanted, or as it takes to differ from others."""
    short = chr(97 + number // 26) + chr(97 + number % 26)
    return (short + "x" * length)[: max(length, 2)]


def every_kind(length):
    """Return fields of all kinds as text, every other time in reverse."""
    fields = [f"{kind} {named(number, length)}\n" for number, kind in enumerate(KINDS)]
    return "".join(fields[:: 1 if length % 2 else -1])


@pytest.fixture(scope="module")
def lengths(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lengths")
    files = dict(PARTS)
    for length in LENGTHS:
        files[f"msg/All{length}.msg"] = every_kind(length)
        alone = named(0, length)
        files[f"msg/Only{length}.msg"] = f"float64 {alone}\n"
        files[f"msg/Nested{length}.msg"] = f"Only{length} {alone}\nOnly{length}[] {alone}s\n"
        files[f"msg/L{'o' * length}ng.msg"] = f"float64 {alone}\nWords {alone}s\n"
    generated.write_package(folder, "lengths_msgs", files)
    with generated.importable(folder):
        yield folder


@pytest.mark.rounds
@pytest.mark.parametrize("stem", ["All", "Only", "Nested", "Long"])
def test_names_of_every_length_hold_what_they_were_given(lengths, stem):
    rng = random.Random(stem)
    for length in LENGTHS:
        name = f"L{'o' * length}ng" if stem == "Long" else f"{stem}{length}"
        cls = generated.class_of(f"lengths_msgs/msg/{name}")
        message = values.randomized(cls(), rng, longest=3)
        assert cls(*(getattr(message, field) for field in cls.__match_args__)) == message
        for order in ("little", "big"):
            raw = message.serialize(byteorder=order)
            read = [cls.deserialize(raw), cls.deserialize(raw, copy=False)]
            assert [*read, *cls.deserialize_many([raw])] == [message] * 3, (name, order)
            assert read[0].to_dict() == message.to_dict(), (name, order)


def test_no_line_is_longer_than_its_longest_name_makes_it(lengths):
    """A name of up to 12 characters never makes a line too long."""
    paths = [
        str(path)
        for path in (lengths / "lengths_msgs" / "msg").glob("_*.py")
        if int("".join(filter(str.isdigit, path.stem)) or "99") <= 12
    ]
    words = ["check", "--isolated", "--no-cache", "--select=E501,F,E9", *paths]
    result = subprocess.run(
        [sys.executable, "-m", "ruff", *words], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout


FIELDS = """bool flag
Deep inner
string data
float64[] values
Mixed[] parts
Number[3] numbers
uint8[16] key
byte[] octets
string size
"""


def names_of(fields):
    """Return the names that a codec uses, but those of what reads and writes runs of values."""
    model = generated.model_of("named_msgs", {**PARTS, "msg/All.msg": fields})
    (codec,) = (f.text for f in render_package(model) if f.path == "msg/_all__codec.py")
    names = {node.id for node in ast.walk(ast.parse(codec)) if isinstance(node, ast.Name)}
    return {name for name in names if not name.startswith(("read_", "write_"))}


@pytest.mark.parametrize("kind", ["float64", "string", "Mixed", "Number[]"])
def test_one_more_field_renames_no_other(kind):
    lines = FIELDS.splitlines(keepends=True)
    before = names_of(FIELDS)
    assert {"inner_inner", "data_", "parts_item", "size_"} <= before
    assert not {name for name in before if name.endswith("_2")}
    for place in range(len(lines) + 1):
        for name in ("added", "x", "value", "count"):
            more = [*lines[:place], f"{kind} {name}\n", *lines[place:]]
            assert before - names_of("".join(more)) <= {"view", "low", "pad4", "pad8"}
