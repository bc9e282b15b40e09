/* Dormand and Prince's method on a tile of trajectories, each with its own time and step.
 *
 * A lane whose trajectory is over takes the next one. What differs between lanes are steps, never
 * instructions; the torque is constant within a step, so that rates do not depend on time.
 */
#include "rollout.h"

#include <float.h>
#include <string.h>

#include "batch.h"
#include "ode.h"

#define LANES KR16_LANES
#define STATES KR16_STATES
#define SIZE (STATES * LANES)
#define NOBODY (-1)

typedef struct {
    ptrdiff_t trajectory; /* or NOBODY */
    ptrdiff_t sample, m;  /* torque in force, next sample to give */
    double t, stop, h;    /* time, when the torque ends, step to try next */
    int fresh, stale;     /* no h yet; slope at x unknown */
    int refused, last;    /* this step was tried longer before; ends at stop */
    long long steps, rejected, evaluations;
} lane;

typedef struct {
    kr16_lanes arms;
    const kr16_rollout *r;
    ptrdiff_t next, end; /* trajectories not begun */
    lane lanes[LANES];
    double h[LANES], error[LANES], accepted[LANES];
    double *x, *y, *rate;
    double *k; /* 7 slopes */
} tile;

/* sum = h (weights . slopes) of one number, the first `count` slopes. */
static inline __attribute__((always_inline)) double mixed(int count, const double *weights,
                                                          const double *k, int i)
{
    double sum = weights[0] * k[i];
    for (int l = 1; l < count; l++)
        sum += weights[l] * k[l * SIZE + i];
    return sum;
}

#define STAGE(count)                                                                               \
    for (int j = 0; j < STATES; j++) {                                                             \
        _Pragma("omp simd") for (int i = 0; i < LANES; i++)                                        \
            y[j * LANES + i] =                                                                     \
                x[j * LANES + i] +                                                                 \
                h[i] * mixed(count, kr16_dp54_stage[count], k, j * LANES + i);                     \
    }

/* y = x + h (stage . k), the state at which the slope of a stage is asked. */
KR16_CLONES_OF static void at_stage(int stage, const double *restrict h, const double *restrict x,
                                    const double *restrict k, double *restrict y)
{
    switch (stage) { /* a constant each, so that sums stay in registers */
    case 1: STAGE(1) break;
    case 2: STAGE(2) break;
    case 3: STAGE(3) break;
    case 4: STAGE(4) break;
    case 5: STAGE(5) break;
    default: STAGE(6) break;
    }
}

/* Squared weighted error of each lane; NaN where a number is not finite. */
KR16_CLONES_OF static void errors(double rtol, double atol, const double *restrict h,
                                  const double *restrict x, const double *restrict y,
                                  const double *restrict k, double *restrict error)
{
    memset(error, 0, LANES * sizeof *error);
    for (int j = 0; j < STATES; j++) {
#pragma omp simd
        for (int i = 0; i < LANES; i++) {
            const int at = j * LANES + i;
            const double before = fabs(x[at]), after = fabs(y[at]);
            const double scale = atol + rtol * (before > after ? before : after);
            const double part = h[i] * mixed(7, kr16_dp54_defect, k, at) /
                                (scale > DBL_MIN ? scale : DBL_MIN);
            error[i] += part * part;
        }
    }
}

/* Lanes that accept their step stand at its end. */
KR16_CLONES_OF static void move(const double *restrict accepted, const double *restrict y,
                                const double *restrict slope, double *restrict x,
                                double *restrict k)
{
    for (int j = 0; j < STATES; j++) {
#pragma omp simd
        for (int i = 0; i < LANES; i++) {
            const int at = j * LANES + i;
            x[at] = accepted[i] != 0.0 ? y[at] : x[at];
            k[at] = accepted[i] != 0.0 ? slope[at] : k[at];
        }
    }
}

