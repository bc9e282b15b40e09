/* Phases of an instance, its steps in co-simulation, its states in model exchange.
 *
 * The same as kr16cli/fmi/machine.py.
 */
#include <math.h>
#include <string.h>

#include "kr16_fmu.h"

#define MOST_PARTS 1e8 /* internal steps of a communication step: minutes of work */

static const char *const phases[] = {
    "instantiated", "initializing", "in event mode", "in continuous-time mode",
    "stepping",     "terminated",   "failed"};

const char *kr16_phase(const kr16_instance *instance)
{
    return phases[instance->core.phase];
}

int kr16_must_be(kr16_instance *instance, const char *call, unsigned allowed)
{
    const char *wanted = "another state";
    if (allowed >> instance->core.phase & 1u)
        return OK;
    for (int k = FAILED; k >= 0; k--)
        if (allowed >> k & 1u)
            wanted = phases[k];
    return kr16_fail(instance, "%s in the wrong order: the instance is %s, not %s", call,
                     kr16_phase(instance), wanted);
}

int kr16_setup(kr16_instance *instance, int has_tolerance, double tolerance, double start,
               int has_stop, double stop)
{
    if (!isfinite(start))
        return kr16_fail(instance, "start time %g: must be a finite number", start);
    if (has_stop && !(stop >= start))
        return kr16_fail(instance, "stop time %g: must not lie before the start time %g", stop,
                         start);
    if (has_tolerance && !(tolerance > 0.0 && isfinite(tolerance)))
        return kr16_fail(instance, "tolerance %g: must be a positive number", tolerance);
    instance->core.value[SLOT_TIME] = start;
    instance->core.stop = has_stop ? stop : HUGE_VAL;
    if (has_tolerance) /* finer than rounding allows no step */
        instance->core.tolerance = fmax(tolerance, 1e-13);
    instance->core.ready = 0;
    kr16_stale(instance);
    return OK;
}

void kr16_hold_flags(kr16_instance *instance)
{
    /* An orientation error that is folded over leaves the flags of torque as they were, and is
     * told of by what asks for it. */
    kr16_teller *tell = instance->tell;
    instance->tell = NULL;
    for (int group = GROUP_LIMIT_POSITION; group <= GROUP_LIMIT_TORQUE; group++)
        kr16_compute(instance, group);
    instance->core.fresh &= ~(1u << GROUP_MARGIN); /* margins depend on the flags */
    instance->tell = tell;
}

int kr16_leave_initialization(kr16_instance *instance)
{
    if (kr16_ready(instance) != OK)
        return ERROR;
    if (instance->model_exchange || instance->event_mode) {
        instance->core.phase = EVENT;
    } else {
        instance->core.phase = STEPPING;
    }
    kr16_stale(instance);
    return OK;
}

void kr16_watch(kr16_instance *instance)
{
    kr16_core *core = &instance->core;
    if (kr16_robot.part != ROBOT)
        return;
    for (int i = 0; i < 6; i++) {
        const double angle = core->value[SLOT_Q + i];
        const uint32_t bit = 1u << i;
        if (kr16_robot.lower[i] <= angle && angle <= kr16_robot.upper[i]) {
            core->beyond &= ~bit;
        } else if (!(core->beyond & bit)) {
            core->beyond |= bit;
            kr16_say(instance, WARNING, LOG_WARNINGS,
                     "at %.6g s %.15s is at %.4g rad, outside its range of %.4g to %.4g rad",
                     core->value[SLOT_TIME], kr16_robot.joints[i], angle, kr16_robot.lower[i],
                     kr16_robot.upper[i]);
        }
    }
}

/* The instance stays at the state x that it had before. */
static int diverged(kr16_instance *instance, double time, const double *x, int status)
{
    kr16_core *core = &instance->core;
    const char *reason = status == FOLDED ? "the orientation error passes 88.9 deg of pitch"
                         : status == STEP_VANISHED
                             ? "the solver's step vanished"
                             : "the motion is faster than the step can follow";
    memcpy(core->value + SLOT_Q, x, STATES * sizeof *x);
    core->value[SLOT_TIME] = time;
    kr16_stale(instance);
    core->phase = FAILED;
    return kr16_fail(instance,
                     "at %.6g s the state leaves the range of numbers: %s; before, q = %.6g %.6g "
                     "%.6g %.6g %.6g %.6g rad, qd = %.6g %.6g %.6g %.6g %.6g %.6g rad/s; reset, "
                     "then try smaller torques or a smaller solver.step",
                     time, reason, x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9],
                     x[10], x[11]);
}

/* Whether a flag does not fit (t, x): an event is due. */
static int due(kr16_instance *instance, double t, const double *x)
{
    kr16_core *core = &instance->core;
    const double *position = core->value + SLOT_LIMIT_POSITION;
    const double *speed = core->value + SLOT_LIMIT_SPEED, *torque = core->value + SLOT_LIMIT_TORQUE;
    double tau[6] = {0.0}, cs[12], margin[24];
    kr16_trig(x, cs);
    kr16_asked(&core->plant, t, x, cs, tau);
    kr16_margins(core->value, x, tau, margin);
    for (int i = 0; i < 6; i++)
        if ((margin[i] < 0.0 || margin[6 + i] < 0.0) != (position[i] != 0.0) ||
            (margin[12 + i] < 0.0) != (speed[i] != 0.0) ||
            (margin[18 + i] < 0.0) != (torque[i] != 0.0))
            return 1;
    return 0;
}

/* The step from `before`, cut where an event becomes due: its part of h. One that was due before,
 * as inputs have jumped, does not cut it, so that time goes on whatever the host does. */
