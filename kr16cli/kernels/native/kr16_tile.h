/* What the generated kernels stand on: a tile of configurations, structure of arrays.
 *
 * The generated file is included twice: TILE 40 for batches (vectorised), TILE 1 for one call.
 */
#ifndef KR16_TILE_H
#define KR16_TILE_H

#include <math.h>

#include "kr16_math.h"

typedef void (*kr16_function)(const double *p, const double *x, double *y);

typedef struct {
    char kind; /* 't': angles that enter as rows of cosines, then sines; 'c': columns */
    int count;
} kr16_group;

typedef struct {
    const char *name;
    kr16_function run;
    int groups;
    kr16_group group[3];
    int width;      /* results per configuration */
    int guards;     /* further rows; any value but 0 says that the input is bad */
    int operations; /* arithmetic operations per configuration */
} kr16_kernel;

/* 40 lanes: rows are 5 cache lines apart, which spreads them over the sets of a cache. */
#define KR16_LANES 40

/* One version of a function per instruction set, chosen when the library is loaded. */
#ifdef KR16_CLONES
#define KR16_CLONES_OF __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define KR16_CLONES_OF
#endif

#endif
