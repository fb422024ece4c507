"""The machine code of `memory` for x86-64 (System V calling convention).

`CODE` is what an assembler makes of `TEXT`, up to the words at its end. A test compares.
"""

TEXT = """
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
"""

CODE = bytes.fromhex(
    # empty
    "535541544155415641574883ec084989fc488b1e488d6e084885db74664c8b6d"
    "004d01e54d89ef4c8b75084d85f675084d8b7d004d8b751048837d1800741a4d"
    "85f674154c89ff488b7518e8b0ffffff4c037d1049ffceebe648837d0800751a"
    "498b7d0031f6ff156c01000031c04989450049894508498945104883c52048ff"
    "cbeb954883c408415f415e415d415c5d5bc3660f1f440000"
    # create
    "f30f1efabf01000000488b356001000031d2ff2520010000"
    # destroy
    "f30f1efa534889fb488b3539010000e83cffffff4889df5b31f6ff2508010000"
    # convert_from_py
    "f30f1efa53554883ec084889fb4889f54889f7488b350e010000e811ffffff48"
    "8b3dfa0000004889ee4889daff15de00000085c00f94c04883c4085d5bc36690"
    # convert_to_py
    "f30f1efa4889fe488b3dd2000000ff25c40000000f1f4000"
    # finish
    "f30f1efa488b35c5000000e9c8feffff"
    # resize
    "f30f1efa53554883ec084889fb4889f5488b35b1000000e8acfeffffb8010000"
    "004885ed74274889ef488b35a000000031d2ff15600000004885c07410488903"
    "48896b0848896b10b8010000004883c4085d5bc30f1f4000"
    # length
    "f30f1efa488b4708c30f1f8000000000"
    # in_sequence
    "f30f1efa488b055d000000480fafc6480307c30f1f440000"
    # in_array
    "f30f1efa488b0545000000480fafc64801f8c30f1f440000"
)

#: Where each function begins.
ENTRIES = {
    "create": 0x98,
    "destroy": 0xB0,
    "convert_from_py": 0xD0,
    "convert_to_py": 0x110,
    "finish": 0x128,
    "resize": 0x138,
    "length": 0x190,
    "in_sequence": 0x1A0,
    "in_array": 0x1B8,
}
