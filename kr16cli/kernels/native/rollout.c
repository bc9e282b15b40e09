/* One trajectory, and the choice between it and lanes. */
#include "rollout.h"

#include <string.h>

#include "batch.h"
#include "ode.h"

#define STATES KR16_STATES
#define FEW 4 /* fewer trajectories than this are quicker one by one */

typedef struct {
    const kr16_rollout *r;
    const double *p, *tau, *wrench;
} arm;

static int rates_of_one(void *context, double t, const double *x, double *dx)
{
    const arm *a = context;
    const kr16_plant_kernels *k = &a->r->one;
    double rows[24], table[36];
    (void)t;
    for (int j = 0; j < 6; j++) {
        if (fabs(x[j]) <= KR16_TRIG_LIMIT) {
            kr16_sincos(x[j], &rows[6 + j], &rows[j]);
        } else {
            rows[j] = cos(x[j]);
            rows[6 + j] = sin(x[j]);
        }
        rows[12 + j] = dx[j] = x[6 + j];
        rows[18 + j] = a->tau[j];
    }
    if (a->wrench != NULL) {
        double w[6];
        memcpy(w, a->wrench, sizeof w);
        if (a->r->in_flange) {
            k->pose(a->p, rows, table);
            for (int i = 0; i < 6; i++) {
                const double *row = table + 4 * (i % 3), *part = a->wrench + 3 * (i / 3);
                w[i] = row[0] * part[0] + row[1] * part[1] + row[2] * part[2];
            }
        }
        k->jacobian(a->p, rows, table);
        for (int i = 0; i < 6; i++)
            for (int j = 0; j < 6; j++)
                rows[18 + j] += w[i] * table[6 * i + j];
    }
    k->dynamics(a->p, rows, dx + 6);
    return 0;
}

/* The trajectory ends here: no numbers from sample m on. */
static void end_at(const kr16_rollout *r, ptrdiff_t i, double t, ptrdiff_t m)
{
    r->reached[i] = t;
    for (double *x = kr16_row(r, i, m); x < kr16_row(r, i, r->count); x++)
        *x = NAN;
}

static int all_finite(const double *x)
{
    double sum = 0.0;
    for (int j = 0; j < STATES; j++)
        sum += x[j] - x[j];
    return sum == 0.0;
}

static void one_rk4(const kr16_rollout *r, ptrdiff_t i, arm *a)
{
    double x[STATES], before[STATES], f0[STATES], f1[STATES];
    const double instant = kr16_instant(r);
    long long *tally = r->tally + 3 * i;
    ptrdiff_t m = 0;
    double t = 0.0;
    memcpy(x, r->state + i * STATES, sizeof x);
    for (; m < r->count && r->times[m] <= 0.0; m++)
        memcpy(kr16_row(r, i, m), x, sizeof x);
    for (ptrdiff_t sample = 0; t < r->duration; sample++, a->tau += 6) {
        const double begin = t, stop = kr16_held_until(r, sample);
        const ptrdiff_t steps = kr16_fixed_steps(r, stop - begin);
        for (ptrdiff_t s = 1; s <= steps; s++) {
            const double t0 = t;
            t = s == steps ? stop : begin + (stop - begin) * ((double)s / (double)steps);
            memcpy(before, x, sizeof x);
            kr16_rk4_step(rates_of_one, a, STATES, t0, t - t0, x);
            tally[2] += 4;
            if (!all_finite(x)) {
                end_at(r, i, t0, m);
                return;
            }
            tally[0]++;
            if (m < r->count && r->times[m] < t - instant) {
                rates_of_one(a, t0, before, f0);
                rates_of_one(a, t, x, f1);
                tally[2] += 2;
            }
            for (; m < r->count && r->times[m] < t - instant; m++)
                for (int j = 0; j < STATES; j++)
                    kr16_row(r, i, m)[j] = kr16_cubic((r->times[m] - t0) / (t - t0), t - t0,
                                                      before[j], f0[j], x[j], f1[j]);
            for (; m < r->count && r->times[m] <= t + instant; m++)
                memcpy(kr16_row(r, i, m), x, sizeof x);
        }
    }
    end_at(r, i, t, m);
}

static void one_dp54(const kr16_rollout *r, ptrdiff_t i, arm *a)
{
    kr16_dp54 s = {.n = STATES, .rtol = r->rtol, .h_max = r->step};
    ptrdiff_t m = 0;
    int status = KR16_ODE_FINE;
    for (int j = 0; j < STATES; j++)
        s.atol[j] = r->atol;
    kr16_dp54_start(&s, rates_of_one, a, 0.0, r->state + i * STATES);
    for (ptrdiff_t sample = 0; s.t < r->duration && status == KR16_ODE_FINE; sample++) {
        const double stop = kr16_held_until(r, sample);
        if (sample > 0) {
            a->tau += 6;
            rates_of_one(a, s.t, s.x, s.dx);
            s.evaluations++;
        }
        while (s.t < stop && status == KR16_ODE_FINE) {
            status = KR16_ODE_TOO_SMALL;
            if (s.steps + s.rejected < r->max_steps)
                status = kr16_dp54_step(&s, rates_of_one, a, stop);
            for (; m < r->count && r->times[m] <= s.t; m++)
                kr16_dp54_at(&s, r->times[m], kr16_row(r, i, m));
        }
    }
    r->tally[3 * i] = s.steps;
    r->tally[3 * i + 1] = s.rejected;
    r->tally[3 * i + 2] = s.evaluations;
    end_at(r, i, s.t, m);
}

void kr16_rollout_one(const kr16_rollout *r, ptrdiff_t i)
{
    arm a = {
        r,
        r->parameters + (r->own ? i * kr16_parameter_count : 0),
        r->torque + i * r->torque_row,
        r->wrench == NULL ? NULL : r->wrench + i * r->wrench_row,
    };
    memset(r->tally + 3 * i, 0, 3 * sizeof *r->tally);
    if (r->method == KR16_RK4)
        one_rk4(r, i, &a);
    else
        one_dp54(r, i, &a);
}

ptrdiff_t kr16_rollout_room(const kr16_rollout *r)
{
    /* rows of states for ten slopes and solutions, the more frugal method included */
    const ptrdiff_t own = r->own ? (ptrdiff_t)kr16_parameter_count * KR16_LANES : 0;
    return 10 * STATES * KR16_LANES + KR16_LANES_ROOM + own;
}

void kr16_rollout_run(const kr16_rollout *r, ptrdiff_t lo, ptrdiff_t hi, double *room)
{
    if (hi - lo < FEW) {
        for (ptrdiff_t i = lo; i < hi; i++)
            kr16_rollout_one(r, i);
    } else if (r->method == KR16_RK4) {
        kr16_rk4_lanes(r, lo, hi, room);
    } else {
        kr16_dp54_lanes(r, lo, hi, room);
    }
}
