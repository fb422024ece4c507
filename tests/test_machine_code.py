"""The machine code of type support: it is what its text says, and it does what it should.

What the machine of the tests cannot assemble or run itself is left out, unless binutils, gcc and
qemu for it are there (Debian: binutils-aarch64-linux-gnu gcc-aarch64-linux-gnu qemu-user).
"""

import platform
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from idlc.runtime import (
    typesupport_fastrtps_aarch64,
    typesupport_fastrtps_x86_64,
    typesupport_structs_aarch64,
    typesupport_structs_x86_64,
)

HERE = Path(__file__).parent
MODULES = {
    ("structs", "x86_64"): typesupport_structs_x86_64,
    ("structs", "aarch64"): typesupport_structs_aarch64,
    ("fastrtps", "x86_64"): typesupport_fastrtps_x86_64,
    ("fastrtps", "aarch64"): typesupport_fastrtps_aarch64,
}


@pytest.fixture(params=["x86_64", "aarch64"])
def machine(request):
    return request.param


@pytest.fixture(params=["structs", "fastrtps"])
def road(request):
    return request.param


@pytest.fixture
def tool(machine):
    """Return the full name of one of the tools for a machine; skip without."""

    def find(name):
        foreign = platform.machine() != machine
        full = f"{machine}-linux-gnu-{name}" if foreign else name
        if not shutil.which(full):
            pytest.skip(f"no {full}")
        return full

    return find


def run(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_code_is_what_its_text_says(road, machine, tool, tmp_path):
    module = MODULES[road, machine]
    (tmp_path / "code.s").write_text(module.TEXT)
    run(tool("as"), tmp_path / "code.s", "-o", tmp_path / "code.o")
    run(tool("objcopy"), "-O", "binary", tmp_path / "code.o", tmp_path / "code")
    code = (tmp_path / "code").read_bytes()
    symbols = dict(line.split()[::-2] for line in run(tool("nm"), tmp_path / "code.o").splitlines())
    assert {name: int(symbols[name], 16) for name in module.ENTRIES} == module.ENTRIES
    words = re.findall(r"^(\w+): \.quad 0$", module.TEXT, re.MULTILINE)
    assert code == module.CODE + bytes(8 * len(words))


def test_all_machines_have_the_same_functions_and_words(road):
    found = [
        (list(module.ENTRIES), re.findall(r"^(\w+): \.quad 0$", module.TEXT, re.MULTILINE))
        for key, module in MODULES.items()
        if key[0] == road
    ]
    assert found[0] == found[1]


def test_the_code_does_what_it_should(road, machine, tool, tmp_path):
    module = MODULES[road, machine]
    program, code = tmp_path / "program", tmp_path / "code"
    static = [] if platform.machine() == machine else ["-static"]
    source = HERE / f"machine_code_{road}.c"
    run(tool("gcc"), *static, "-Wall", "-Werror", source, "-o", program)
    code.write_bytes(module.CODE)
    emulator = [] if platform.machine() == machine else [f"qemu-{machine}"]
    if emulator and not shutil.which(emulator[0]):
        pytest.skip(f"no {emulator[0]}")
    run(*emulator, program, code, *module.ENTRIES.values())
