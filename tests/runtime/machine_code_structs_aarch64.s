// The machine code of introspection.py for aarch64 (AAPCS64 calling convention).

empty:  // (memory, plan): free what the plan says, and leave it empty
  stp x29, x30, [sp, #-64]!
  stp x19, x20, [sp, #16]
  stp x21, x22, [sp, #32]
  stp x23, x24, [sp, #48]
  mov x29, sp
  mov x19, x0
  ldr x20, [x1], #8  // entries that are left
  mov x21, x1  // entry
1: cbz x20, 6f
  ldr x22, [x21]
  add x22, x22, x19  // field
  mov x23, x22  // element
  ldr x24, [x21, #8]  // elements that are left
  cbnz x24, 2f
  ldr x23, [x22]
  ldr x24, [x22, #16]
2: ldr x1, [x21, #24]
  cbz x1, 4f
3: cbz x24, 4f
  mov x0, x23
  ldr x1, [x21, #24]
  bl empty
  ldr x0, [x21, #16]
  add x23, x23, x0
  sub x24, x24, #1
  b 3b
4: ldr x0, [x21, #8]
  cbnz x0, 5f
  ldr x0, [x22]
  mov x1, #0
  ldr x16, deallocate
  blr x16
  stp xzr, xzr, [x22]
  str xzr, [x22, #16]
5: add x21, x21, #32
  sub x20, x20, #1
  b 1b
6: ldp x19, x20, [sp, #16]
  ldp x21, x22, [sp, #32]
  ldp x23, x24, [sp, #48]
  ldp x29, x30, [sp], #64
  ret

.balign 8
create:  // () -> memory, all zero
  hint #34
  mov x0, #1
  ldr x1, size
  mov x2, #0
  ldr x16, allocate
  br x16

.balign 8
destroy:  // (memory)
  hint #34
  stp x29, x30, [sp, #-32]!
  mov x29, sp
  str x0, [sp, #16]
  ldr x1, plan
  bl empty
  ldr x0, [sp, #16]
  ldp x29, x30, [sp], #32
  mov x1, #0
  ldr x16, deallocate
  br x16

.balign 8
convert_from_py:  // (message, memory) -> bool
  hint #34
  stp x29, x30, [sp, #-32]!
  mov x29, sp
  stp x0, x1, [sp, #16]
  mov x0, x1
  ldr x1, plan
  bl empty
  ldp x2, x1, [sp, #16]
  ldr x0, converter
  ldr x16, set_item
  blr x16
  cmp w0, #0
  cset w0, eq
  ldp x29, x30, [sp], #32
  ret

.balign 8
convert_to_py:  // (memory) -> message
  hint #34
  mov x1, x0
  ldr x0, converter
  ldr x16, get_item
  br x16

.balign 8
finish:  // (memory): free what it holds
  hint #34
  ldr x1, plan
  b empty

.balign 8
resize:  // (sequence, count) -> bool
  hint #34
  stp x29, x30, [sp, #-32]!
  mov x29, sp
  stp x0, x1, [sp, #16]
  ldr x1, sequence
  bl empty
  ldr x0, [sp, #24]
  cbz x0, 1f
  ldr x1, size
  mov x2, #0
  ldr x16, allocate
  blr x16
  cbz x0, 2f
  ldp x1, x2, [sp, #16]
  stp x0, x2, [x1]
  str x2, [x1, #16]
1: mov w0, #1
2: ldp x29, x30, [sp], #32
  ret

.balign 8
length:  // (sequence) -> size
  hint #34
  ldr x0, [x0, #8]
  ret

.balign 8
in_sequence:  // (sequence, index) -> element
  hint #34
  ldr x2, size
  ldr x0, [x0]
  madd x0, x1, x2, x0
  ret

.balign 8
in_array:  // (array, index) -> element
  hint #34
  ldr x2, size
  madd x0, x1, x2, x0
  ret

.balign 8
allocate: .quad 0
deallocate: .quad 0
set_item: .quad 0
get_item: .quad 0
converter: .quad 0
plan: .quad 0
sequence: .quad 0
size: .quad 0
