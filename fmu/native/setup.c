/* From the parameters of an instance to its plant. */
#include <math.h>
#include <string.h>

#include "kr16_fmu.h"
#include "tape.h"

#define ROUNDING 1e-12

/* Eigenvalues of a tensor (xx yy zz xy xz yz), rising, by Jacobi's rotations. */
static void principal_moments(const double *tensor, double *moments)
{
    static const int turns[3][3] = {{0, 1, 2}, {0, 2, 1}, {1, 2, 0}};
    double scale = 0.0;
    for (int i = 0; i < 6; i++)
        scale = fmax(scale, fabs(tensor[i]));
    moments[0] = moments[1] = moments[2] = 0.0;
    if (scale == 0.0)
        return;
    double a[3][3] = {{tensor[0] / scale, tensor[3] / scale, tensor[4] / scale},
                      {tensor[3] / scale, tensor[1] / scale, tensor[5] / scale},
                      {tensor[4] / scale, tensor[5] / scale, tensor[2] / scale}};
    for (int sweep = 0; sweep < 10; sweep++)
        for (int n = 0; n < 3; n++) {
            const int p = turns[n][0], q = turns[n][1], r = turns[n][2];
            if (a[p][q] == 0.0)
                continue;
            const double theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            const double t = copysign(1.0, theta) / (fabs(theta) + sqrt(theta * theta + 1.0));
            const double c = 1.0 / sqrt(t * t + 1.0), s = t * c;
            a[p][p] -= t * a[p][q];
            a[q][q] += t * a[p][q];
            a[p][q] = a[q][p] = 0.0;
            const double x = a[r][p], y = a[r][q];
            a[r][p] = a[p][r] = c * x - s * y;
            a[r][q] = a[q][r] = s * x + c * y;
        }
    for (int i = 0; i < 3; i++) {
        const double value = a[i][i] * scale;
        int place = i;
        for (; place > 0 && moments[place - 1] > value; place--)
            moments[place] = moments[place - 1];
        moments[place] = value;
    }
}

static int check_payload(kr16_instance *instance, const double *value)
{
    double m[3];
    principal_moments(value + SLOT_PAYLOAD_INERTIA_XX, m);
    if (m[0] < -ROUNDING * m[2] || m[0] + m[1] < m[2] * (1.0 - ROUNDING))
        return kr16_fail(instance,
                         "payload inertia has principal moments %.6g, %.6g, %.6g kg m2; no rigid "
                         "body has that (none negative, any two at least the third)",
                         m[0], m[1], m[2]);
    return OK;
}

static void pack(const double *value, double *p)
{
    double x[97] = {0.0}, none[KR16_PARAMETERS] = {0.0};
    memcpy(x, kr16_robot.geometry, sizeof kr16_robot.geometry);
    memcpy(x + 6, kr16_robot.links, sizeof kr16_robot.links);
    if (value[SLOT_PAYLOAD_MASS] != 0.0)
        memcpy(x + 66, value + SLOT_PAYLOAD_MASS, 10 * sizeof *x);
    memcpy(x + 76, value + SLOT_GRAVITY_X, 3 * sizeof *x);
    if (value[SLOT_DRIVES] != 0.0) /* rotors, then both frictions */
        memcpy(x + 79, value + SLOT_ROTOR_INERTIA, 18 * sizeof *x);
    kr16_along(&kr16_parameters_tape, none, x, none, p, NULL);
    kr16_keep(p, NULL, p + KR16_PARAMETERS);
}

static int is_sparse(const double *p)
{
    static const uint8_t zeros[] = KR16_ZEROS;
    for (size_t k = 0; k < sizeof zeros; k++)
        if (p[zeros[k]] != 0.0)
            return 0;
    return 1;
}

static void gains(kr16_plant *plant, const double *value)
{
    double cs[12], mass[36];
    for (int i = 0; i < 6; i++) {
        const double w = value[SLOT_CONTROL_FREQUENCY + i];
        plant->kp[i] = w * w;
        plant->kd[i] = 2.0 * value[SLOT_CONTROL_DAMPING] * w;
    }
    if (plant->mode != PD_MODE)
        return;
    kr16_trig(value + SLOT_Q_START, cs);
    kr16_mass_matrix(plant->p, cs, mass);
    for (int i = 0; i < 6; i++) {
        plant->kp[i] *= mass[7 * i];
        plant->kd[i] *= mass[7 * i];
    }
}

static int set_up(kr16_instance *instance)
{
    const double *value = instance->core.value;
    kr16_plant *plant = &instance->core.plant;
    if (check_payload(instance, value) != OK)
        return ERROR;
    memset(plant, 0, sizeof *plant);
    pack(value, plant->p);
    plant->sparse = is_sparse(plant->p);
    plant->drives = value[SLOT_DRIVES] != 0.0;
    plant->stops = value[SLOT_LIMITS_JOINT] == 2.0;
    plant->mode = (int)value[SLOT_CONTROL_MODE];
    plant->method = (int)value[SLOT_SOLVER_METHOD];
    if (plant->method == AUTO)
        plant->method = plant->drives || plant->stops ? ROSENBROCK : RK4;
    plant->step = value[SLOT_SOLVER_STEP];
    plant->tolerance = instance->core.tolerance;
    const int torque = value[SLOT_LIMITS_TORQUE] != 0.0, speed = value[SLOT_LIMITS_SPEED] != 0.0;
    plant->bound = torque || speed;
    for (int i = 0; i < 6; i++) {
        const double most = kr16_robot.torque[i];
        plant->torque[i] = torque ? most : HUGE_VAL;
        plant->speed[i] = speed ? kr16_robot.speed[i] : HUGE_VAL;
        plant->stiffness[i] = (isfinite(most) ? most : KR16_STOP_TORQUE) / KR16_STOP_DEPTH;
    }
    gains(plant, value);
    return OK;
}

static void take_inputs(kr16_core *core)
{
    kr16_plant *plant = &core->plant;
    memcpy(plant->u, core->value, sizeof plant->u);
    memcpy(plant->rise, core->rise, sizeof plant->rise);
    plant->since = core->value[SLOT_TIME];
    plant->moving = plant->pushed = 0;
    for (int i = 0; i < INPUTS; i++)
        plant->moving |= plant->rise[i] != 0.0;
    for (int i = WRENCH; i < INPUTS; i++)
        plant->pushed |= plant->u[i] != 0.0 || plant->rise[i] != 0.0;
    if (plant->mode == TASK_SPACE_MODE)
        kr16_retarget(plant, plant->u, plant->target);
}

int kr16_ready(kr16_instance *instance)
{
    kr16_core *core = &instance->core;
    if (!core->ready) {
        if (set_up(instance) != OK)
            return ERROR;
        core->ready = 1;
        core->current = 0;
    }
    if (!core->current) {
        take_inputs(core);
        core->current = 1;
    }
    return OK;
}
