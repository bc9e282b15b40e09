/* M(q) qdd + C(q, qd) qd + G(q) + friction = tau + J^T w + contact, with the limits of drives.
 *
 * The same as kr16cli/simulate/plant.py.
 */
#include <math.h>
#include <string.h>

#include "kr16_fmu.h"

void kr16_plant_inputs(kr16_plant *plant, double t, double *u)
{
    for (int i = 0; i < INPUTS; i++)
        u[i] = plant->u[i] + plant->rise[i] * (t - plant->since);
}

int kr16_asked(kr16_plant *plant, double t, const double *x, const double *cs, double *tau)
{
    double u[INPUTS];
    if (!plant->moving)
        return kr16_control(plant, plant->u, x, cs, tau);
    kr16_plant_inputs(plant, t, u);
    return kr16_control(plant, u, x, cs, tau);
}

void kr16_applied(const kr16_plant *plant, const double *qd, double *tau)
{
    if (!plant->bound)
        return;
    for (int i = 0; i < 6; i++) {
        const double most = plant->torque[i], speed = plant->speed[i], rate = qd[i];
        double value = tau[i] > most ? most : tau[i] < -most ? -most : tau[i];
        if (value * rate > 0.0 && fabs(rate) > speed)
            value *= fmax(0.0, 1.0 - (fabs(rate) / speed - 1.0) / KR16_FADE);
        tau[i] = value;
    }
}

/* Rubber that is pressed and never pulls (Hunt and Crossley 1975). */
static double push(double depth, double speed, double stiffness)
{
    if (!(depth > 0.0))
        return 0.0;
    return fmax(0.0, stiffness * depth * (1.0 + KR16_STOP_BOUNCE * speed));
}

void kr16_contact(const kr16_plant *plant, const double *q, const double *qd, double *tau)
{
    for (int i = 0; i < 6; i++)
        tau[i] = plant->stops ? push(kr16_robot.lower[i] - q[i], -qd[i], plant->stiffness[i]) -
                                    push(q[i] - kr16_robot.upper[i], qd[i], plant->stiffness[i])
                              : 0.0;
}

static void add_wrench(kr16_plant *plant, double t, const double *cs, double *tau)
{
    double in[18] = {0.0}, motion[54], u[INPUTS];
    const double *w = plant->u + WRENCH, *jacobian = motion + 12;
    if (!plant->pushed)
        return;
    if (plant->moving) {
        kr16_plant_inputs(plant, t, u);
        w = u + WRENCH;
    }
    memcpy(in, cs, 12 * sizeof *in);
    kr16_motion(plant->p, in, motion);
    for (int j = 0; j < 6; j++) {
        double sum = 0.0;
        for (int i = 0; i < 6; i++)
            sum += w[i] * jacobian[6 * i + j];
        tau[j] += sum;
    }
}

/* qdd of M qdd + C qd + G = tau for any robot: `in` is as for kr16_forward_dynamics. */
static void solved(const double *p, const double *in, double *qdd)
{
    double at[24] = {0.0}, bias[6], system[42];
    memcpy(at, in, 18 * sizeof *in);
    kr16_inverse_dynamics(p, at, bias);
    kr16_mass_matrix(p, in, system);
    for (int i = 0; i < 6; i++)
        system[36 + i] = in[18 + i] - bias[i];
    kr16_solve(NULL, system, qdd);
}

/* qdd under the torques that the drives give. `in` is what the forward dynamics takes: cosines
 * and sines, speeds, and these torques, to which the other ones are added. */
static void accelerate(kr16_plant *plant, double t, const double *x, double *in, double *qdd)
{
    double extra[6], *tau = in + 18;
    add_wrench(plant, t, in, tau);
    if (plant->stops) {
        kr16_contact(plant, x, x + 6, extra);
        for (int i = 0; i < 6; i++)
            tau[i] += extra[i];
    }
    if (plant->drives) {
        kr16_friction(plant->p, x + 6, extra);
        for (int i = 0; i < 6; i++)
            tau[i] -= extra[i];
    }
    if (plant->sparse)
        kr16_forward_dynamics(plant->p, in, qdd);
    else
        solved(plant->p, in, qdd);
}

/* Rates at x, whose cosines and sines stand in `in`. */
static int rates(kr16_plant *plant, double t, const double *x, double *in, double *dx)
{
    const int status = kr16_asked(plant, t, x, in, in + 18);
    if (status != FINE)
        return status;
    kr16_applied(plant, x + 6, in + 18);
    for (int i = 0; i < 6; i++)
        in[12 + i] = dx[i] = x[6 + i];
    accelerate(plant, t, x, in, dx + 6);
    return FINE;
}

int kr16_plant_rates_at(kr16_plant *plant, double t, const double *x, const double *cs, double *dx)
{
    double in[24];
    memcpy(in, cs, 12 * sizeof *in);
    return rates(plant, t, x, in, dx);
}

/* Each method asks first for the rates where its step begins. */
int kr16_plant_rates(void *context, double t, const double *x, double *dx)
{
    kr16_plant *plant = context;
    double in[24];
    if (plant->known) {
        plant->known = 0;
        memcpy(dx, x + 6, 6 * sizeof *dx);
        memcpy(dx + 6, plant->qdd, sizeof plant->qdd);
        return FINE;
    }
    kr16_trig(x, in);
    return rates(plant, t, x, in, dx);
}
