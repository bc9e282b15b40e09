/* The kernels for one configuration: plain scalar code, lowest latency. */
#include "kr16_tile.h"

#define TILE 1
#define NAMED(name) kr16_single_##name
#define OMP_SIMD
#define CLONES

#include "kr16_kernels.inc"
