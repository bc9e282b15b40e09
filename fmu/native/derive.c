/* How outputs change along a direction of states and inputs: exact.
 *
 * Only inverse dynamics is differentiated for the motion: from M qdd + h(q, qd) = tau follows
 * M dqdd = dtau - d(M a + h) along (dq, dqd) at the fixed a = qdd.
 */
#include <math.h>
#include <string.h>

#include "kr16_fmu.h"
#include "tape.h"

/* Cosines and sines of angles, and their rates along dq. */
static void trig_along(const double *cs, const double *dq, double *dcs)
{
    for (int i = 0; i < 6; i++) {
        dcs[i] = -cs[6 + i] * dq[i];
        dcs[6 + i] = cs[i] * dq[i];
    }
}

typedef struct {
    kr16_plant *plant;
    double u[INPUTS], x[STATES], cs[12];
    double du[INPUTS], dx[STATES], dcs[12]; /* the direction */
} point;

/* d(M a + h(q, qd)) for accelerations a that move by da. */
static void torque_along(const point *at, const double *qd, const double *dqd, const double *a,
                         const double *da, double *dtau)
{
    double in[24], din[24];
    memcpy(in, at->cs, 12 * sizeof *in);
    memcpy(in + 12, qd, 6 * sizeof *in);
    memcpy(in + 18, a, 6 * sizeof *in);
    memcpy(din, at->dcs, 12 * sizeof *in);
    memcpy(din + 12, dqd, 6 * sizeof *in);
    memcpy(din + 18, da, 6 * sizeof *in);
    kr16_along(&kr16_inverse_dynamics_tape, at->plant->p, in, din, NULL, dtau);
}

static void add_friction(const point *at, double sign, double *dtau)
{
    double extra[6];
    if (!at->plant->drives)
        return;
    kr16_along(&kr16_friction_tape, at->plant->p, at->x + 6, at->dx + 6, NULL, extra);
    for (int i = 0; i < 6; i++)
        dtau[i] += sign * extra[i];
}

/* Wanted accelerations of computed torque, and their change. */
static void joint_wanted(const point *at, double *a, double *da)
{
    const kr16_plant *plant = at->plant;
    const double *u = at->u, *du = at->du, *x = at->x, *dx = at->dx;
    for (int i = 0; i < 6; i++) {
        const double kp = plant->kp[i], kd = plant->kd[i];
        a[i] = u[QDD_REF + i] + kd * (u[QD_REF + i] - x[6 + i]) + kp * (u[Q_REF + i] - x[i]);
        da[i] = du[QDD_REF + i] + kd * (du[QD_REF + i] - dx[6 + i]) + kp * (du[Q_REF + i] - dx[i]);
    }
}

/* The flange's target and its change. */
static void target_along(const point *at, double *target, double *dtarget)
{
    const double *qd = at->u + QD_REF, *qdd = at->u + QDD_REF;
    const double *dqd = at->du + QD_REF, *dqdd = at->du + QDD_REF;
    double in[18], din[18], motion[54], change[54];
    kr16_retarget(at->plant, at->u, target);
    kr16_trig(at->u + Q_REF, in);
    trig_along(in, at->du + Q_REF, din);
    memcpy(in + 12, qd, 6 * sizeof *in);
    memcpy(din + 12, dqd, 6 * sizeof *in);
    kr16_along(&kr16_motion_tape, at->plant->p, in, din, motion, change);
    memcpy(dtarget, change, 12 * sizeof *dtarget);
    for (int i = 0; i < 6; i++) {
        const double *J = motion + 12 + 6 * i, *dJ = change + 12 + 6 * i;
        dtarget[12 + i] = 0.0;
        dtarget[18 + i] = change[48 + i];
        for (int j = 0; j < 6; j++) {
            dtarget[12 + i] += dJ[j] * qd[j] + J[j] * dqd[j];
            dtarget[18 + i] += dJ[j] * qdd[j] + J[j] * dqdd[j];
        }
    }
}

