# The machine code of introspection.py for x86-64 (System V calling convention).

.intel_syntax noprefix
empty:  # (memory, plan): free what the plan says, and leave it empty
  push rbx
  push rbp
  push r12
  push r13
  push r14
  push r15
  sub rsp, 8
  mov r12, rdi
  mov rbx, [rsi]  # entries that are left
  lea rbp, [rsi+8]  # entry
1: test rbx, rbx
  je 6f
  mov r13, [rbp]
  add r13, r12  # field
  mov r15, r13  # element
  mov r14, [rbp+8]  # elements that are left
  test r14, r14
  jne 2f
  mov r15, [r13]
  mov r14, [r13+16]
2: cmp qword ptr [rbp+24], 0
  je 4f
3: test r14, r14
  je 4f
  mov rdi, r15
  mov rsi, [rbp+24]
  call empty
  add r15, [rbp+16]
  dec r14
  jmp 3b
4: cmp qword ptr [rbp+8], 0
  jne 5f
  mov rdi, [r13]
  xor esi, esi
  call [rip+deallocate]
  xor eax, eax
  mov [r13], rax
  mov [r13+8], rax
  mov [r13+16], rax
5: add rbp, 32
  dec rbx
  jmp 1b
6: add rsp, 8
  pop r15
  pop r14
  pop r13
  pop r12
  pop rbp
  pop rbx
  ret

.balign 8
create:  # () -> memory, all zero
  endbr64
  mov edi, 1
  mov rsi, [rip+size]
  xor edx, edx
  jmp [rip+allocate]

.balign 8
destroy:  # (memory)
  endbr64
  push rbx
  mov rbx, rdi
  mov rsi, [rip+plan]
  call empty
  mov rdi, rbx
  pop rbx
  xor esi, esi
  jmp [rip+deallocate]

.balign 8
convert_from_py:  # (message, memory) -> bool
  endbr64
  push rbx
  push rbp
  sub rsp, 8
  mov rbx, rdi
  mov rbp, rsi
  mov rdi, rsi
  mov rsi, [rip+plan]
  call empty
  mov rdi, [rip+converter]
  mov rsi, rbp
  mov rdx, rbx
  call [rip+set_item]
  test eax, eax
  sete al
  add rsp, 8
  pop rbp
  pop rbx
  ret

.balign 8
convert_to_py:  # (memory) -> message
  endbr64
  mov rsi, rdi
  mov rdi, [rip+converter]
  jmp [rip+get_item]

.balign 8
finish:  # (memory): free what it holds
  endbr64
  mov rsi, [rip+plan]
  jmp empty

.balign 8
resize:  # (sequence, count) -> bool
  endbr64
  push rbx
  push rbp
  sub rsp, 8
  mov rbx, rdi
  mov rbp, rsi
  mov rsi, [rip+sequence]
  call empty
  mov eax, 1
  test rbp, rbp
  je 1f
  mov rdi, rbp
  mov rsi, [rip+size]
  xor edx, edx
  call [rip+allocate]
  test rax, rax
  je 1f
  mov [rbx], rax
  mov [rbx+8], rbp
  mov [rbx+16], rbp
  mov eax, 1
1: add rsp, 8
  pop rbp
  pop rbx
  ret

.balign 8
length:  # (sequence) -> size
  endbr64
  mov rax, [rdi+8]
  ret

.balign 8
in_sequence:  # (sequence, index) -> element
  endbr64
  mov rax, [rip+size]
  imul rax, rsi
  add rax, [rdi]
  ret

.balign 8
in_array:  # (array, index) -> element
  endbr64
  mov rax, [rip+size]
  imul rax, rsi
  add rax, rdi
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
