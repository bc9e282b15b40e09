/* The kernels for one configuration: scalar code, lowest latency. */
#include "kr16_tile.h"

#define TILE 1
#define NAMED(name) kr16_single_##name
#define OMP_SIMD
#ifdef KR16_CLONES
#define CLONES __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define CLONES
#endif

#include "kr16_kernels.inc"
