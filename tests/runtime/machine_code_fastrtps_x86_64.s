# The machine code of fastrtps.py for x86-64 (System V calling convention).

.intel_syntax noprefix
serialize:  # (memory, cdr) -> bool
  endbr64
  push rbx
  push rbp
  push r12
  push r13
  sub rsp, 24
  xor eax, eax
  mov rbx, [rip+spans]
  mov rbx, [rdi+rbx]  # size of all; address and size of each
  test rbx, rbx
  je 4f
  add rbx, [rip+content]
  mov r13, [rbx]  # bytes that are left
  add rbx, 8
5: mov rbp, [rip+position]
  add rbp, rsi
  mov r12, [rbp]  # where to write
  mov rdx, [rip+end]
  mov rdx, [rsi+rdx]
  sub rdx, r12
  cmp rdx, r13
  jb 3f
1: test r13, r13
  je 2f
  mov rdi, r12
  mov rsi, [rbx]
  mov rdx, [rbx+8]
  add r12, rdx
  sub r13, rdx
  call [rip+copy]
  add rbx, 16
  jmp 1b
2: mov [rbp], r12
  mov eax, 1
3: add rsp, 24
  pop r13
  pop r12
  pop rbp
  pop rbx
  ret
4: mov rdx, [rip+body]
  mov rdx, [rdi+rdx]
  test rdx, rdx
  je 3b
  mov rbx, [rip+length]
  mov r13, [rdx+rbx]
  sub r13, 4  # without the header
  add rdx, [rip+content]
  add rdx, 4
  mov [rsp], rdx  # one part
  mov [rsp+8], r13
  mov rbx, rsp
  jmp 5b

.balign 8
deserialize:  # (cdr, memory) -> bool
  endbr64
  push rbx
  mov rbx, rsi
  mov rax, [rip+position]
  mov rax, [rdi+rax]
  sub rax, 4  # the header is kept
  mov rsi, [rip+end]
  mov rsi, [rdi+rsi]
  sub rsi, rax
  mov rdi, rax
  call [rip+new_bytes]
  test rax, rax
  je 1f
  add rbx, [rip+received]
  mov rdi, [rbx]
  mov [rbx], rax
  call [rip+forget]
  mov eax, 1
  pop rbx
  ret
1: call [rip+clear_error]
  xor eax, eax
  pop rbx
  ret

.balign 8
serialized_size:  # (memory) -> size
  endbr64
  mov rax, [rip+spans]
  mov rax, [rdi+rax]
  test rax, rax
  je 1f
  add rax, [rip+content]
  mov rax, [rax]
  ret
1: mov rax, [rip+body]
  mov rax, [rdi+rax]
  test rax, rax
  je 2f
  mov rdx, [rip+length]
  mov rax, [rax+rdx]
  sub rax, 4
2: ret

.balign 8
maximum_size:  # (bounds) -> 0, and there is no maximum
  endbr64
  mov byte ptr [rdi], 0
  xor eax, eax
  ret

.balign 8
resolve:  # (handle, identifier) -> handle
  endbr64
  mov rdx, [rip+answers]
1: mov rax, [rdx]
  test rax, rax
  je 4f
  mov rcx, rsi
2: mov r8b, [rax]
  cmp r8b, [rcx]
  jne 3f
  inc rax
  inc rcx
  test r8b, r8b
  jne 2b
  mov rax, [rdx+8]
  ret
3: add rdx, 16
  jmp 1b
4: ret

.balign 8
create:  # () -> memory
  endbr64
  mov rdi, [rip+memory]
  jmp [rip+make]

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
