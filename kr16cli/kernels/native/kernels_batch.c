/* The kernels over a tile of configurations, once per instruction set. */
#include "kr16_tile.h"

#define TILE KR16_LANES
#define NAMED(name) kr16_batch_##name
#define OMP_SIMD _Pragma("omp simd")
#define CLONES KR16_CLONES_OF

/* `count` rows of cosines, then of sines; not 0 if an angle is beyond the range of
 * kr16_sincos, or no number: then they are void. */
CLONES int kr16_sincos_rows(const double *angles, double *rows, int count)
{
    double beyond = 0.0;
    _Pragma("omp simd reduction(+ : beyond)")
    for (int i = 0; i < count * TILE; i++) {
        beyond += fabs(angles[i]) <= KR16_TRIG_LIMIT ? 0.0 : 1.0;
        kr16_sincos(angles[i], &rows[count * TILE + i], &rows[i]);
    }
    return beyond != 0.0;
}

#include "kr16_kernels.inc"

const int kr16_parameter_count = PARAMETER_COUNT;
