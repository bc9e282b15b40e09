#include "batch.h"

#include <stdint.h>
#include <string.h>

#ifndef _WIN32
#include <pthread.h>
#endif

#include "turn.h"

#define LANES KR16_LANES
#define MAX_THREADS 64
#define WIDEST 16 /* numbers of a configuration in the widest input */

/* Results of this many numbers (2 MiB) and more go past the caches. */
#define STREAMED (1 << 18)

int kr16_sincos_rows(const double *angles, double *rows, int count);

/* A tile's rows of a group. The last tile is copied to `room`, where the batch's last configuration
 * is repeated to the end: what follows reads whole blocks, a little beyond the rows. */
static const double *whole_tile(const double *source, int count, int lanes, int last, double *room)
{
    if (!last)
        return source;
    memcpy(room, source, (size_t)(lanes * count) * sizeof *room);
    for (int i = lanes; i < LANES; i++)
        memcpy(room + i * count, source + (lanes - 1) * count, (size_t)count * sizeof *room);
    return room;
}

KR16_CLONES_OF static void to_columns(const double *rows, int count, double *columns)
{
    if (count == 6) /* a constant, so that the blocks are unrolled */
        kr16_to_columns(rows, 6, columns);
    else
        kr16_to_columns(rows, count, columns);
}

/* 0 if all numbers are finite. */
KR16_CLONES_OF static int not_finite(const double *v, int n)
{
    double sum = 0.0;
#pragma omp simd reduction(+ : sum)
    for (int i = 0; i < n; i++)
        sum += v[i] - v[i];
    return !(sum == 0.0);
}

/* Cosines, then sines, by the C library: for angles beyond the range of kr16_sincos. */
static void far_trig_rows(const double *angles, int count, double *rows)
{
    for (int i = 0; i < count * LANES; i++) {
        rows[i] = cos(angles[i]);
        rows[count * LANES + i] = sin(angles[i]);
    }
}

/* Ask for numbers that the next tile reads, spread over this tile's work: all at once they would
 * fill the queue to memory and stall it. */
static void fetch(const double *from, ptrdiff_t count)
{
#ifdef __GNUC__
    for (ptrdiff_t at = 0; at < count; at += 8)
        __builtin_prefetch(from + at);
#endif
}