/* The next trajectory, if there is one, begins in lane i. */
static void begin(tile *w, int i)
{
    const kr16_rollout *r = w->r;
    lane *a = &w->lanes[i];
    if (w->next >= w->end) {
        a->trajectory = NOBODY;
        a->h = 0.0;
        return;
    }
    *a = (lane){.trajectory = w->next++, .fresh = 1, .stale = 1};
    a->stop = kr16_held_until(r, 0);
    kr16_lanes_load(&w->arms, i, a->trajectory);
    const double *start = r->state + a->trajectory * STATES;
    for (int j = 0; j < STATES; j++)
        w->x[j * LANES + i] = start[j];
    for (; a->m < r->count && r->times[a->m] <= 0.0; a->m++)
        memcpy(kr16_row(r, a->trajectory, a->m), start, STATES * sizeof *start);
}

static void finish(tile *w, int i)
{
    const kr16_rollout *r = w->r;
    const lane *a = &w->lanes[i];
    long long *tally = r->tally + 3 * a->trajectory;
    tally[0] = a->steps;
    tally[1] = a->rejected;
    tally[2] = a->evaluations;
    r->reached[a->trajectory] = a->t;
    for (double *x = kr16_row(r, a->trajectory, a->m); x < kr16_row(r, a->trajectory, r->count); x++)
        *x = NAN;
    begin(w, i);
}

/* Weighted size of a lane's column v. */
static double size(const tile *w, int i, const double *v)
{
    double sum = 0.0;
    for (int j = 0; j < STATES; j++) {
        const double scale = w->r->atol + w->r->rtol * fabs(w->x[j * LANES + i]);
        const double part = v[j * LANES + i] / fmax(scale, DBL_MIN);
        sum += part * part;
    }
    return sqrt(sum / STATES);
}

/* Slopes of the stale lanes; first steps of the fresh ones, as the single solver chooses them. */
static void refresh(tile *w)
{
    const kr16_rollout *r = w->r;
    int stale = 0, fresh = 0;
    for (int i = 0; i < LANES; i++) {
        stale |= w->lanes[i].stale;
        fresh |= w->lanes[i].fresh;
    }
    if (!stale)
        return;
    kr16_lanes_rates(&w->arms, w->x, w->rate);
    for (int i = 0; i < LANES; i++) {
        lane *a = &w->lanes[i];
        for (int j = 0; a->stale && j < STATES; j++)
            w->k[j * LANES + i] = w->rate[j * LANES + i];
        a->evaluations += a->stale;
        a->stale = 0;
        if (a->fresh) {
            a->h = kr16_dp54_probe(size(w, i, w->x), size(w, i, w->k));
            if (r->step > 0.0)
                a->h = fmin(a->h, r->step);
        }
        w->h[i] = a->fresh ? a->h : 0.0;
    }
    if (!fresh)
        return;
    for (int i = 0; i < SIZE; i++)
        w->y[i] = w->x[i] + w->h[i % LANES] * w->k[i];
    kr16_lanes_rates(&w->arms, w->y, w->rate);
    for (int i = 0; i < LANES; i++) {
        lane *a = &w->lanes[i];
        if (!a->fresh)
            continue;
        for (int j = 0; j < STATES; j++)
            w->rate[j * LANES + i] = (w->rate[j * LANES + i] - w->k[j * LANES + i]) / a->h;
        a->h = kr16_dp54_first(a->h, fmax(size(w, i, w->k), size(w, i, w->rate)));
        a->evaluations++;
        a->fresh = 0;
    }
}

/* The samples of lane i within the step just accepted, from t0 on. */
static void give(const tile *w, int i, double t0)
{
    const kr16_rollout *r = w->r;
    const lane *a = &w->lanes[i];
    kr16_dp54 s = {.n = STATES, .t_old = t0, .t = a->t};
    for (int j = 0; j < STATES; j++) {
        const int at = j * LANES + i;
        const double h = w->h[i], rise = w->y[at] - w->x[at], bend = h * w->k[at] - rise;
        s.dense[0][j] = w->x[at];
        s.dense[1][j] = rise;
        s.dense[2][j] = bend;
        s.dense[3][j] = rise - h * w->k[6 * SIZE + at] - bend;
        s.dense[4][j] = h * mixed(7, kr16_dp54_curve, w->k, at);
    }
    for (ptrdiff_t m = a->m; m < r->count && r->times[m] <= a->t; m++)
        kr16_dp54_at(&s, r->times[m], kr16_row(r, a->trajectory, m));
}

