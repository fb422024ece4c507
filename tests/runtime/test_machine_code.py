"""The machine code of type support: it is what its text says, and it does what it should.

What the machine of the tests cannot assemble or run itself is left out, unless the tools for it
are there.
"""

import re
from pathlib import Path

import pytest

from idlc.runtime.c import linked
from tests.support.tools import MACHINES, assemble, emulator, is_foreign, run, tool

HERE = Path(__file__).parent


def text_of(kind, machine):
    return HERE / f"machine_code_{kind}_{machine}.s"


def words_of(kind, machine):
    text = text_of(kind, machine).read_text()
    return re.findall(r"^(\w+): \.quad 0$", text, re.MULTILINE)


@pytest.fixture(params=MACHINES)
def machine(request):
    return request.param


@pytest.fixture(params=["structs", "fastrtps"])
def kind(request):
    return request.param


def test_the_code_is_what_its_text_says(kind, machine, tmp_path):
    code, entries = linked(kind, machine)
    _, assembled, symbols = assemble(machine, text_of(kind, machine), tmp_path)
    assert {name: symbols[name] for name in entries} == entries
    assert assembled == code + bytes(8 * len(words_of(kind, machine)))


def test_all_machines_have_the_same_functions_and_words(kind):
    found = [(list(linked(kind, one)[1]), words_of(kind, one)) for one in MACHINES]
    assert found[0] == found[1]


def test_the_code_does_what_it_should(kind, machine, tmp_path):
    program, file = tmp_path / "program", tmp_path / "code"
    static = ["-static"] if is_foreign(machine) else []
    source = HERE / f"machine_code_{kind}.c"
    run(tool("gcc", machine), *static, "-Wall", "-Werror", source, "-o", program)
    code, entries = linked(kind, machine)
    file.write_bytes(code)
    entries.pop("empty", None)  # only the other functions call it
    run(*emulator(machine), program, file, *entries.values())
