/* The stack probe that compilers for Windows call in functions with large frames: it touches each
 * page in turn. Zig's own library has it, too, but adds 50 kB to a small DLL. */
#ifdef KR16_PROBE
#if defined(__x86_64__)
__asm__(".globl ___chkstk_ms\n"
        "___chkstk_ms:\n"
        "    pushq %rcx\n"
        "    pushq %rax\n"
        "    cmpq $0x1000, %rax\n"
        "    leaq 24(%rsp), %rcx\n"
        "    jb 1f\n"
        "2:  subq $0x1000, %rcx\n"
        "    testq %rcx, (%rcx)\n"
        "    subq $0x1000, %rax\n"
        "    cmpq $0x1000, %rax\n"
        "    ja 2b\n"
        "1:  subq %rax, %rcx\n"
        "    testq %rcx, (%rcx)\n"
        "    popq %rax\n"
        "    popq %rcx\n"
        "    retq\n");
#elif defined(__i386__)
/* Moves the stack pointer as well, by eax. */
__asm__(".globl __alloca\n"
        "__alloca:\n"
        "    pushl %ecx\n"
        "    cmpl $0x1000, %eax\n"
        "    leal 8(%esp), %ecx\n"
        "    jb 1f\n"
        "2:  subl $0x1000, %ecx\n"
        "    testl %ecx, (%ecx)\n"
        "    subl $0x1000, %eax\n"
        "    cmpl $0x1000, %eax\n"
        "    ja 2b\n"
        "1:  subl %eax, %ecx\n"
        "    testl %ecx, (%ecx)\n"
        "    leal 4(%esp), %eax\n"
        "    movl %ecx, %esp\n"
        "    movl -4(%eax), %ecx\n"
        "    pushl (%eax)\n"
        "    subl %esp, %eax\n"
        "    retl\n");
#endif
#endif

typedef int kr16_no_empty_file;
