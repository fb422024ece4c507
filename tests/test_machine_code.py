"""The machine code of type support: it is what its text says, and it does what it should.

What the machine of the tests cannot assemble or run itself is left out, unless binutils, gcc and
qemu for it are there (Debian: binutils-aarch64-linux-gnu gcc-aarch64-linux-gnu qemu-user).
"""

import platform
import shutil
import subprocess
from pathlib import Path

import pytest

from idlc.runtime import typesupport_aarch64, typesupport_native, typesupport_x86_64

HERE = Path(__file__).parent
MACHINES = {"x86_64": typesupport_x86_64, "aarch64": typesupport_aarch64}


@pytest.fixture(params=MACHINES)
def machine(request):
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


def test_the_code_is_what_its_text_says(machine, tool, tmp_path):
    module = MACHINES[machine]
    (tmp_path / "code.s").write_text(module.TEXT)
    run(tool("as"), tmp_path / "code.s", "-o", tmp_path / "code.o")
    run(tool("objcopy"), "-O", "binary", tmp_path / "code.o", tmp_path / "code")
    code = (tmp_path / "code").read_bytes()
    words = typesupport_native.Words._fields
    assert code == module.CODE + bytes(8 * len(words))
    symbols = dict(line.split()[::-2] for line in run(tool("nm"), tmp_path / "code.o").splitlines())
    places = {name: int(symbols[name], 16) for name in (*module.ENTRIES, *words)}
    assert places == {
        **module.ENTRIES,
        **{name: len(module.CODE) + 8 * index for index, name in enumerate(words)},
    }
    assert list(module.ENTRIES) == list(typesupport_native.Functions._fields)


def test_the_code_does_what_it_should(machine, tool, tmp_path):
    module = MACHINES[machine]
    program, code = tmp_path / "program", tmp_path / "code"
    static = [] if platform.machine() == machine else ["-static"]
    run(tool("gcc"), *static, "-Wall", "-Werror", HERE / "machine_code.c", "-o", program)
    code.write_bytes(module.CODE)
    emulator = [] if platform.machine() == machine else [f"qemu-{machine}"]
    if emulator and not shutil.which(emulator[0]):
        pytest.skip(f"no {emulator[0]}")
    run(*emulator, program, code, *module.ENTRIES.values())
