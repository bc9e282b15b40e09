/* Kernels over a tile whose lanes have each their own parameters. */
#include "kr16_tile.h"

#define TILE KR16_LANES
#define NAMED(name) kr16_own_##name
#define OMP_SIMD _Pragma("omp simd")
#define CLONES KR16_CLONES_OF

#include "kr16_own_kernels.inc"
