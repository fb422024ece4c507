// The machine code of fastrtps.py for aarch64 (AAPCS64 calling convention).

serialize:  // (memory, cdr) -> bool
  hint #34
  stp x29, x30, [sp, #-64]!
  stp x19, x20, [sp, #16]
  stp x21, x22, [sp, #32]
  mov x29, sp
  ldr x19, spans
  ldr x19, [x0, x19]  // size of all; address and size of each
  cbz x19, 4f
  ldr x2, content
  add x19, x19, x2
  ldr x22, [x19], #8  // bytes that are left
5: mov w0, #0
  ldr x20, position
  add x20, x20, x1
  ldr x21, [x20]  // where to write
  ldr x2, end
  ldr x2, [x1, x2]
  sub x2, x2, x21
  cmp x2, x22
  b.lo 3f
1: cbz x22, 2f
  mov x0, x21
  ldp x1, x2, [x19], #16
  add x21, x21, x2
  sub x22, x22, x2
  ldr x16, copy
  blr x16
  b 1b
2: str x21, [x20]
  mov w0, #1
3: ldp x19, x20, [sp, #16]
  ldp x21, x22, [sp, #32]
  ldp x29, x30, [sp], #64
  ret
4: ldr x2, body
  ldr x2, [x0, x2]
  mov w0, #0
  cbz x2, 3b
  ldr x3, length
  ldr x22, [x2, x3]
  sub x22, x22, #4  // without the header
  ldr x3, content
  add x2, x2, x3
  add x2, x2, #4
  add x19, sp, #48
  stp x2, x22, [x19]  // one part
  b 5b

.balign 8
deserialize:  // (cdr, memory) -> bool
  hint #34
  stp x29, x30, [sp, #-32]!
  str x19, [sp, #16]
  mov x29, sp
  mov x19, x1
  ldr x2, position
  ldr x2, [x0, x2]
  sub x2, x2, #4  // the header is kept
  ldr x1, end
  ldr x1, [x0, x1]
  sub x1, x1, x2
  mov x0, x2
  ldr x16, new_bytes
  blr x16
  cbz x0, 1f
  ldr x2, received
  add x19, x19, x2
  ldr x1, [x19]
  str x0, [x19]
  mov x0, x1
  ldr x16, forget
  blr x16
  mov w0, #1
  b 2f
1: ldr x16, clear_error
  blr x16
  mov w0, #0
2: ldr x19, [sp, #16]
  ldp x29, x30, [sp], #32
  ret

.balign 8
serialized_size:  // (memory) -> size
  hint #34
  ldr x1, spans
  ldr x1, [x0, x1]
  cbz x1, 1f
  ldr x0, content
  ldr x0, [x1, x0]
  ret
1: ldr x1, body
  ldr x0, [x0, x1]
  cbz x0, 2f
  ldr x1, length
  ldr x0, [x0, x1]
  sub x0, x0, #4
2: ret

.balign 8
maximum_size:  // (bounds) -> 0, and there is no maximum
  hint #34
  strb wzr, [x0]
  mov x0, #0
  ret

.balign 8
resolve:  // (handle, identifier) -> handle
  hint #34
  ldr x2, answers
1: ldr x3, [x2]
  cbz x3, 4f
  mov x4, x1
2: ldrb w5, [x3], #1
  ldrb w6, [x4], #1
  cmp w5, w6
  b.ne 3f
  cbnz w5, 2b
  ldr x0, [x2, #8]
  ret
3: add x2, x2, #16
  b 1b
4: mov x0, #0
  ret

.balign 8
create:  // () -> memory
  hint #34
  ldr x0, memory
  ldr x16, make
  br x16

.balign 8
copy: .quad 0
new_bytes: .quad 0
forget: .quad 0
clear_error: .quad 0
position: .quad 0
end: .quad 0
spans: .quad 0
received: .quad 0
content: .quad 0
body: .quad 0
length: .quad 0
answers: .quad 0
memory: .quad 0
make: .quad 0
