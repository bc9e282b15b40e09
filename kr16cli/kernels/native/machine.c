/* What this machine can do at most, for `kr16 bench`: multiply-adds in registers, memory. */
#include "machine.h"

#include "kr16_tile.h"
#include "turn.h"

#define CHAINS 12 /* independent sums, more than the latency of a multiply-add needs */

KR16_CLONES_OF double kr16_multiply_adds(long rounds)
{
    kr16_lanes8 sum[CHAINS], factor;
    for (int k = 0; k < 8; k++)
        factor[k] = 0.999999 + 1e-9 * k;
    for (int i = 0; i < CHAINS; i++)
        sum[i] = factor * (double)i;
    for (long r = 0; r < rounds; r++)
        for (int i = 0; i < CHAINS; i++)
            sum[i] = sum[i] * factor + factor;
    double total = 0.0;
    for (int i = 0; i < CHAINS; i++)
        for (int k = 0; k < 8; k++)
            total += sum[i][k];
    return total;
}

double kr16_multiply_adds_flops(long rounds)
{
    return 2.0 * 8.0 * CHAINS * (double)rounds;
}

KR16_CLONES_OF double kr16_read(const double *from, ptrdiff_t count)
{
    double sum = 0.0;
#pragma omp simd reduction(+ : sum)
    for (ptrdiff_t i = 0; i < count; i++)
        sum += from[i];
    return sum;
}

void kr16_write(double *to, ptrdiff_t count)
{
    double ones[64];
    for (int i = 0; i < 64; i++)
        ones[i] = 1.0;
    for (ptrdiff_t i = 0; i + 64 <= count; i += 64)
        kr16_stream(ones, 64, to + i);
    kr16_stream_end();
}