static double cut(kr16_instance *instance, double t, double h, const double *before, double *x,
                  int *event)
{
    kr16_core *core = &instance->core;
    double low = 0.0, high = 1.0, y[STATES];
    if (!due(instance, t + h, x))
        return 1.0;
    *event = 1;
    if (due(instance, t, before))
        return 1.0;
    for (int k = 0; k < 60 && high - low > 1e-12; k++) {
        const double middle = 0.5 * (low + high);
        double hint = core->hint;
        memcpy(y, before, sizeof y);
        if (kr16_advance(&core->plant, t, middle * h, y, &hint) != FINE)
            return 1.0;
        if (!due(instance, t + middle * h, y)) {
            low = middle;
        } else {
            high = middle;
            memcpy(x, y, sizeof y);
        }
    }
    return high;
}

/* The motion of a communication step, cut into equal internal ones. */
static int moved(kr16_instance *instance, double time, double size, kr16_step_result *result)
{
    kr16_core *core = &instance->core;
    double x[STATES], before[STATES], until = HUGE_VAL;
    const double step = core->plant.method == DORMAND_PRINCE ? size : core->plant.step;
    const double parts = fmax(1.0, ceil(size / step - 1e-9)), h = size / parts;
    memcpy(x, core->value + SLOT_Q, sizeof x);
    core->plant.known = time == core->value[SLOT_TIME] && core->fresh >> GROUP_QDD & 1u;
    memcpy(core->plant.qdd, core->value + SLOT_QDD, sizeof core->plant.qdd);
    for (double k = 0.0; k < parts; k += 1.0) {
        double t = time + k * h, done = 1.0;
        memcpy(before, x, sizeof x);
        const int status = kr16_advance(&core->plant, t, h, x, &core->hint);
        if (status != FINE) {
            result->reached = t;
            return diverged(instance, t, before, status);
        }
        if (instance->event_mode)
            done = cut(instance, t, h, before, x, &result->event);
        result->reached = k + 1.0 == parts && done == 1.0 ? time + size : t + done * h;
        if (instance->between) {
            memcpy(core->value + SLOT_Q, x, sizeof x);
            core->value[SLOT_TIME] = result->reached;
            kr16_stale(instance);
            if (instance->between(instance, result->reached, &until) && instance->early_return)
                result->early = 1;
        }
        if ((result->event && instance->early_return) || result->early) {
            result->early = result->reached < time + size;
            break;
        }
        if (done < 1.0) { /* no return: the rest of this part */
            memcpy(x, before, sizeof x);
            kr16_advance(&core->plant, t, h, x, &core->hint);
            result->reached = k + 1.0 == parts ? time + size : t + h;
        }
    }
    memcpy(core->value + SLOT_Q, x, sizeof x);
    return OK;
}

int kr16_do_step(kr16_instance *instance, double time, double size, kr16_step_result *result)
{
    kr16_core *core = &instance->core;
    const double now = core->value[SLOT_TIME];
    *result = (kr16_step_result){now, 0, 0};
    if (kr16_must_be(instance, "doStep", 1u << STEPPING) != OK)
        return ERROR;
    if (!(isfinite(size) && size > 0.0))
        return kr16_fail(instance, "communication step %g s: must be a positive number", size);
    const double slack = 1e-9 * fmax(1.0, fmax(fabs(time), fabs(now)));
    if (!(isfinite(time) && fabs(time - now) <= fmax(slack, 1e-6 * size)))
        return kr16_fail(instance,
                         "communication point %g s: the instance stands at %g s; go on from there, "
                         "or set back its state first",
                         time, now);
    if (!(time + size <= core->stop + fmax(slack, 1e-6 * size)))
        return kr16_fail(instance,
                         "communication step of %g s at %g s: it goes past the stop time, %g s; make "
                         "it smaller",
                         size, time, core->stop);
    if (kr16_ready(instance) != OK)
        return ERROR;
    if (!(size / core->plant.step <= MOST_PARTS))
        return kr16_fail(instance,
                         "communication step %g s: more than %g times solver.step, %g s; make it "
                         "smaller",
                         size, MOST_PARTS, core->plant.step);
    result->reached = time + size;
    if (kr16_robot.part == ROBOT && moved(instance, time, size, result) != OK)
        return ERROR;
    core->value[SLOT_TIME] = result->reached;
    if (core->plant.moving) { /* what rose stays where it is now */
        for (int i = 0; i < INPUTS; i++)
            core->value[i] += core->rise[i] * (result->reached - time);
        memset(core->rise, 0, sizeof core->rise);
        core->current = 0;
    }
    kr16_stale(instance);
    kr16_watch(instance);
    return OK;
}

int kr16_states(void)
{
    return kr16_robot.part == ROBOT ? STATES : 0;
}

int kr16_indicators(void)
{
    return kr16_robot.part == ROBOT ? 24 : 0;
}

int kr16_set_states(kr16_instance *instance, const double *x, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!isfinite(x[i]) || (i < 6 && fabs(x[i]) > KR16_FARTHEST))
            return kr16_fail(instance, "setContinuousStates: number %lu is %g; it must be finite, "
                                       "and an angle at most %g rad",
                             (unsigned long)i + 1, x[i], KR16_FARTHEST);
    if (n) /* NULL may then come with it */
        memcpy(instance->core.value + SLOT_Q, x, n * sizeof *x);
    kr16_stale(instance);
    return OK;
}

int kr16_derivatives(kr16_instance *instance, double *dx, size_t n)
{
    const double *value = instance->core.value;
    if (!n)
        return OK;
    if (kr16_compute(instance, GROUP_QDD) != OK)
        return ERROR;
    memcpy(dx, value + SLOT_QD, 6 * sizeof *dx);
    memcpy(dx + 6, value + SLOT_QDD, 6 * sizeof *dx);
    return OK;
}
