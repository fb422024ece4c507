"""The machine code of type support: it is what its text says, and it does what it should.

What the machine of the tests cannot assemble or run itself is left out, unless the tools for it
are there.
"""

import re
from pathlib import Path

import pytest

from idlc.runtime.typesupport import (
    fastrtps_aarch64,
    fastrtps_x86_64,
    structs_aarch64,
    structs_x86_64,
)
from tests.support.tools import MACHINES, assemble, emulator, is_foreign, run, tool

HERE = Path(__file__).parent
MODULES = {
    ("structs", "x86_64"): structs_x86_64,
    ("structs", "aarch64"): structs_aarch64,
    ("fastrtps", "x86_64"): fastrtps_x86_64,
    ("fastrtps", "aarch64"): fastrtps_aarch64,
}


@pytest.fixture(params=MACHINES)
def machine(request):
    return request.param


@pytest.fixture(params=["structs", "fastrtps"])
def kind(request):
    return request.param


def test_the_code_is_what_its_text_says(kind, machine, tmp_path):
    module = MODULES[kind, machine]
    _, code, symbols = assemble(machine, module.TEXT, tmp_path)
    assert {name: symbols[name] for name in module.ENTRIES} == module.ENTRIES
    words = re.findall(r"^(\w+): \.quad 0$", module.TEXT, re.MULTILINE)
    assert code == module.CODE + bytes(8 * len(words))


def test_all_machines_have_the_same_functions_and_words(kind):
    found = [
        (list(module.ENTRIES), re.findall(r"^(\w+): \.quad 0$", module.TEXT, re.MULTILINE))
        for key, module in MODULES.items()
        if key[0] == kind
    ]
    assert found[0] == found[1]


def test_the_code_does_what_it_should(kind, machine, tmp_path):
    module = MODULES[kind, machine]
    program, code = tmp_path / "program", tmp_path / "code"
    static = ["-static"] if is_foreign(machine) else []
    source = HERE / f"machine_code_{kind}.c"
    run(tool("gcc", machine), *static, "-Wall", "-Werror", source, "-o", program)
    code.write_bytes(module.CODE)
    run(*emulator(machine), program, code, *module.ENTRIES.values())
