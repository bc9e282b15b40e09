/* One internal step by the method that is chosen. */
#include <math.h>
#include <string.h>

#include "kr16_fmu.h"
#include "ode.h"

/* Of the adaptive method in a communication step: smaller or more ones lead nowhere. */
#define LEAST_STEP 1e-12
#define MOST_STEPS 1000000

/* Semi-implicit Euler, order 1: new speeds move the angles. */
static int euler(kr16_plant *plant, double t, double h, double *x)
{
    double dx[STATES];
    const int status = kr16_plant_rates(plant, t, x, dx);
    if (status != FINE)
        return status;
    for (int i = 6; i < STATES; i++)
        x[i] += h * dx[i];
    for (int i = 0; i < 6; i++)
        x[i] += h * x[6 + i];
    return FINE;
}

/* What friction and stops resist with at moved angles and speeds, each joint by its own. */
static void resisting(const kr16_plant *plant, const double *x, double dq, double dqd, double *out)
{
    double moved[STATES], friction[6] = {0.0}, contact[6];
    for (int i = 0; i < 6; i++) {
        moved[i] = x[i] + dq;
        moved[6 + i] = x[6 + i] + dqd;
    }
    if (plant->drives)
        kr16_friction(plant->p, moved + 6, friction);
    kr16_contact(plant, moved, moved + 6, contact);
    for (int i = 0; i < 6; i++)
        out[i] = friction[i] - contact[i];
}

static void slope(const kr16_plant *plant, const double *x, double dq, double dqd, double *out)
{
    double after[6], before[6];
    resisting(plant, x, dq, dqd, after);
    resisting(plant, x, -dq, -dqd, before);
    for (int i = 0; i < 6; i++)
        out[i] = fmax(0.0, (after[i] - before[i]) / (2.0 * KR16_SLOPE_STEP));
}

typedef struct {
    double mass[36], stiffness[6], damping[6], gh;
} stiff;

/* k of (1 - g h A) k = r. */
static void solved(const stiff *s, const double *r, double *k)
{
    double in[42];
    memcpy(in, s->mass, sizeof s->mass);
    for (int i = 0; i < 6; i++) {
        in[7 * i] += s->gh * (s->damping[i] + s->gh * s->stiffness[i]);
        double pushed = 0.0;
        for (int j = 0; j < 6; j++)
            pushed += s->mass[6 * i + j] * r[6 + j];
        in[36 + i] = pushed - s->gh * s->stiffness[i] * r[i];
    }
    kr16_solve(NULL, in, k + 6);
    for (int i = 0; i < 6; i++)
        k[i] = r[i] + s->gh * k[6 + i];
}

/* ROS2 with what is stiff of the Jacobian (Verwer et al. 1999); kr16cli/fmi/stiff.py says how. */
static int rosenbrock(kr16_plant *plant, double t, double h, double *x)
{
    double cs[12], rates[STATES], there[STATES], k1[STATES], k2[STATES];
    stiff s = {.gh = KR16_GAMMA * h};
    int status;
    kr16_trig(x, cs);
    kr16_mass_matrix(plant->p, cs, s.mass);
    slope(plant, x, KR16_SLOPE_STEP, 0.0, s.stiffness);
    slope(plant, x, 0.0, KR16_SLOPE_STEP, s.damping);
    if ((status = kr16_plant_rates(plant, t, x, rates)) != FINE)
        return status;
    solved(&s, rates, k1);
    for (int i = 0; i < STATES; i++)
        there[i] = x[i] + h * k1[i];
    if ((status = kr16_plant_rates(plant, t + h, there, rates)) != FINE)
        return status;
    for (int i = 0; i < STATES; i++)
        rates[i] -= 2.0 * k1[i];
    solved(&s, rates, k2);
    for (int i = 0; i < STATES; i++)
        x[i] += 0.5 * h * (3.0 * k1[i] + k2[i]);
    return FINE;
}

/* Adaptive steps from t to t + h; `hint` is the step to begin with, if it is not 0. */
static int dormand_prince(kr16_plant *plant, double t, double h, double *x, double *hint)
{
    kr16_dp54 s;
    memset(&s, 0, sizeof s);
    s.n = STATES;
    s.rtol = plant->tolerance;
    for (int i = 0; i < STATES; i++)
        s.atol[i] = plant->tolerance;
    int status = kr16_dp54_start(&s, kr16_plant_rates, plant, t, x);
    if (*hint > 0.0)
        s.h = *hint;
    while (status == FINE && s.t < t + h) {
        status = kr16_dp54_step(&s, kr16_plant_rates, plant, t + h);
        if (s.steps > MOST_STEPS || (s.h < LEAST_STEP * h && s.t < t + h))
            return STEP_VANISHED;
    }
    if (status != FINE)
        return status == KR16_ODE_TOO_SMALL ? STEP_VANISHED : status;
    *hint = s.h;
    memcpy(x, s.x, STATES * sizeof *x);
    return FINE;
}

int kr16_advance(kr16_plant *plant, double t, double h, double *x, double *hint)
{
    double y[STATES];
    int status;
    memcpy(y, x, sizeof y);
    plant->pitch = 0.0;
    switch (plant->method) {
    case SEMI_IMPLICIT_EULER:
        status = euler(plant, t, h, y);
        break;
    case ROSENBROCK:
        status = rosenbrock(plant, t, h, y);
        break;
    case DORMAND_PRINCE:
        status = dormand_prince(plant, t, h, y, hint);
        break;
    default:
        status = kr16_rk4_step(kr16_plant_rates, plant, STATES, t, h, y);
    }
    if (status != FINE)
        return status;
    for (int i = 0; i < STATES; i++)
        if (!isfinite(y[i]))
            return NOT_FINITE;
    memcpy(x, y, sizeof y);
    return FINE;
}
