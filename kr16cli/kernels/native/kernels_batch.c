/* The kernels over a tile of 64 configurations, once per instruction set. */
#include "kr16_tile.h"

#define TILE KR16_LANES
#define NAMED(name) kr16_batch_##name
#define OMP_SIMD _Pragma("omp simd")
#define CLONES KR16_CLONES_OF

CLONES void kr16_sincos_rows(const double *angles, double *rows, int count)
{
    /* rows: `count` rows of cosines, then `count` rows of sines */
    OMP_SIMD
    for (int i = 0; i < count * TILE; i++)
        kr16_sincos(angles[i], &rows[count * TILE + i], &rows[i]);
}

#include "kr16_kernels.inc"

const int kr16_parameter_count = PARAMETER_COUNT;
