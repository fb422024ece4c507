"""x86-64: the machine code of a library (System V calling convention)."""

from __future__ import annotations

from struct import pack, pack_into

from idlc.generate.native.elf import Machine

#: Assembled from tests/generate/native/code_x86_64.s.
CODE = bytes.fromhex(
    # resolve
    "f30f1efa4c8b4708498b104885d274214889f18a023a01751248ffc248ffc184"
    "c075f0498b4008488930c34983c010ebd731c0c366662e0f1f84000000000090"
    # same
    "4889f18a023a01751148ffc248ffc184c075f04889374889f8c331c0c30f1f00"
    # knows
    "f30f1efa488d1500000000e900000000"
    # get
    "f30f1efa488d0500000000c30f1f4000"
    # refuse
    "f30f1efa31c0c3660f1f840000000000"
    # unbounded
    "f30f1efac6070031c0c3660f1f440000"
    # throw
    "f30f1efa488d3d00000000ff250000000066662e0f1f8400000000000f1f4000"
    # nothing
    "f30f1efac366662e0f1f840000000000"
)

#: Where each function begins.
ENTRIES = {
    "resolve": 0x0,
    "same": 0x40,
    "knows": 0x60,
    "get": 0x70,
    "refuse": 0x80,
    "unbounded": 0x90,
    "throw": 0xA0,
    "nothing": 0xC0,
}

#: Where an address is missing, and of what.
HOLES = {
    0x67: "identifier", 0x6C: "function", 0x77: "target", 0xA7: "message", 0xAD: "function",
}  # fmt: skip


def _fill(code: bytearray, at: int, address: int, target: int) -> None:
    """Fill the hole at `at` with the distance from the end of it."""
    pack_into("<i", code, at, target - address - 4)


MACHINE = Machine(
    number=62,
    relative=8,
    absolute=1,
    page=0x1000,
    # NT_GNU_PROPERTY_TYPE_0: GNU_PROPERTY_X86_FEATURE_1_AND is IBT and SHSTK
    properties=pack("<3I4s4I", 4, 16, 5, b"GNU", 0xC0000002, 4, 3, 0),
    code=CODE,
    entries=ENTRIES,
    holes=HOLES,
    fill=_fill,
)
