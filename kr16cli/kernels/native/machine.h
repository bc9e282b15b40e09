/* Measures of the machine; see machine.c. */
#ifndef KR16_MACHINE_H
#define KR16_MACHINE_H

#include <stddef.h>

/* Multiply-adds on numbers in registers; how many operations `rounds` are (an add counts, too). */
double kr16_multiply_adds(long rounds);
double kr16_multiply_adds_flops(long rounds);

/* Read numbers (their sum), and write ones past the caches; `to` is aligned to 16 bytes. */
double kr16_read(const double *from, ptrdiff_t count);
void kr16_write(double *to, ptrdiff_t count);

#endif
