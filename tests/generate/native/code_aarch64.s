// The machine code of the libraries for aarch64 (AAPCS64 calling convention).

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
