"""Each distribution's tables are what a C compiler makes of its structures."""

import platform
from itertools import product
from pathlib import Path

import pytest

from idlc.native.layouts import LAYOUTS
from idlc.native.library import MACHINES, libraries
from tests.support.generated import model_of
from tests.support.tools import run, tool

#: What a distribution's headers have that Humble's have not.
DEFINES = {
    "humble": (),
    "iron": (),
    "jazzy": ("KEYS",),
    "kilted": ("KEYS",),
    "lyrical": ("KEYS", "BUFFERS"),
    "rolling": ("KEYS", "BUFFERS"),
}
#: Type in .msg files -> C type, C type of a sequence, type in the tables, bound of a string.
TYPES = {
    "bool": ("bool", "Primitives", 6, 0),
    "byte": ("uint8_t", "Primitives", 7, 0),
    "char": ("uint8_t", "Primitives", 8, 0),
    "int8": ("int8_t", "Primitives", 9, 0),
    "uint8": ("uint8_t", "Primitives", 8, 0),
    "int16": ("int16_t", "Primitives", 11, 0),
    "uint16": ("uint16_t", "Primitives", 10, 0),
    "int32": ("int32_t", "Primitives", 13, 0),
    "uint32": ("uint32_t", "Primitives", 12, 0),
    "int64": ("int64_t", "Primitives", 15, 0),
    "uint64": ("uint64_t", "Primitives", 14, 0),
    "float32": ("float", "Primitives", 1, 0),
    "float64": ("double", "Primitives", 2, 0),
    "string": ("Text", "Primitives", 16, 0),
    "string<=7": ("Text", "Primitives", 16, 7),
    "wstring": ("Text", "Primitives", 17, 0),
    "wstring<=9": ("Text", "Primitives", 17, 9),
    "Small": ("struct Small", "Messages", 18, 0),
    "Empty": ("struct Empty", "Messages", 18, 0),
    "Large": ("struct Large", "Messages", 18, 0),
}
#: Shape in .msg files -> brackets in C, or None for a sequence; is_array, array_size, is_upper.
SHAPES = {
    "": ("", 0, 0, 0),
    "[3]": ("[3]", 1, 3, 0),
    "[]": (None, 1, 0, 0),
    "[<=5]": (None, 1, 5, 1),
}
#: rosidl reads `wstring<=9[]` as `wstring<=9[<=9]`, which is no matter of layouts.
PAIRS = [pair for pair in product(TYPES, SHAPES) if pair != ("wstring<=9", "[]")]
DUMMY = "structure_needs_at_least_one_member"
MESSAGES = {
    "Small": [("uint8", "")],
    "Empty": [],
    "Large": [("int16", "[3]"), ("int64", ""), ("string", "[]"), ("Small", "[3]")],
    # something small between any two, for the padding
    "Every": [one for pair in PAIRS for one in (pair, ("int8", ""))],
}


def c_text():
    """Return the structures, and what is expected of the tables."""
    lines, table = ['#define SPACE "layouts__msg"'], []
    for message, fields in MESSAGES.items():
        lines.append(f"struct {message} {{")
        rows = []
        for index, (type_, shape) in enumerate(fields):
            c_type, sequence, kind, bound = TYPES[type_]
            brackets, array, count, upper = SHAPES[shape]
            one = f"{sequence} f{index}" if brackets is None else f"{c_type} f{index}{brackets}"
            lines.append(f"  {one};")
            offset = f"offsetof(struct {message}, f{index})"
            rows.append(f'  {{"f{index}", {kind}, {bound}, {array}, {count}, {upper}, {offset}}},')
        if not fields:
            lines.append("  uint8_t dummy;")
            rows.append(f'  {{"{DUMMY}", 8, 0, 0, 0, 0, 0}},')
        lines += ["};", f"static const Expected {message}_fields[] = {{", *rows, "};"]
        table.append(f'{{"{message}", sizeof(struct {message}), {message}_fields, {len(rows)}}}')
    row = "struct { const char *name; size_t size; const Expected *fields; uint32_t count; }"
    return "\n".join([*lines, f"static const {row} MESSAGES[] = {{", ",\n".join(table), "};\n"])


@pytest.fixture(scope="module")
def model():
    files = {
        f"msg/{message}.msg": "".join(
            f"{type_}{shape} f{index}\n" for index, (type_, shape) in enumerate(fields)
        )
        for message, fields in MESSAGES.items()
    }
    return model_of("layouts", files)


@pytest.mark.parametrize("distribution", DEFINES)
def test_tables_are_what_the_compiler_says(distribution, model, tmp_path):
    machine = platform.machine()
    (tmp_path / "expected.h").write_text(c_text())
    words = ["-Wall", "-Werror", f"-I{tmp_path}", *(f"-D{one}" for one in DEFINES[distribution])]
    program = tmp_path / "layouts"
    source = Path(__file__).parent / "layouts.c"
    run(tool("gcc"), *words, source, "-o", program, "-ldl")
    for name, content in libraries(model, MACHINES[machine], LAYOUTS[distribution]).items():
        (tmp_path / name).write_bytes(content)
    run(program, tmp_path / "liblayouts__rosidl_typesupport_cpp.so", "layouts")


def test_all_distributions_are_tried():
    assert list(DEFINES) == list(LAYOUTS)
