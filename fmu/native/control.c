/* What is asked of the drives: the torque of a controller, and the inputs tau.
 *
 * The same as kr16cli/simulate/controllers.py; the formulas in task space are generated from
 * kr16cli/simulate/task_law.py.
 */
#include <math.h>
#include <string.h>

#include "kr16_fmu.h"
#include "trig.h"


/* Torques for wanted accelerations, friction included. */
static void torque_for(kr16_plant *plant, const double *x, const double *cs, const double *wanted,
                       double *tau)
{
    double in[24], friction[6];
    memcpy(in, cs, 12 * sizeof *in);
    memcpy(in + 12, x + 6, 6 * sizeof *in);
    memcpy(in + 18, wanted, 6 * sizeof *in);
    kr16_inverse_dynamics(plant->p, in, tau);
    if (!plant->drives)
        return;
    kr16_friction(plant->p, x + 6, friction);
    for (int i = 0; i < 6; i++)
        tau[i] += friction[i];
}

void kr16_retarget(kr16_plant *plant, const double *u, double *target)
{
    double in[18], motion[54];
    const double *J = motion + 12, *drift = motion + 48;
    kr16_trig(u + Q_REF, in);
    memcpy(in + 12, u + QD_REF, 6 * sizeof *in);
    kr16_motion(plant->p, in, motion);
    memcpy(target, motion, 12 * sizeof *target);
    for (int i = 0; i < 6; i++) {
        double twist = 0.0, straight = 0.0;
        for (int j = 0; j < 6; j++) {
            twist += J[6 * i + j] * u[QD_REF + j];
            straight += J[6 * i + j] * u[QDD_REF + j];
        }
        target[12 + i] = twist;
        target[18 + i] = straight + drift[i];
    }
}

static int task_space(kr16_plant *plant, const double *u, const double *x, const double *cs,
                      double *tau)
{
    double in[TASK_INPUTS], found[7];
    memcpy(in + TASK_Q, cs, 12 * sizeof *in);
    memcpy(in + TASK_QD, x + 6, 6 * sizeof *in);
    kr16_motion(plant->p, in, in + TASK_MOTION);
    if (plant->moving)
        kr16_retarget(plant, u, in + TASK_TARGET);
    else
        memcpy(in + TASK_TARGET, plant->target, sizeof plant->target);
    memcpy(in + TASK_KP, plant->kp, sizeof plant->kp);
    memcpy(in + TASK_KD, plant->kd, sizeof plant->kd);
    kr16_task(plant->p, in, found);
    if (found[6] < KR16_FOLD) {
        plant->pitch = kr16_angle(sqrt(fmax(0.0, 1.0 - found[6] * found[6])), found[6]);
        return FOLDED;
    }
    torque_for(plant, x, cs, found, tau);
    return FINE;
}

int kr16_control(kr16_plant *plant, const double *u, const double *x, const double *cs, double *tau)
{
    const double *q = x, *qd = x + 6;
    const double *q_ref = u + Q_REF, *qd_ref = u + QD_REF, *qdd_ref = u + QDD_REF;
    double wanted[6];
    int status;
    switch (plant->mode) {
    case GRAVITY_MODE:
        kr16_gravity(plant->p, cs, tau);
        break;
    case PD_MODE:
        kr16_gravity(plant->p, cs, tau);
        for (int i = 0; i < 6; i++)
            tau[i] = tau[i] + plant->kp[i] * (q_ref[i] - q[i]) + plant->kd[i] * (qd_ref[i] - qd[i]);
        break;
    case COMPUTED_TORQUE_MODE:
        for (int i = 0; i < 6; i++)
            wanted[i] = qdd_ref[i] + plant->kd[i] * (qd_ref[i] - qd[i]) +
                        plant->kp[i] * (q_ref[i] - q[i]);
        torque_for(plant, x, cs, wanted, tau);
        break;
    case TASK_SPACE_MODE:
        if ((status = task_space(plant, u, x, cs, tau)) != FINE)
            return status;
        break;
    default:
        memcpy(tau, u + TAU, 6 * sizeof *tau);
        return FINE;
    }
    for (int i = 0; i < 6; i++)
        tau[i] += u[TAU + i];
    return FINE;
}