/* Steps to try; a lane that has none left to try is over. Whether any lane is at work. */
static int choose(tile *w)
{
    int busy = 0;
    for (int i = 0; i < LANES; i++) {
        lane *a = &w->lanes[i];
        w->h[i] = 0.0;
        if (a->trajectory == NOBODY)
            continue;
        busy = 1;
        if (w->r->step > 0.0)
            a->h = fmin(a->h, w->r->step);
        a->last = a->t + 1.01 * a->h >= a->stop;
        w->h[i] = a->last ? a->stop - a->t : a->h;
    }
    return busy;
}

static int hopeless(const tile *w, const lane *a)
{
    return a->steps + a->rejected >= w->r->max_steps ||
           !(a->h > 10.0 * DBL_EPSILON * fabs(a->t));
}

/* Lane i after a step that was tried. */
static void judge(tile *w, int i)
{
    const kr16_rollout *r = w->r;
    lane *a = &w->lanes[i];
    const double error = sqrt(w->error[i] / STATES), h = w->h[i];
    const double factor = kr16_dp54_factor(error);
    a->evaluations += 6;
    w->accepted[i] = error <= 1.0;
    if (!(error <= 1.0)) {
        a->refused = 1;
        a->rejected++;
        a->h = h * factor;
        return;
    }
    const double t0 = a->t, next = h * (a->refused ? fmin(1.0, factor) : factor);
    a->h = a->last && !a->refused ? fmax(a->h, next) : next;
    a->t = a->last ? a->stop : a->t + h;
    a->refused = 0;
    a->steps++;
    if (a->m < r->count && r->times[a->m] <= a->t) {
        give(w, i, t0);
        while (a->m < r->count && r->times[a->m] <= a->t)
            a->m++;
    }
}

static void step(tile *w)
{
    const kr16_rollout *r = w->r;
    for (int j = 1; j < 7; j++) {
        at_stage(j, w->h, w->x, w->k, w->y);
        kr16_lanes_rates(&w->arms, w->y, w->k + j * SIZE);
    }
    errors(r->rtol, r->atol, w->h, w->x, w->y, w->k, w->error);
    for (int i = 0; i < LANES; i++) {
        w->accepted[i] = 0.0;
        if (w->lanes[i].trajectory != NOBODY)
            judge(w, i);
    }
    move(w->accepted, w->y, w->k + 6 * SIZE, w->x, w->k);
    for (int i = 0; i < LANES; i++) {
        lane *a = &w->lanes[i];
        if (a->trajectory == NOBODY)
            continue;
        if (a->t >= r->duration || hopeless(w, a)) {
            finish(w, i);
        } else if (a->t >= a->stop) {
            kr16_lanes_torque(&w->arms, i, a->trajectory, ++a->sample);
            a->stop = kr16_held_until(r, a->sample);
            a->stale = 1;
        }
    }
}

void kr16_dp54_lanes(const kr16_rollout *r, ptrdiff_t lo, ptrdiff_t hi, double *room)
{
    tile w = {.r = r, .next = lo, .end = hi};
    w.x = room;
    w.y = w.x + SIZE;
    w.rate = w.y + SIZE;
    w.k = w.rate + SIZE;
    kr16_lanes_make(&w.arms, r, w.k + 7 * SIZE);
    for (int i = 0; i < LANES; i++) {
        if (lo + i >= hi) /* an idle lane works on the last trajectory's start, for nobody */
            w.next = hi - 1;
        begin(&w, i);
        if (lo + i >= hi)
            w.lanes[i] = (lane){.trajectory = NOBODY};
    }
    for (refresh(&w); choose(&w); refresh(&w))
        step(&w);
}
