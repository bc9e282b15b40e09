/* Running a kernel over a batch: tiles, threads, finite checks. No Python here. */
#ifndef KR16_BATCH_H
#define KR16_BATCH_H

#include <stddef.h>

#include "kr16_tile.h"

extern const kr16_kernel kr16_batch_kernels[];
extern const kr16_kernel kr16_single_kernels[];
extern const int kr16_parameter_count;

/* Rows a tile has room for; the module refuses to load if a kernel needs more. */
#define KR16_MAX_ROWS 32     /* inputs: twice the angles, and the columns */
#define KR16_MAX_RESULTS 224 /* results and guards */

enum kr16_verdict { KR16_FINE = 0, KR16_BAD_INPUT = 1 };

/* Inputs are row-major (n, count); NULL stands for zeros (angles) in a group. Results are
 * row-major (n, width). Returns KR16_BAD_INPUT where a number is not finite or a guard speaks;
 * what was written to `out` is then void. */
int kr16_run(int kernel, const double *parameters, const double *const *inputs, ptrdiff_t n,
             double *out, int threads);

/* The same for one configuration. */
int kr16_run_one(int kernel, const double *parameters, const double *const *inputs, double *out);

#endif