static int load(const kr16_kernel *k, const double *const *inputs, ptrdiff_t lo, int lanes,
                int last, double *x)
{
    _Alignas(64) double room[LANES * WIDEST + KR16_BLOCK], angles[6 * LANES];
    for (int g = 0; g < k->groups; g++) {
        const int count = k->group[g].count;
        const int trig = k->group[g].kind == 't';
        if (inputs[g] == NULL) {
            for (int i = 0; i < count * LANES; i++) {
                x[i] = 1.0;
                x[count * LANES + i] = 0.0;
            }
        } else {
            const double *rows = whole_tile(inputs[g] + lo * count, count, lanes, last, room);
            to_columns(rows, count, trig ? angles : x);
            if (!last)
                fetch(rows + LANES * count, LANES * count);
            if (trig ? kr16_sincos_rows(angles, x, count) : not_finite(x, count * LANES)) {
                if (!trig || not_finite(angles, count * LANES))
                    return KR16_BAD_INPUT;
                far_trig_rows(angles, count, x);
            }
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

/* A tile's results as rows of the caller's array. */
KR16_CLONES_OF static void store(const double *y, int width, int lanes, double *out)
{
    _Alignas(64) double rows[KR16_BLOCK * KR16_MAX_RESULTS];
    for (int i = 0; i < lanes; i += KR16_BLOCK) {
        const int whole = i + KR16_BLOCK <= lanes;
        double *to = out + (ptrdiff_t)i * width;
        kr16_to_rows(y + i, width, whole ? to : rows);
        if (!whole)
            memcpy(to, rows, (size_t)((lanes - i) * width) * sizeof *to);
    }
}

/* The same past the caches, line by line; what a block leaves of a line waits for the next one.
 * The lines at both ends are shared with others and stored as usual: in parts they stream slowly. */
KR16_CLONES_OF static void store_past(const double *y, int width, int lanes, double *out)
{
    _Alignas(64) double rows[KR16_LINE + KR16_BLOCK * KR16_MAX_RESULTS];
    const ptrdiff_t ahead = -((uintptr_t)out / sizeof *out) % KR16_LINE;
    ptrdiff_t waiting = 0;
    for (int i = 0; i < lanes; i += KR16_BLOCK) {
        const int count = lanes - i < KR16_BLOCK ? lanes - i : KR16_BLOCK;
        const double *from = rows;
        kr16_to_rows(y + i, width, rows + waiting);
        waiting += (ptrdiff_t)count * width;
        if (i == 0) {
            const ptrdiff_t first = ahead < waiting ? ahead : waiting;
            memcpy(out, rows, (size_t)first * sizeof *out);
            from += first;
            out += first;
            waiting -= first;
        }
        const ptrdiff_t lines = waiting / KR16_LINE * KR16_LINE;
        kr16_stream(from, lines, out);
        out += lines;
        waiting -= lines;
        memmove(rows, from + lines, (size_t)waiting * sizeof *rows);
    }
    memcpy(out, rows, (size_t)waiting * sizeof *out);
}

static int run_range(const kr16_kernel *k, const double *p, const double *const *inputs,
                     ptrdiff_t lo, ptrdiff_t hi, int stream, double *out)
{
    _Alignas(64) double x[KR16_MAX_ROWS * LANES];
    _Alignas(64) double y[(KR16_MAX_RESULTS + KR16_BLOCK) * LANES];
    int verdict = KR16_FINE;
    for (; lo < hi && verdict == KR16_FINE; lo += LANES) {
        const int last = hi - lo <= LANES;
        const int lanes = last ? (int)(hi - lo) : LANES;
        verdict = load(k, inputs, lo, lanes, last, x);
        if (verdict != KR16_FINE)
            break;
        k->run(p, x, y);
        verdict = guarded(y + k->width * LANES, k->guards);
        (stream ? store_past : store)(y, k->width, lanes, out + lo * k->width);
    }
    if (stream)
        kr16_stream_end();
    return verdict;
}

#ifndef _WIN32
typedef struct {
    const kr16_kernel *k;
    const double *p;
    const double *const *inputs;
    ptrdiff_t lo, hi;
    int stream;
    double *out;
    int verdict;
    pthread_t thread;
} share;

static void *run_share(void *pointer)
{
    share *s = pointer;
    s->verdict = run_range(s->k, s->p, s->inputs, s->lo, s->hi, s->stream, s->out);
    return NULL;
}

static int run_threads(const kr16_kernel *k, const double *p, const double *const *inputs,
                       ptrdiff_t n, int stream, double *out, int threads)
{
    share shares[MAX_THREADS];
    int started = 0, verdict = KR16_FINE;
    const ptrdiff_t tiles = (n + LANES - 1) / LANES;
    for (int i = 0; i < threads; i++) {
        ptrdiff_t lo = tiles * i / threads * LANES, hi = tiles * (i + 1) / threads * LANES;
        shares[i] = (share){k, p, inputs, lo, hi < n ? hi : n, stream, out, KR16_FINE, 0};
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
    const int stream = n * k->width >= STREAMED && (uintptr_t)out % sizeof *out == 0;
    if (threads > MAX_THREADS)
        threads = MAX_THREADS;
    if (threads > tiles)
        threads = (int)tiles;
#ifndef _WIN32
    if (threads > 1)
        return run_threads(k, p, inputs, n, stream, out, threads);
#endif
    return run_range(k, p, inputs, 0, n, stream, out);
}

/* Cosines and sines of up to 8 angles, in the lanes of one vector. */
KR16_CLONES_OF static void trig(const double *angles, int count, double *at)
{
    double a[8] = {0.0}, c[8], s[8];
    if (angles != NULL)
        memcpy(a, angles, (size_t)count * sizeof *a);
    double beyond = 0.0;
#pragma omp simd reduction(+ : beyond)
    for (int i = 0; i < 8; i++) {
        beyond += fabs(a[i]) <= KR16_TRIG_LIMIT ? 0.0 : 1.0;
        kr16_sincos(a[i], &s[i], &c[i]);
    }
    for (int i = 0; beyond != 0.0 && i < count; i++) {
        c[i] = cos(a[i]);
        s[i] = sin(a[i]);
    }
    memcpy(at, c, (size_t)count * sizeof *c);
    memcpy(at + count, s, (size_t)count * sizeof *s);
}

int kr16_run_one(int kernel, const double *p, const double *const *inputs, double *out)
{
    const kr16_kernel *k = &kr16_single_kernels[kernel];
    double x[KR16_MAX_ROWS], y[KR16_MAX_RESULTS];
    double *at = x;
    for (int g = 0; g < k->groups; g++) {
        const int count = k->group[g].count;
        const double *source = inputs[g];
        if (source != NULL && not_finite(source, count))
            return KR16_BAD_INPUT;
        if (k->group[g].kind != 't') {
            memcpy(at, source, (size_t)count * sizeof *at);
            at += count;
            continue;
        }
        trig(source, count, at);
        at += 2 * count;
    }
    k->run(p, x, y);
    for (int i = 0; i < k->guards; i++)
        if (y[k->width + i] != 0.0)
            return KR16_BAD_INPUT;
    memcpy(out, y, (size_t)k->width * sizeof *out);
    return KR16_FINE;
}