static void task_wanted(const point *at, double *a, double *da)
{
    kr16_plant *plant = at->plant;
    double in[TASK_INPUTS], din[TASK_INPUTS] = {0.0}, found[7], change[7];
    memcpy(in + TASK_Q, at->cs, 12 * sizeof *in);
    memcpy(in + TASK_QD, at->x + 6, 6 * sizeof *in);
    memcpy(din + TASK_Q, at->dcs, 12 * sizeof *in);
    memcpy(din + TASK_QD, at->dx + 6, 6 * sizeof *in);
    kr16_along(&kr16_motion_tape, plant->p, in, din, in + TASK_MOTION, din + TASK_MOTION);
    target_along(at, in + TASK_TARGET, din + TASK_TARGET);
    memcpy(in + TASK_KP, plant->kp, sizeof plant->kp);
    memcpy(in + TASK_KD, plant->kd, sizeof plant->kd);
    kr16_along(&kr16_task_tape, plant->p, in, din, found, change);
    memcpy(a, found, 6 * sizeof *a);
    memcpy(da, change, 6 * sizeof *da);
}

/* What is asked of the drives. */
static void asked_along(const point *at, double *dtau)
{
    static const double zero[6] = {0.0};
    const kr16_plant *plant = at->plant;
    double a[6], da[6];
    memset(dtau, 0, 6 * sizeof *dtau);
    switch (plant->mode) {
    case GRAVITY_MODE:
        torque_along(at, zero, zero, zero, zero, dtau);
        break;
    case PD_MODE:
        torque_along(at, zero, zero, zero, zero, dtau);
        for (int i = 0; i < 6; i++)
            dtau[i] += plant->kp[i] * (at->du[Q_REF + i] - at->dx[i]) +
                       plant->kd[i] * (at->du[QD_REF + i] - at->dx[6 + i]);
        break;
    case COMPUTED_TORQUE_MODE:
    case TASK_SPACE_MODE:
        if (plant->mode == TASK_SPACE_MODE)
            task_wanted(at, a, da);
        else
            joint_wanted(at, a, da);
        torque_along(at, at->x + 6, at->dx + 6, a, da, dtau);
        add_friction(at, 1.0, dtau);
        break;
    default:
        break;
    }
    for (int i = 0; i < 6; i++)
        dtau[i] += at->du[TAU + i];
}

/* What the drives give: torque held to its limit, and faded out above the speed limit. */
static void applied_along(const point *at, const double *asked, double *dtau)
{
    const kr16_plant *plant = at->plant;
    if (!plant->bound)
        return;
    for (int i = 0; i < 6; i++) {
        const double most = plant->torque[i], speed = plant->speed[i], rate = at->x[6 + i];
        const double held = fmax(-most, fmin(most, asked[i]));
        if (held != asked[i])
            dtau[i] = 0.0;
        if (held * rate > 0.0 && fabs(rate) > speed) {
            const double part = 1.0 - (fabs(rate) / speed - 1.0) / KR16_FADE;
            const double fall = -copysign(1.0, rate) / (speed * KR16_FADE) * at->dx[6 + i];
            dtau[i] = part > 0.0 ? part * dtau[i] + held * fall : 0.0;
        }
    }
}

/* Change of a stop's push with its depth and speed. */
static double push_along(double depth, double speed, double k, double ddepth, double dspeed)
{
    const double lean = 1.0 + KR16_STOP_BOUNCE * speed;
    if (!(depth > 0.0) || !(k * depth * lean > 0.0))
        return 0.0;
    return k * (ddepth * lean + depth * KR16_STOP_BOUNCE * dspeed);
}

static void add_contact(const point *at, double *dtau)
{
    const kr16_plant *plant = at->plant;
    for (int i = 0; plant->stops && i < 6; i++) {
        const double q = at->x[i], qd = at->x[6 + i], dq = at->dx[i], dqd = at->dx[6 + i];
        const double k = plant->stiffness[i];
        dtau[i] += push_along(kr16_robot.lower[i] - q, -qd, k, -dq, -dqd);
        dtau[i] -= push_along(q - kr16_robot.upper[i], qd, k, dq, dqd);
    }
}

static void add_wrench(const point *at, double *dtau)
{
    const double *w = at->u + WRENCH, *dw = at->du + WRENCH;
    double in[18] = {0.0}, din[18] = {0.0}, motion[54], change[54];
    memcpy(in, at->cs, 12 * sizeof *in);
    memcpy(din, at->dcs, 12 * sizeof *in);
    kr16_along(&kr16_motion_tape, at->plant->p, in, din, motion, change);
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++)
            dtau[j] += change[12 + 6 * i + j] * w[i] + motion[12 + 6 * i + j] * dw[i];
}

