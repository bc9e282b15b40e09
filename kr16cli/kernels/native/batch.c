#include "batch.h"

#include <stdlib.h>
#include <string.h>

#ifndef _WIN32
#include <pthread.h>
#endif

#define LANES KR16_LANES
#define MAX_ROWS KR16_MAX_ROWS
#define MAX_RESULTS KR16_MAX_RESULTS
#define MAX_THREADS 64

void kr16_sincos_rows(const double *angles, double *rows, int count);

typedef double lanes4 __attribute__((vector_size(32), aligned(8)));
typedef long long pick4 __attribute__((vector_size(32)));

static inline void transpose4(const double *from, ptrdiff_t from_row, double *to, ptrdiff_t to_row)
{
    lanes4 a, b, c, d;
    memcpy(&a, from, sizeof a);
    memcpy(&b, from + from_row, sizeof b);
    memcpy(&c, from + 2 * from_row, sizeof c);
    memcpy(&d, from + 3 * from_row, sizeof d);
    const lanes4 ab0 = __builtin_shuffle(a, b, (pick4){0, 4, 2, 6});
    const lanes4 ab1 = __builtin_shuffle(a, b, (pick4){1, 5, 3, 7});
    const lanes4 cd0 = __builtin_shuffle(c, d, (pick4){0, 4, 2, 6});
    const lanes4 cd1 = __builtin_shuffle(c, d, (pick4){1, 5, 3, 7});
    a = __builtin_shuffle(ab0, cd0, (pick4){0, 1, 4, 5});
    b = __builtin_shuffle(ab1, cd1, (pick4){0, 1, 4, 5});
    c = __builtin_shuffle(ab0, cd0, (pick4){2, 3, 6, 7});
    d = __builtin_shuffle(ab1, cd1, (pick4){2, 3, 6, 7});
    memcpy(to, &a, sizeof a);
    memcpy(to + to_row, &b, sizeof b);
    memcpy(to + 2 * to_row, &c, sizeof c);
    memcpy(to + 3 * to_row, &d, sizeof d);
}

/* to[j][i] = from[i][j] for a (rows, columns) table; the strides are in numbers. */
KR16_CLONES_OF static void transpose(const double *restrict from, ptrdiff_t from_row, int rows,
                                     int columns, double *restrict to, ptrdiff_t to_row)
{
    int i = 0;
    for (; i + 4 <= rows; i += 4) {
        int j = 0;
        for (; j + 4 <= columns; j += 4)
            transpose4(from + i * from_row + j, from_row, to + j * to_row + i, to_row);
        for (; j < columns; j++)
            for (int k = i; k < i + 4; k++)
                to[j * to_row + k] = from[k * from_row + j];
    }
    for (; i < rows; i++)
        for (int j = 0; j < columns; j++)
            to[j * to_row + i] = from[i * from_row + j];
}

/* Sum of v - v over the numbers: 0 if all are finite, else NaN. */
KR16_CLONES_OF static double finite_check(const double *v, ptrdiff_t n)
{
    double sum = 0.0;
#pragma omp simd reduction(+ : sum)
    for (ptrdiff_t i = 0; i < n; i++)
        sum += v[i] - v[i];
    return sum;
}

KR16_CLONES_OF static int beyond_trig_limit(const double *v, int n)
{
    int beyond = 0;
#pragma omp simd reduction(| : beyond)
    for (int i = 0; i < n; i++)
        beyond |= fabs(v[i]) > KR16_TRIG_LIMIT;
    return beyond;
}

/* Rows of a group for the tile that starts at configuration `lo`; lanes beyond the batch repeat
 * its last configuration. */
static void gather(const double *source, int count, ptrdiff_t lo, int lanes, double *rows)
{
    const double *last = source + (lo + lanes - 1) * count;
    transpose(source + lo * count, count, lanes, count, rows, LANES);
    for (int i = lanes; i < LANES; i++)
        for (int j = 0; j < count; j++)
            rows[j * LANES + i] = last[j];
}

static void trig_rows(const double *angles, int count, double *rows)
{
    if (!beyond_trig_limit(angles, count * LANES)) {
        kr16_sincos_rows(angles, rows, count);
        return;
    }
    for (int i = 0; i < count * LANES; i++) {
        rows[i] = cos(angles[i]);
        rows[count * LANES + i] = sin(angles[i]);
    }
}

static int load(const kr16_kernel *k, const double *const *inputs, ptrdiff_t lo, int lanes,
                double *x)
{
    double angles[6 * LANES];
    for (int g = 0; g < k->groups; g++) {
        const int count = k->group[g].count;
        const int trig = k->group[g].kind == 't';
        if (inputs[g] == NULL) {
            for (int i = 0; i < count * LANES; i++) {
                x[i] = 1.0;
                x[count * LANES + i] = 0.0;
            }
        } else {
            if (!(finite_check(inputs[g] + lo * count, (ptrdiff_t)lanes * count) == 0.0))
                return KR16_BAD_INPUT;
            gather(inputs[g], count, lo, lanes, trig ? angles : x);
            if (trig)
                trig_rows(angles, count, x);
        }
        x += (trig ? 2 : 1) * count * LANES;
    }
    return KR16_FINE;
}

