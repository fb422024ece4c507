"""AArch64: the machine code of a library (the ABI's calling convention)."""

from __future__ import annotations

from struct import pack, pack_into, unpack_from

from idlc.generate.native.elf import Machine

#: Assembled from tests/generate/native/code_aarch64.s.
CODE = bytes.fromhex(
    # resolve
    "5f2403d5020440f9430040f9830100b4e40301aa6514403886144038bf00066b"
    "a100005485ffff35400440f9010000f9c0035fd642400091f4ffff17000080d2"
    "c0035fd61f2003d51f2003d51f2003d5"
    # same
    "e40301aa4514403886144038bf00066b8100005485ffff35010000f9c0035fd6"
    "000080d2c0035fd61f2003d51f2003d5"
    # knows
    "5f2403d5020000904200009100000014"
    # get
    "5f2403d50000009000000091c0035fd6"
    # refuse
    "5f2403d5000080d2c0035fd61f2003d5"
    # unbounded
    "5f2403d51f000039000080d2c0035fd6"
    # throw
    "5f2403d5000000900000009110000090100240f900021fd61f2003d51f2003d5"
    # nothing
    "5f2403d5c0035fd61f2003d51f2003d5"
)

#: Where each function begins.
ENTRIES = {
    "resolve": 0x0,
    "same": 0x50,
    "knows": 0x80,
    "get": 0x90,
    "refuse": 0xA0,
    "unbounded": 0xB0,
    "throw": 0xC0,
    "nothing": 0xE0,
}

#: Where an address is missing, and of what.
HOLES = {
    0x84: "identifier", 0x88: "identifier", 0x8C: "function", 0x94: "target", 0x98: "target",
    0xC4: "message", 0xC8: "message", 0xCC: "function", 0xD0: "function",
}  # fmt: skip


def _fill(code: bytearray, at: int, address: int, target: int) -> None:
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


MACHINE = Machine(
    number=183,
    relative=1027,
    absolute=257,
    page=0x10000,
    # NT_GNU_PROPERTY_TYPE_0: GNU_PROPERTY_AARCH64_FEATURE_1_AND is BTI
    properties=pack("<3I4s4I", 4, 16, 5, b"GNU", 0xC0000000, 4, 1, 0),
    code=CODE,
    entries=ENTRIES,
    holes=HOLES,
    fill=_fill,
)
