"""Programs of the system that tests need, for this machine and for others."""

import os
import platform
import shutil
import subprocess

import pytest

#: The Debian packages that have them; for another machine, those of compilers end in its name.
PACKAGES = {
    "as": "binutils",
    "cmake": "cmake",
    "eu-elflint": "elfutils",
    "g++": "g++",
    "gcc": "gcc",
    "git": "git",
    "ld": "binutils",
    "nm": "binutils",
    "objcopy": "binutils",
    "strip": "binutils",
    "patchelf": "patchelf",
    "qemu-aarch64": "qemu-user",
    "readelf": "binutils",
    "valgrind": "valgrind",
}
MACHINES = ("x86_64", "aarch64")


def is_foreign(machine):
    return platform.machine() != machine


def tool(name, machine=None):
    """Return the full name of a program that works for a machine; leave the test out without it."""
    foreign = machine is not None and is_foreign(machine)
    full = f"{machine}-linux-gnu-{name}" if foreign else name
    if not shutil.which(full):
        suffix = f"-{machine.replace('_', '-')}-linux-gnu" if foreign else ""
        lacks(full, PACKAGES[name] + suffix)
    return full


def lacks(what, package):
    """Leave a test out that needs what a Debian package has.

    It fails if TOOLS=yes says that nothing is left out, as in CI.
    """
    complain = pytest.fail if os.environ.get("TOOLS") == "yes" else pytest.skip
    complain(f"no {what}: install {package}")


def emulator(machine, *options):
    """Return the words by which programs for a machine are run."""
    if not is_foreign(machine):
        return []
    return [tool(f"qemu-{machine}"), "-L", f"/usr/{machine}-linux-gnu", *options]


def run(*words, **options):
    """Run a program that must succeed and has nothing to complain about; return what it says."""
    command = [str(word) for word in words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    assert done.returncode == 0, (command, done.stdout[-2000:], done.stderr)
    assert done.stderr == "", command
    return done.stdout


def assemble(machine, source, folder):
    """Return the object file of an assembler text, the code in it and its symbols' values."""
    made, code = folder / "code.o", folder / "code"
    run(tool("as", machine), source, "-o", made)
    run(tool("objcopy", machine), "-O", "binary", "-j", ".text", made, code)
    lines = run(tool("nm", machine), made).splitlines()
    symbols = dict(line.split()[::-2] for line in lines if len(line.split()) == 3)
    return made, code.read_bytes(), {name: int(value, 16) for name, value in symbols.items()}
