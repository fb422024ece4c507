"""Structures that nobody would write: made at random, by a seed."""

from tests.support import plain_cdr

PRIMITIVES = list(plain_cdr.CODES)
NUMERIC = [name for name in PRIMITIVES if "int" in name or "float" in name]
#: What generated code calls its own variables, what Python has, and what is long.
NAMES = [
    *("array", "at", "again", "bytes", "chars", "count", "data", "decode", "encode", "end", "each"),
    *("encapsulation", "ended", "item", "item_2", "item_values", "join", "len", "limit", "list"),
    *("listed", "low", "message", "object", "order", "pad4", "pad8", "parts", "put", "raw", "rows"),
    *("range", "read_1", "reading", "rows_1", "self", "size", "sized", "small", "str", "strings"),
    *("struct", "text", "to_str", "type", "values", "view", "words", "write_1", "write_rows"),
    *("unsized", "memoryview", "value_error", "f0_count", "f0_size", "f0_rows", "f0_block", "f0"),
    *(f"x{chr(97 + length % 26) * length}" for length in (31, 47, 52, 53, 60, 90)),
]
PER_SEED = 6


def random_package(rng):
    """Return texts by path and shapes by name of structures that nest in each other."""
    files, shapes = {}, {}
    texts = []  # structures of hardly anything but strings, which have a way of their own
    for index in range(PER_SEED):
        lines, shape = [], []
        others = ["string", "string", "char", *texts, *texts]
        if rng.random() < 0.4:
            texts.append(f"T{index}")
        else:
            others = [*PRIMITIVES, "string", "string", "wstring", *shapes, *shapes]
        names = NAMES if rng.random() < 0.5 else [f"f{number}" for number in range(300)]
        most = rng.choice([0, 1, 2, 3, 5, 9] if shapes else [0, 1, 2, 3, 5, 50])
        for name in rng.sample(names, most):
            element = rng.choice(others)
            suffix, size = rng.choice([("", 0), ("", 0), ("[]", None), ("[<=5]", None), ("[3]", 3)])
            if element in NUMERIC and rng.random() < 0.05:
                suffix, size = ("[1040]", 1040)  # larger than what goes through a Struct
            lines.append(f"{element}{suffix} {name}\n")
            type_ = shapes.get(element, element)
            shape.append((name, (type_, size) if suffix else type_))
        files[f"msg/T{index}.msg"] = "".join(lines)
        shapes[f"T{index}"] = shape
    return files, shapes
