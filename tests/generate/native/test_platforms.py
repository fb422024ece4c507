"""Each distribution's tables are what a compiler of C and of C++ makes of its structures."""

import platform
from itertools import product
from pathlib import Path

import pytest

from idlc.generate.native.library import FIELDS_CPP, MACHINES, OWN, libraries
from idlc.generate.native.platforms import LAYOUTS
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
#: Compiler -> language, and the library whose structures are of that language.
COMPILERS = {"gcc": ("c", OWN), "g++": ("c++", FIELDS_CPP)}
#: Type in .msg files -> type in C, macro for a sequence of it, type in tables, bound of a string.
TYPES = {
    "bool": ("bool", "PRIMITIVES", 6, 0),
    "byte": ("uint8_t", "PRIMITIVES", 7, 0),
    "char": ("uint8_t", "PRIMITIVES", 8, 0),
    "int8": ("int8_t", "PRIMITIVES", 9, 0),
    "uint8": ("uint8_t", "PRIMITIVES", 8, 0),
    "int16": ("int16_t", "PRIMITIVES", 11, 0),
    "uint16": ("uint16_t", "PRIMITIVES", 10, 0),
    "int32": ("int32_t", "PRIMITIVES", 13, 0),
    "uint32": ("uint32_t", "PRIMITIVES", 12, 0),
    "int64": ("int64_t", "PRIMITIVES", 15, 0),
    "uint64": ("uint64_t", "PRIMITIVES", 14, 0),
    "float32": ("float", "PRIMITIVES", 1, 0),
    "float64": ("double", "PRIMITIVES", 2, 0),
    "string": ("Text", "PRIMITIVES", 16, 0),
    "string<=7": ("Text", "PRIMITIVES", 16, 7),
    "wstring": ("Text", "PRIMITIVES", 17, 0),
    "wstring<=9": ("Text", "PRIMITIVES", 17, 9),
    "Small": ("struct Small", "MESSAGES", 18, 0),
    "Empty": ("struct Empty", "MESSAGES", 18, 0),
    "Large": ("struct Large", "MESSAGES", 18, 0),
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
    lines, table = ['#define PACKAGE "layouts"'], []
    for message, fields in MESSAGES.items():
        lines.append(f"struct {message} {{")
        rows = []
        for index, (type_, shape) in enumerate(fields):
            c_type, sequence, kind, bound = TYPES[type_]
            brackets, array, count, upper = SHAPES[shape]
            one = (
                f"{sequence}({c_type}) f{index}"
                if brackets is None
                else f"{c_type} f{index}{brackets}"
            )
            lines.append(f"  {one};")
            offset = f"offsetof(struct {message}, f{index})"
            rows.append(f'  {{"f{index}", {kind}, {bound}, {array}, {count}, {upper}, {offset}}},')
        if not fields:
            lines.append("  uint8_t dummy;")
            rows.append(f'  {{"{DUMMY}", 8, 0, 0, 0, 0, 0}},')
        lines += ["};", f"static const Expected {message}_fields[] = {{", *rows, "};"]
        table.append(f'{{"{message}", sizeof(struct {message}), {message}_fields, {len(rows)}}}')
    row = "struct { const char *name; size_t size; const Expected *fields; uint32_t count; }"
    return "\n".join([*lines, f"static const {row} EXPECTED[] = {{", ",\n".join(table), "};\n"])


@pytest.fixture(scope="module")
def model():
    files = {
        f"msg/{message}.msg": "".join(
            f"{type_}{shape} f{index}\n" for index, (type_, shape) in enumerate(fields)
        )
        for message, fields in MESSAGES.items()
    }
    return model_of("layouts", files)


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("distribution", DEFINES)
def test_tables_are_what_the_compiler_says(distribution, compiler, model, tmp_path):
    language, identifier = COMPILERS[compiler]
    (tmp_path / "expected.h").write_text(c_text())
    words = ["-Wall", "-Werror", f"-I{tmp_path}", *(f"-D{one}" for one in DEFINES[distribution])]
    program = tmp_path / "layouts"
    source = Path(__file__).parent / "layouts.c"
    run(tool(compiler), *words, "-x", language, source, "-o", program, "-ldl")
    made = libraries(model, MACHINES[platform.machine()], LAYOUTS[distribution])
    library = tmp_path / f"liblayouts__{identifier}.so"
    library.write_bytes(made[library.name])
    run(program, library)


def test_all_distributions_are_tried():
    assert list(DEFINES) == list(LAYOUTS)
