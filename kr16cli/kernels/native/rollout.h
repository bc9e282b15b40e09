/* Motions of the arm under torques held between samples: one, or thousands as lanes of tiles. */
#ifndef KR16_ROLLOUT_H
#define KR16_ROLLOUT_H

#include <math.h>
#include <stddef.h>

#include "kr16_tile.h"

#define KR16_STATES 12 /* q, qd */

/* Kernels that rates are made of: forward dynamics, and for a wrench J and the flange's pose. */
typedef struct {
    kr16_function dynamics, jacobian, pose;
} kr16_plant_kernels;

typedef struct {
    enum { KR16_RK4, KR16_DP54 } method;
    kr16_plant_kernels tile, one;
    ptrdiff_t n;                      /* trajectories */
    const double *parameters;         /* flat vector, one or n; `own`: n */
    int own;
    const double *state;              /* (n, 12) */
    const double *torque;             /* (samples, 6), one or n; `torque_row` numbers apart, or 0 */
    ptrdiff_t torque_row, samples;
    double hold;                      /* time from one sample to the next; the last is kept */
    const double *wrench;             /* 6 numbers or NULL; `wrench_row` apart, or 0 */
    ptrdiff_t wrench_row;
    int in_flange;                    /* its axes: the flange's, or robroot's */
    double duration, step;            /* step: RK4's, or DP54's longest (0: none) */
    double rtol, atol;
    long long max_steps;              /* tried steps of DP54 */
    const double *times;              /* rising, 0 to duration */
    ptrdiff_t count;
    double *out;                      /* (n, count, 12); NaN beyond what was reached */
    double *reached;                  /* (n,) time */
    long long *tally;                 /* (n, 3) steps, rejected, evaluations */
} kr16_rollout;

extern const kr16_kernel kr16_own_kernels[]; /* with parameters as rows: each lane has its own */

/* Numbers a tile's solver needs to work with. */
ptrdiff_t kr16_rollout_room(const kr16_rollout *r);

/* Trajectories lo to hi; `room` is aligned to 64 bytes. */
void kr16_rollout_run(const kr16_rollout *r, ptrdiff_t lo, ptrdiff_t hi, double *room);

/* Shared by the solvers. ----------------------------------------------------------------------*/

void kr16_rollout_one(const kr16_rollout *r, ptrdiff_t i);
void kr16_rk4_lanes(const kr16_rollout *r, ptrdiff_t lo, ptrdiff_t hi, double *room);
void kr16_dp54_lanes(const kr16_rollout *r, ptrdiff_t lo, ptrdiff_t hi, double *room);

/* A tile of arms. */
typedef struct {
    const kr16_rollout *r;
    const double *p;                  /* parameters: shared, or rows */
    double *rows;                     /* cosines, sines, speeds, torques */
    double *tau, *wrench, *scratch;   /* torques before the wrench; pose or J, turned wrench */
    double *own;
} kr16_lanes;

#define KR16_LANES_ROOM ((24 + 6 + 6 + 36 + 6) * KR16_LANES)

void kr16_lanes_make(kr16_lanes *a, const kr16_rollout *r, double *room);
void kr16_lanes_load(kr16_lanes *a, int lane, ptrdiff_t trajectory);
void kr16_lanes_torque(kr16_lanes *a, int lane, ptrdiff_t trajectory, ptrdiff_t sample);
void kr16_lanes_rates(kr16_lanes *a, const double *state, double *rates);

/* When the torque of a sample ends. */
static inline double kr16_held_until(const kr16_rollout *r, ptrdiff_t sample)
{
    const double end = (double)(sample + 1) * r->hold;
    return sample + 1 < r->samples && end < r->duration * (1.0 - 1e-12) ? end : r->duration;
}

/* Times nearer than this are one. */
static inline double kr16_instant(const kr16_rollout *r)
{
    return 1e-15 * r->duration;
}

static inline ptrdiff_t kr16_fixed_steps(const kr16_rollout *r, double span)
{
    const double count = ceil(span / r->step * (1.0 - 1e-12));
    return count > 1.0 ? (ptrdiff_t)count : 1;
}

/* Cubic through values and slopes at both ends of a step h, at the part u of it. */
static inline double kr16_cubic(double u, double h, double x0, double f0, double x1, double f1)
{
    const double v = 1.0 - u;
    return v * v * ((1.0 + 2.0 * u) * x0 + u * h * f0) + u * u * ((1.0 + 2.0 * v) * x1 - v * h * f1);
}

static inline double *kr16_row(const kr16_rollout *r, ptrdiff_t trajectory, ptrdiff_t m)
{
    return r->out + (trajectory * r->count + m) * KR16_STATES;
}

#endif