/* Accelerations: dtau is what the drives' torques change by, and is spent. */
static void accelerate_along(const point *at, const double *qdd, double *dtau, double *dqdd)
{
    static const double zero[6] = {0.0};
    double in[42], bent[6];
    add_wrench(at, dtau);
    add_contact(at, dtau);
    add_friction(at, -1.0, dtau);
    torque_along(at, at->x + 6, at->dx + 6, qdd, zero, bent);
    kr16_mass_matrix(at->plant->p, at->cs, in);
    for (int i = 0; i < 6; i++)
        in[36 + i] = dtau[i] - bent[i];
    kr16_solve(NULL, in, dqdd);
}

/* Kinetic energy qd M qd / 2, of which M qd = (M qd + G) - G, and potential, whose slope is G. */
static void energy_along(const point *at, double *denergy)
{
    static const double zero[6] = {0.0};
    double mass[36], with[6], without[6], gravity[6];
    const double *qd = at->x + 6;
    kr16_mass_matrix(at->plant->p, at->cs, mass);
    kr16_gravity(at->plant->p, at->cs, gravity);
    torque_along(at, zero, zero, qd, zero, with);
    torque_along(at, zero, zero, zero, zero, without);
    denergy[0] = denergy[1] = 0.0;
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j < 6; j++)
            denergy[0] += qd[i] * mass[6 * i + j] * at->dx[6 + j];
        denergy[0] += 0.5 * qd[i] * (with[i] - without[i]);
        denergy[1] += gravity[i] * at->dx[i];
    }
}

static const uint32_t torques = 1u << GROUP_QDD | 1u << GROUP_TAU_APPLIED | 1u << GROUP_TAU_WANTED |
                                1u << GROUP_MARGIN;

/* What slots of the groups change by along dx and du; an error where they cannot be computed. */
int kr16_outputs_along(kr16_instance *instance, uint32_t groups, const double *dx, const double *du,
                 double *change)
{
    kr16_core *core = &instance->core;
    point at;
    double asked[6] = {0.0}, dtau[6];
    if (kr16_ready(instance) != OK || (groups & 1u << GROUP_QDD && kr16_compute(instance, GROUP_QDD)))
        return ERROR;
    at.plant = &core->plant;
    kr16_plant_inputs(&core->plant, core->value[SLOT_TIME], at.u);
    memcpy(at.x, core->value + SLOT_Q, sizeof at.x);
    memcpy(at.du, du, sizeof at.du);
    memcpy(at.dx, dx, sizeof at.dx);
    kr16_trig(at.x, at.cs);
    trig_along(at.cs, dx, at.dcs);
    memcpy(change + SLOT_Q, dx, sizeof at.dx);
    if (groups & 1u << GROUP_POSE)
        kr16_along(&kr16_pose_tape, at.plant->p, at.cs, at.dcs, NULL, change + SLOT_POSE_X);
    if (groups & 1u << GROUP_ENERGY)
        energy_along(&at, change + SLOT_ENERGY_KINETIC);
    if (!(groups & torques))
        return OK;
    if (kr16_asked(at.plant, core->value[SLOT_TIME], at.x, at.cs, asked) != FINE)
        return kr16_fail(instance, "derivatives: the orientation error is folded over");
    asked_along(&at, dtau);
    memcpy(change + SLOT_TAU_WANTED, dtau, sizeof dtau);
    for (int i = 0; i < 6; i++) {
        double *margin = change + SLOT_MARGIN_LOWER + i;
        margin[0] = dx[i];
        margin[6] = -dx[i];
        margin[12] = isfinite(kr16_robot.speed[i]) ? -copysign(dx[6 + i], at.x[6 + i] * dx[6 + i]) : 0.0;
        margin[18] = isfinite(kr16_robot.torque[i]) ? -copysign(1.0, asked[i]) * dtau[i] : 0.0;
    }
    applied_along(&at, asked, dtau);
    memcpy(change + SLOT_TAU_APPLIED, dtau, sizeof dtau);
    if (groups & 1u << GROUP_QDD)
        accelerate_along(&at, core->value + SLOT_QDD, dtau, change + SLOT_QDD);
    return OK;
}
