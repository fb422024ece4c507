"""What changes while it is serialized: bytes are of one moment, or there are none."""

import sys
import threading
from contextlib import contextmanager

import pytest

from tests.support import generated
from tests.support.waiting import join

FILES = {
    "msg/Number.msg": "int32 value\n",
    "msg/Words.msg": "string text\nstring more\n",
    "msg/Mixed.msg": "string text\nfloat64[] values\nint32[] more\n",
    "msg/Lists.msg": (
        "bool[] flags\nbyte[] octets\nstring[] texts\nstring[2] two_texts\nwstring[] wides\n"
        "wstring[2] two_wides\nNumber[] numbers\nNumber[2] two_numbers\nWords[] words\n"
        "Words[<=4] few_words\nWords[9] nine_words\nMixed[] mixed\nMixed[2] two_mixed\n"
    ),
    "msg/Arrays.msg": "float64[] a\nuint8[] b\nint16[<=90] c\nstring text\nMixed[] mixed\n",
}
LISTS = {
    "flags": True, "texts": "x", "two_texts": "x", "wides": "x", "two_wides": "x",
    "numbers": "Number", "two_numbers": "Number", "words": "Words", "few_words": "Words",
    "nine_words": "Words", "mixed": "Mixed", "two_mixed": "Mixed",
}  # fmt: skip
SIZES = {"two_texts": 2, "two_wides": 2, "two_numbers": 2, "nine_words": 9, "two_mixed": 2}
FIRST = {"Number": "_value", "Words": "_text", "Mixed": "_text"}


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    folder = tmp_path_factory.mktemp("moments")
    generated.write_package(folder, "moments_msgs", FILES)
    with generated.importable(folder):
        yield lambda name: generated.class_of(f"moments_msgs/msg/{name}")


def assert_whole(raw, kind):
    """The bytes are those of a message: its own, and no others."""
    found = kind.deserialize(raw)
    order = "little" if raw[1] else "big"
    assert found.serialize(byteorder=order) == raw
    return found


def sly(value, change, package):
    """Return a value that calls `change` when the encoder looks at it."""

    class Text(str):
        def __len__(self):
            change()
            return super().__len__()

        def __iter__(self):
            change()
            return super().__iter__()

    class Flag:
        def __hash__(self):
            change()
            return hash(True)

        def __eq__(self, other):
            return other is True

    if value is True:
        return Flag()
    if value == "x":
        return Text(value)
    kind, slot = package(value), FIRST[value]
    plain = getattr(kind, slot)

    def get(item):
        change()
        return plain.__get__(item)

    return type(f"Sly{value}", (kind,), {slot: property(get, plain.__set__)})()


@pytest.mark.parametrize("order", ["little", "big"])
@pytest.mark.parametrize("change", ["append", "insert", "pop", "clear"])
@pytest.mark.parametrize("name", LISTS)
def test_a_list_that_changes_while_it_is_encoded(package, name, change, order):
    cls, value = package("Lists"), LISTS[name]
    plain = value if not FIRST.get(value) else package(value)()
    message = cls()
    values = getattr(message, name)

    def mutate():
        if change in ("append", "insert"):
            values.insert(len(values) if change == "append" else 0, plain)
            del values[40:]  # it ends, however often it is called
        elif values:
            values.pop(0) if change == "pop" else values.clear()

    size = SIZES.get(name, 3)
    values[:] = [plain] * (size - 1) + [sly(value, mutate, package)]
    values.reverse()
    try:
        raw = message.serialize(byteorder=order)
    except Exception:
        assert name in SIZES  # a wrong number of elements
    else:
        assert_whole(raw, cls)


@pytest.mark.parametrize("order", ["little", "big"])
@pytest.mark.parametrize("name", ["a", "b", "c"])
def test_an_array_that_changes_after_it_was_counted(package, name, order):
    cls = package("Arrays")
    message = cls(a=[1.0] * 5, b=[1] * 5, c=[1] * 5)
    left = [lambda array: array.append(2), lambda array: array.pop(), lambda array: array.pop(0)]

    class Text(str):
        def encode(self):
            if left:
                left.pop()(getattr(message, name))
            return super().encode()

    message.text = Text("x")
    message.mixed = [package("Mixed")(text=message.text, values=[1.0])]
    assert_whole(message.serialize(byteorder=order), cls)


@pytest.mark.parametrize(("size", "values"), [(3, [1.0] * 3), (70_000, [2.0] * 70_000)])
def test_arrays_in_elements_are_of_one_moment(package, size, values):
    mixed = package("Mixed")
    message = package("Arrays")(mixed=[mixed("x", values), mixed("y", values, [1, 2])])
    for order in ("little", "big"):
        found = assert_whole(message.serialize(byteorder=order), package("Arrays"))
        assert [len(one.values) for one in found.mixed] == [size, size]


def test_names_that_change_while_they_are_encoded_are_not_kept(package):
    """Equal names are encoded once; what was kept is for the names that it was made of."""
    cls = package("Lists")
    message = cls()

    class Text(str):
        def __len__(self):
            message.texts.append("later")
            return super().__len__()

    message.texts = [Text("a"), "b"]
    message.serialize()
    assert len(message.texts) > 2
    again = cls(texts=[str.__str__(text) for text in message.texts])
    assert cls.deserialize(again.serialize()).texts == again.texts


def test_an_iterator_is_no_sequence(package):
    """It would be there once, and be gone the next time."""
    for name in ("flags", "octets", "texts", "wides", "numbers", "words", "mixed"):
        message = package("Lists")()
        setattr(message, f"_{name}", iter([]))
        with pytest.raises(ValueError, match=f"^{name}: must be a sequence"):
            message.serialize()


@contextmanager
def quick_switches():
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


def change_forever(message, element, stop):
    while not stop.is_set():
        for array in (message.a, message.b):
            array.append(1)
            array.extend([1, 1, 1])
            del array[4:]
        message.c.append(message.c.pop())
        message.mixed.insert(0, element)
        message.mixed[1].values.append(1.0)
        del message.mixed[3:], message.mixed[0].values[5:]


def test_threads_that_change_what_is_serialized(package):
    cls = package("Arrays")
    element = package("Mixed")("x", [1.0])
    message = cls([1.0], [1], [1], "text", [element])
    stop = threading.Event()
    thread = threading.Thread(target=change_forever, args=(message, element, stop))
    with quick_switches():
        thread.start()
        try:
            for number in range(4000):
                order = "little" if number % 4 else "big"
                assert_whole(message.serialize(byteorder=order), cls)
        finally:
            stop.set()
            join(thread)
