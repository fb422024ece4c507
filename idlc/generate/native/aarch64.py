"""AArch64: the machine code of a library (the ABI's calling convention)."""

from __future__ import annotations

from struct import pack, pack_into, unpack_from

from idlc.generate.native.elf import Machine

TEXT = """
resolve:  // (handle, identifier) -> the handle that the table at handle->data has for it, or NULL
  hint #34  // bti c
  ldr x2, [x0, #8]  // entry
1: ldr x3, [x2]
  cbz x3, 4f
  mov x4, x1
2: ldrb w5, [x3], #1
  ldrb w6, [x4], #1
  cmp w5, w6
  b.ne 3f
  cbnz w5, 2b
  ldr x0, [x2, #8]
  str x1, [x0]  // who asked may compare pointers
  ret
3: add x2, x2, #16
  b 1b
4: mov x0, #0
  ret

.balign 16
same:  // (handle, identifier, the handle's own identifier) -> the handle, or NULL
  mov x4, x1
1: ldrb w5, [x2], #1
  ldrb w6, [x4], #1
  cmp w5, w6
  b.ne 2f
  cbnz w5, 1b
  str x1, [x0]
  ret
2: mov x0, #0
  ret

.balign 16
knows:  // (handle, identifier) -> the handle, or NULL
  hint #34
  adrp x2, identifier
  add x2, x2, :lo12:identifier
  b function

.balign 16
get:  // () -> what this copy of the function stands for
  hint #34
  adrp x0, target
  add x0, x0, :lo12:target
  ret

.balign 16
refuse:  // () -> false, or 0
  hint #34
  mov x0, #0
  ret

.balign 16
unbounded:  // (char *bounds) -> size
  hint #34
  strb wzr, [x0]
  mov x0, #0
  ret

.balign 16
throw:  // (): goes on in a function that throws, and so needs no table for unwinding
  hint #34
  adrp x0, message
  add x0, x0, :lo12:message
  adrp x16, function
  ldr x16, [x16, :lo12:function]
  br x16

.balign 16
nothing:  // ()
  hint #34
  ret
.balign 16
"""

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
    text=TEXT,
    code=CODE,
    entries=ENTRIES,
    holes=HOLES,
    fill=_fill,
)
