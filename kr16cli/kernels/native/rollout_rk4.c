/* Steps of fixed length, a tile of trajectories at once. */
#include "rollout.h"

#include <string.h>

#include "batch.h"

#define LANES KR16_LANES
#define SIZE (KR16_STATES * LANES)

typedef struct {
    kr16_lanes arms;
    const kr16_rollout *r;
    ptrdiff_t first, m;                      /* first trajectory, next sample to give */
    int lanes;
    int dead[LANES];
    long long evaluations;
    double *x, *before, *at, *k1, *k, *sum;
} tile;

/* sum gets `weight` k (or is it, to begin with), at = x + c k. */
KR16_CLONES_OF static void gather(int begin, double weight, double c, const double *restrict k,
                                  const double *restrict x, double *restrict sum,
                                  double *restrict at)
{
    if (begin) {
#pragma omp simd
        for (int i = 0; i < SIZE; i++) {
            sum[i] = k[i];
            at[i] = x[i] + c * k[i];
        }
        return;
    }
#pragma omp simd
    for (int i = 0; i < SIZE; i++) {
        sum[i] += weight * k[i];
        at[i] = x[i] + c * k[i];
    }
}

/* x += c (sum + k); not 0 if some x is no finite number then. */
KR16_CLONES_OF static int move(double c, const double *restrict sum, const double *restrict k,
                               double *restrict x)
{
    double odd = 0.0;
#pragma omp simd reduction(+ : odd)
    for (int i = 0; i < SIZE; i++) {
        x[i] += c * (sum[i] + k[i]);
        odd += x[i] - x[i];
    }
    return odd != 0.0;
}

static void rates(tile *w, const double *x, double *f)
{
    kr16_lanes_rates(&w->arms, x, f);
    w->evaluations++;
}

/* From now on lane i is no trajectory: it rests where it began, and gives no numbers. */
static void bury(tile *w, int i, double t)
{
    const ptrdiff_t trajectory = w->first + i;
    if (!w->dead[i] && i < w->lanes) {
        w->r->reached[trajectory] = t;
        w->r->tally[3 * trajectory + 2] = w->evaluations;
    }
    w->dead[i] = 1;
    for (int j = 0; j < KR16_STATES; j++) {
        const double start = w->r->state[(w->first + (i < w->lanes ? i : 0)) * KR16_STATES + j];
        w->x[j * LANES + i] = w->before[j * LANES + i] = start;
    }
}

static void bury_all(tile *w, double t)
{
    for (int i = 0; i < LANES; i++) {
        double odd = 0.0;
        for (int j = 0; j < KR16_STATES; j++)
            odd += w->x[j * LANES + i] - w->x[j * LANES + i];
        if (odd != 0.0)
            bury(w, i, t);
    }
}

/* Sample m, at the part u of the step h just made. */
static void give(const tile *w, double u, double h)
{
    for (int i = 0; i < w->lanes; i++) {
        double *row = kr16_row(w->r, w->first + i, w->m);
        for (int j = 0; j < KR16_STATES; j++) {
            const int at = j * LANES + i;
            row[j] = w->dead[i]  ? NAN
                     : u >= 1.0 ? w->x[at]
                                : kr16_cubic(u, h, w->before[at], w->k1[at], w->x[at], w->k[at]);
        }
    }
}

/* One step from t0 to t, k1 known, and its samples; whether k is the next step's k1. */
static int step(tile *w, double t0, double t)
{
    const kr16_rollout *r = w->r;
    const double h = t - t0, instant = kr16_instant(r);
    int known = 0;
    memcpy(w->before, w->x, SIZE * sizeof *w->x);
    gather(1, 1.0, 0.5 * h, w->k1, w->x, w->sum, w->at);
    rates(w, w->at, w->k);
    gather(0, 2.0, 0.5 * h, w->k, w->x, w->sum, w->at);
    rates(w, w->at, w->k);
    gather(0, 2.0, h, w->k, w->x, w->sum, w->at);
    rates(w, w->at, w->k);
    if (move(h / 6.0, w->sum, w->k, w->x))
        bury_all(w, t0);
    for (int i = 0; i < w->lanes; i++)
        r->tally[3 * (w->first + i)] += !w->dead[i];
    if (w->m < r->count && r->times[w->m] < t - instant) {
        rates(w, w->x, w->k);
        known = 1;
    }
    for (; w->m < r->count && r->times[w->m] < t - instant; w->m++)
        give(w, (r->times[w->m] - t0) / h, h);
    for (; w->m < r->count && r->times[w->m] <= t + instant; w->m++)
        give(w, 1.0, h);
    return known;
}

static void run_tile(tile *w)
{
    const kr16_rollout *r = w->r;
    double t = 0.0;
    w->m = 0;
    w->evaluations = 0;
    for (int i = 0; i < LANES; i++) {
        const ptrdiff_t trajectory = w->first + (i < w->lanes ? i : 0);
        w->dead[i] = 0;
        kr16_lanes_load(&w->arms, i, trajectory);
        for (int j = 0; j < KR16_STATES; j++)
            w->x[j * LANES + i] = r->state[trajectory * KR16_STATES + j];
    }
    memset(r->tally + 3 * w->first, 0, 3 * (size_t)w->lanes * sizeof *r->tally);
    for (; w->m < r->count && r->times[w->m] <= 0.0; w->m++)
        give(w, 1.0, 1.0);
    for (ptrdiff_t sample = 0; t < r->duration; sample++) {
        const double begin = t, stop = kr16_held_until(r, sample);
        const ptrdiff_t steps = kr16_fixed_steps(r, stop - begin);
        if (sample > 0)
            for (int i = 0; i < LANES; i++)
                kr16_lanes_torque(&w->arms, i, w->first + (i < w->lanes ? i : 0), sample);
        int known = 0;
        for (ptrdiff_t s = 1; s <= steps; s++) {
            const double t0 = t;
            t = s == steps ? stop : begin + (stop - begin) * ((double)s / (double)steps);
            if (known) {
                double *swap = w->k;
                w->k = w->k1;
                w->k1 = swap;
            } else {
                rates(w, w->x, w->k1);
            }
            known = step(w, t0, t);
        }
    }
    for (int i = 0; i < w->lanes; i++)
        if (!w->dead[i]) {
            r->reached[w->first + i] = t;
            r->tally[3 * (w->first + i) + 2] = w->evaluations;
        }
}

void kr16_rk4_lanes(const kr16_rollout *r, ptrdiff_t lo, ptrdiff_t hi, double *room)
{
    tile w = {.r = r};
    double **rows[] = {&w.x, &w.before, &w.at, &w.k1, &w.k, &w.sum};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++, room += SIZE)
        *rows[i] = room;
    kr16_lanes_make(&w.arms, r, room);
    for (w.first = lo; w.first < hi; w.first += LANES) {
        w.lanes = hi - w.first < LANES ? (int)(hi - w.first) : LANES;
        run_tile(&w);
    }
}
