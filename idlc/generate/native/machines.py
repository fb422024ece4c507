"""The machine code of libraries, for each processor (by its ABI's calling convention)."""

from __future__ import annotations

from struct import pack, pack_into, unpack_from

from idlc.generate.native.elf import Machine


def _fill_x86_64(code: bytearray, at: int, address: int, target: int) -> None:
    """Fill the hole at `at` with the distance from the end of it."""
    pack_into("<i", code, at, target - address - 4)


X86_64 = Machine(
    number=62,
    relative=8,
    absolute=1,
    page=0x1000,
    # NT_GNU_PROPERTY_TYPE_0: GNU_PROPERTY_X86_FEATURE_1_AND is IBT and SHSTK
    properties=pack("<3I4s4I", 4, 16, 5, b"GNU", 0xC0000002, 4, 3, 0),
    # Assembled from tests/generate/native/code_x86_64.s.
    code={
        "resolve": (
            "f30f1efa4c8b4708498b104885d274214889f18a023a01751248ffc248ffc184"
            "c075f0498b4008488930c34983c010ebd731c0c366662e0f1f84000000000090"
        ),
        "same": "4889f18a023a01751148ffc248ffc184c075f04889374889f8c331c0c30f1f00",
        "knows": "f30f1efa488d1500000000e900000000",
        "get": "f30f1efa488d0500000000c30f1f4000",
        "refuse": "f30f1efa31c0c3660f1f840000000000",
        "unbounded": "f30f1efac6070031c0c3660f1f440000",
        "throw": "f30f1efa488d3d00000000ff250000000066662e0f1f8400000000000f1f4000",
        "nothing": "f30f1efac366662e0f1f840000000000",
    },
    # Where an address is missing in them, and of what.
    holes={
        "knows": {7: "identifier", 12: "function"},
        "get": {7: "target"},
        "throw": {7: "message", 13: "function"},
    },
    fill=_fill_x86_64,
)


def _fill_aarch64(code: bytearray, at: int, address: int, target: int) -> None:
    """Fill the instruction at `at`, as its kind wants it."""
    (word,) = unpack_from("<I", code, at)
    if word & 0x9F000000 == 0x90000000:  # adrp: by how many pages
        pages = (target >> 12) - (address >> 12)
        word |= (pages & 3) << 29 | (pages >> 2 & 0x7FFFF) << 5
    elif word & 0xFC000000 == 0x14000000:  # b: by how many instructions
        word |= target - address >> 2 & 0x3FFFFFF
    elif word & 0xFFC00000 == 0xF9400000:  # ldr: which word of the page
        word |= (target & 0xFFF) >> 3 << 10
    else:  # add: which byte of the page
        word |= (target & 0xFFF) << 10
    pack_into("<I", code, at, word)


AARCH64 = Machine(
    number=183,
    relative=1027,
    absolute=257,
    page=0x10000,
    # NT_GNU_PROPERTY_TYPE_0: GNU_PROPERTY_AARCH64_FEATURE_1_AND is BTI
    properties=pack("<3I4s4I", 4, 16, 5, b"GNU", 0xC0000000, 4, 1, 0),
    # Assembled from tests/generate/native/code_aarch64.s.
    code={
        "resolve": (
            "5f2403d5020440f9430040f9830100b4e40301aa6514403886144038bf00066b"
            "a100005485ffff35400440f9010000f9c0035fd642400091f4ffff17000080d2"
            "c0035fd61f2003d51f2003d51f2003d5"
        ),
        "same": (
            "e40301aa4514403886144038bf00066b8100005485ffff35010000f9c0035fd6"
            "000080d2c0035fd61f2003d51f2003d5"
        ),
        "knows": "5f2403d5020000904200009100000014",
        "get": "5f2403d50000009000000091c0035fd6",
        "refuse": "5f2403d5000080d2c0035fd61f2003d5",
        "unbounded": "5f2403d51f000039000080d2c0035fd6",
        "throw": "5f2403d5000000900000009110000090100240f900021fd61f2003d51f2003d5",
        "nothing": "5f2403d5c0035fd61f2003d51f2003d5",
    },
    # Where an address is missing in them, and of what.
    holes={
        "knows": {4: "identifier", 8: "identifier", 12: "function"},
        "get": {4: "target", 8: "target"},
        "throw": {4: "message", 8: "message", 12: "function", 16: "function"},
    },
    fill=_fill_aarch64,
)
