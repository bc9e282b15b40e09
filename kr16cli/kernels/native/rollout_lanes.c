/* A tile of arms: rates of its states. */
#include "rollout.h"

#include <string.h>

#include "batch.h"

#define LANES KR16_LANES

int kr16_sincos_rows(const double *angles, double *rows, int count);

void kr16_lanes_make(kr16_lanes *a, const kr16_rollout *r, double *room)
{
    a->r = r;
    a->rows = room;
    a->tau = a->rows + 24 * LANES;
    a->wrench = a->tau + 6 * LANES;
    a->scratch = a->wrench + 6 * LANES;
    a->own = a->scratch + (36 + 6) * LANES;
    a->p = r->own ? a->own : r->parameters;
}

void kr16_lanes_load(kr16_lanes *a, int lane, ptrdiff_t trajectory)
{
    const kr16_rollout *r = a->r;
    if (r->own) {
        const double *p = r->parameters + trajectory * kr16_parameter_count;
        for (int j = 0; j < kr16_parameter_count; j++)
            a->own[j * LANES + lane] = p[j];
    }
    if (r->wrench != NULL)
        for (int j = 0; j < 6; j++)
            a->wrench[j * LANES + lane] = r->wrench[trajectory * r->wrench_row + j];
    kr16_lanes_torque(a, lane, trajectory, 0);
}

void kr16_lanes_torque(kr16_lanes *a, int lane, ptrdiff_t trajectory, ptrdiff_t sample)
{
    const double *tau = a->r->torque + trajectory * a->r->torque_row + 6 * sample;
    for (int j = 0; j < 6; j++)
        a->tau[j * LANES + lane] = tau[j];
}

/* Angles too large for the rows' sine, or no numbers. */
static void far_trig(const double *angles, double *rows)
{
    for (int i = 0; i < 6 * LANES; i++) {
        if (!(fabs(angles[i]) <= KR16_TRIG_LIMIT)) {
            rows[i] = cos(angles[i]);
            rows[6 * LANES + i] = sin(angles[i]);
        }
    }
}

/* w in robroot's axes from the flange's: `pose` are the rows of T_robroot_flange. */
KR16_CLONES_OF static void turned(const double *restrict pose, const double *restrict wrench,
                                  double *restrict w)
{
    for (int row = 0; row < 6; row++) {
        const double *turn = pose + 4 * (row % 3) * LANES, *part = wrench + 3 * (row / 3) * LANES;
#pragma omp simd
        for (int i = 0; i < LANES; i++)
            w[row * LANES + i] = turn[i] * part[i] + turn[LANES + i] * part[LANES + i] +
                                 turn[2 * LANES + i] * part[2 * LANES + i];
    }
}

/* total = tau + J^T w */
KR16_CLONES_OF static void pushed(const double *restrict jacobian, const double *restrict w,
                                  const double *restrict tau, double *restrict total)
{
    memcpy(total, tau, 6 * LANES * sizeof *total);
    for (int row = 0; row < 6; row++)
        for (int j = 0; j < 6; j++) {
            const double *entry = jacobian + (6 * row + j) * LANES;
#pragma omp simd
            for (int i = 0; i < LANES; i++)
                total[j * LANES + i] += entry[i] * w[row * LANES + i];
        }
}

void kr16_lanes_rates(kr16_lanes *a, const double *state, double *rates)
{
    const kr16_plant_kernels *k = &a->r->tile;
    if (kr16_sincos_rows(state, a->rows, 6))
        far_trig(state, a->rows);
    memcpy(a->rows + 12 * LANES, state + 6 * LANES, 6 * LANES * sizeof *state);
    memcpy(rates, state + 6 * LANES, 6 * LANES * sizeof *state);
    if (a->r->wrench != NULL) {
        double *w = a->wrench, *pose = a->scratch;
        if (a->r->in_flange) {
            k->pose(a->p, a->rows, pose);
            turned(pose, a->wrench, w = a->scratch + 36 * LANES);
        }
        k->jacobian(a->p, a->rows, a->scratch);
        pushed(a->scratch, w, a->tau, a->rows + 18 * LANES);
    } else {
        memcpy(a->rows + 18 * LANES, a->tau, 6 * LANES * sizeof *a->tau);
    }
    k->dynamics(a->p, a->rows, rates + 6 * LANES);
}
