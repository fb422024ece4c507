"""The machine code of the libraries for C++ tools is what its assembler text says."""

import ast
import re
import subprocess
from pathlib import Path

import pytest

import idlc.generate.native
from idlc.generate.native.library import MACHINES as MADE_FOR
from tests.support.tools import MACHINES, assemble, run, tool

HERE = Path(__file__).parent

#: Where code lies and what it refers to; within the smallest reach that a machine has.
PLACES = [(0x10000, 0x20000), (0x12340, 0x11008), (0x7654320, 0x0), (0x0, 0x7FFF000)]

#: The instruction at which code may be entered through a pointer: endbr64, bti c.
PADS = {"x86_64": "f30f1efa", "aarch64": "5f2403d5"}
#: Functions that others of the library jump to, and nobody else.
INNER = {"same"}
#: What a machine's module has besides the writer's code.
OF_A_MACHINE = {"CODE", "HOLES"}


@pytest.fixture(params=MACHINES)
def machine(request):
    return request.param


def parts_of(made):
    """Return all code, where each function begins, and the name of what is missing by place."""
    code, entries, holes = b"", {}, {}
    for name, digits in made.code.items():
        entries[name] = len(code)
        holes |= {len(code) + at: symbol for at, symbol in made.holes.get(name, {}).items()}
        code += bytes.fromhex(digits)
    return code, entries, holes


def test_the_code_is_what_its_text_says(machine, tmp_path):
    made = MADE_FOR[machine]
    _, code, symbols = assemble(machine, HERE / f"code_{machine}.s", tmp_path)
    ours, entries, holes = parts_of(made)
    assert code == ours
    assert {name: symbols[name] for name in entries} == entries
    relocations = run(tool("readelf"), "--relocs", "--wide", tmp_path / "code.o")
    relocated = re.findall(r"^0+([0-9a-f]+) .* R_\S+ +[0-9a-f]+ (\w+) ", relocations, re.MULTILINE)
    assert sorted((int(at, 16), name) for at, name in relocated) == sorted(holes.items())


@pytest.mark.parametrize(("here", "there"), PLACES)
def test_addresses_are_filled_in_as_a_linker_does(machine, here, there, tmp_path):
    made = MADE_FOR[machine]
    file, _, _ = assemble(machine, HERE / f"code_{machine}.s", tmp_path)
    ours, _, holes = parts_of(made)
    names = sorted(set(holes.values()))
    targets = {name: there + 8 * index for index, name in enumerate(names)}
    symbols = [f"--defsym={name}={target}" for name, target in targets.items()]
    linked, code = tmp_path / "linked", tmp_path / "linked.bin"
    options = [f"-Ttext={here:#x}", "-e0", "-o", linked]
    command = [tool("ld", machine), *options, *symbols, file]
    subprocess.run(command, check=True)
    run(tool("objcopy", machine), "-O", "binary", "-j", ".text", linked, code)
    filled = bytearray(ours)
    for at, name in holes.items():
        made.fill(filled, at, here + at, targets[name])
    assert filled.hex() == code.read_bytes().hex()


def test_all_machines_have_the_same_functions():
    parts = [parts_of(machine)[1:] for machine in MADE_FOR.values()]
    names = [(list(entries), sorted(set(holes.values()))) for entries, holes in parts]
    assert names[0] == names[1]


def test_functions_may_be_entered_through_pointers(machine):
    code = MADE_FOR[machine].code
    padded = {name for name, digits in code.items() if digits.startswith(PADS[machine])}
    assert padded == set(code) - INNER


def test_the_writer_is_small():
    count = 0
    for path in Path(idlc.generate.native.__file__).parent.glob("*.py"):
        lines = path.read_text(encoding="utf-8").splitlines()
        for node in reversed(ast.parse("\n".join(lines)).body):
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) in OF_A_MACHINE:
                del lines[node.lineno - 1 : node.end_lineno]
        count += sum(bool(line.strip()) for line in lines)
    assert 0 < count < 800
