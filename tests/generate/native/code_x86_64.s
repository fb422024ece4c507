# The machine code of the libraries for x86-64 (System V calling convention).

.intel_syntax noprefix
resolve:  # (handle, identifier) -> the handle that the table at handle->data has for it, or NULL
  endbr64
  mov r8, [rdi+8]  # entry
1: mov rdx, [r8]
  test rdx, rdx
  je 4f
  mov rcx, rsi
2: mov al, [rdx]
  cmp al, [rcx]
  jne 3f
  inc rdx
  inc rcx
  test al, al
  jne 2b
  mov rax, [r8+8]
  mov [rax], rsi  # who asked may compare pointers
  ret
3: add r8, 16
  jmp 1b
4: xor eax, eax
  ret

.balign 16
same:  # (handle, identifier, the handle's own identifier) -> the handle, or NULL
  mov rcx, rsi
1: mov al, [rdx]
  cmp al, [rcx]
  jne 2f
  inc rdx
  inc rcx
  test al, al
  jne 1b
  mov [rdi], rsi
  mov rax, rdi
  ret
2: xor eax, eax
  ret

.balign 16
knows:  # (handle, identifier) -> the handle, or NULL
  endbr64
  lea rdx, [rip+identifier]
  jmp function

.balign 16
get:  # () -> what this copy of the function stands for
  endbr64
  lea rax, [rip+target]
  ret

.balign 16
refuse:  # () -> false, or 0
  endbr64
  xor eax, eax
  ret

.balign 16
unbounded:  # (char *bounds) -> size
  endbr64
  mov byte ptr [rdi], 0
  xor eax, eax
  ret

.balign 16
throw:  # (): goes on in a function that throws, and so needs no table for unwinding
  endbr64
  lea rdi, [rip+message]
  jmp [rip+function]

.balign 16
nothing:  # ()
  endbr64
  ret
.balign 16