static int guarded(const double *rows, int count)
{
    double sum = 0.0;
    for (int i = 0; i < count * LANES; i++)
        sum += rows[i];
    return sum == 0.0 ? KR16_FINE : KR16_BAD_INPUT;
}

static int run_range(const kr16_kernel *k, const double *p, const double *const *inputs,
                     ptrdiff_t lo, ptrdiff_t hi, double *out)
{
    _Alignas(64) double x[MAX_ROWS * LANES];
    _Alignas(64) double y[MAX_RESULTS * LANES];
    int verdict = KR16_FINE;
    for (; lo < hi && verdict == KR16_FINE; lo += LANES) {
        const int lanes = hi - lo < LANES ? (int)(hi - lo) : LANES;
        verdict = load(k, inputs, lo, lanes, x);
        if (verdict != KR16_FINE)
            break;
        k->run(p, x, y);
        verdict = guarded(y + k->width * LANES, k->guards);
        transpose(y, LANES, k->width, lanes, out + lo * k->width, k->width);
    }
    return verdict;
}

#ifndef _WIN32
typedef struct {
    const kr16_kernel *k;
    const double *p;
    const double *const *inputs;
    ptrdiff_t lo, hi;
    double *out;
    int verdict;
    pthread_t thread;
} share;

static void *run_share(void *pointer)
{
    share *s = pointer;
    s->verdict = run_range(s->k, s->p, s->inputs, s->lo, s->hi, s->out);
    return NULL;
}

static int run_threads(const kr16_kernel *k, const double *p, const double *const *inputs,
                       ptrdiff_t n, double *out, int threads)
{
    share shares[MAX_THREADS];
    int started = 0, verdict = KR16_FINE;
    const ptrdiff_t tiles = (n + LANES - 1) / LANES;
    for (int i = 0; i < threads; i++) {
        ptrdiff_t lo = tiles * i / threads * LANES, hi = tiles * (i + 1) / threads * LANES;
        shares[i] = (share){k, p, inputs, lo, hi < n ? hi : n, out, KR16_FINE, 0};
    }
    for (int i = 1; i < threads; i++) {
        if (pthread_create(&shares[i].thread, NULL, run_share, &shares[i]) != 0)
            break;
        started = i;
    }
    run_share(&shares[0]);
    for (int i = started + 1; i < threads; i++)
        run_share(&shares[i]);
    for (int i = 1; i <= started; i++)
        pthread_join(shares[i].thread, NULL);
    for (int i = 0; i < threads; i++)
        verdict |= shares[i].verdict;
    return verdict;
}
#endif

int kr16_run(int kernel, const double *p, const double *const *inputs, ptrdiff_t n, double *out,
             int threads)
{
    const kr16_kernel *k = &kr16_batch_kernels[kernel];
    const ptrdiff_t tiles = (n + LANES - 1) / LANES;
    if (threads > MAX_THREADS)
        threads = MAX_THREADS;
    if (threads > tiles)
        threads = (int)tiles;
#ifndef _WIN32
    if (threads > 1)
        return run_threads(k, p, inputs, n, out, threads);
#endif
    return run_range(k, p, inputs, 0, n, out);
}

int kr16_run_one(int kernel, const double *p, const double *const *inputs, double *out)
{
    const kr16_kernel *k = &kr16_single_kernels[kernel];
    double x[MAX_ROWS], y[MAX_RESULTS];
    double *at = x;
    for (int g = 0; g < k->groups; g++) {
        const int count = k->group[g].count;
        const double *source = inputs[g];
        if (source != NULL && !(finite_check(source, count) == 0.0))
            return KR16_BAD_INPUT;
        if (k->group[g].kind != 't') {
            memcpy(at, source, (size_t)count * sizeof *at);
            at += count;
            continue;
        }
        for (int j = 0; j < count; j++) {
            const double angle = source == NULL ? 0.0 : source[j];
            if (fabs(angle) <= KR16_TRIG_LIMIT) {
                kr16_sincos(angle, &at[count + j], &at[j]);
            } else {
                at[j] = cos(angle);
                at[count + j] = sin(angle);
            }
        }
        at += 2 * count;
    }
    k->run(p, x, y);
    for (int i = 0; i < k->guards; i++)
        if (y[k->width + i] != 0.0)
            return KR16_BAD_INPUT;
    memcpy(out, y, (size_t)k->width * sizeof *out);
    return KR16_FINE;
}
