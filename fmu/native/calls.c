/* The calls that FMI 2.0 and 3.0 have in common. */
#include "calls.h"

#include <math.h>
#include <string.h>

int kr16_enter(kr16_instance *self, const char *call, unsigned allowed)
{
    return self ? kr16_must_be(self, call, allowed) : ERROR;
}

int kr16_missing(kr16_instance *self, const char *call)
{
    return kr16_fail(self, "%s: an argument is missing (NULL)", call);
}

#define ENTER(name, allowed)                                                                       \
    if (kr16_enter(self, name, allowed) != OK)                                                     \
    return ERROR
#define NEED(condition, name)                                                                      \
    if (!(condition))                                                                              \
    return kr16_missing(self, name)

/* Whether the host means this build. */
int kr16_known(kr16_instance *self, const char *token)
{
    if (token && strcmp(token, kr16_robot.token) == 0)
        return 1;
    kr16_fail(self, "instantiate: the token (GUID) %.60s is not that of this build, %.60s",
              token ? token : "(none)", kr16_robot.token);
    return 0;
}

int kr16_call_log(kr16_instance *self, int on, size_t n, const char *const *names)
{
    ENTER("setDebugLogging", ANY);
    return kr16_log_categories(self, on, n, names);
}

int kr16_call_leave_initialization(kr16_instance *self)
{
    ENTER("exitInitializationMode", AT(INITIALIZING));
    return kr16_leave_initialization(self);
}

int kr16_call_terminate(kr16_instance *self)
{
    ENTER("terminate", ANY & ~AT(TERMINATED));
    self->core.phase = TERMINATED;
    return OK;
}

int kr16_call_reset(kr16_instance *self)
{
    return self ? kr16_reset(self) : ERROR;
}

/* Values ---------------------------------------------------------------------------------- */

int kr16_call_get(kr16_instance *self, const char *call, const unsigned *references, size_t n,
                  unsigned want, int type, void *values, size_t count)
{
    return self ? kr16_take(self, call, references, n, want, type, values, count) : ERROR;
}

int kr16_call_set(kr16_instance *self, const char *call, const unsigned *references, size_t n,
                  unsigned want, int type, const void *values, size_t count)
{
    return self ? kr16_put(self, call, references, n, want, type, values, count) : ERROR;
}

/* States ---------------------------------------------------------------------------------- */

int kr16_call_save(kr16_instance *self, void **state)
{
    ENTER("getFMUState", ANY);
    NEED(state, "getFMUState");
    return kr16_save(self, state);
}

int kr16_call_restore(kr16_instance *self, const void *state)
{
    return self ? kr16_restore(self, state) : ERROR;
}

int kr16_call_forget(kr16_instance *self, void **state)
{
    return self ? kr16_forget(self, state) : ERROR;
}

int kr16_call_state_size(kr16_instance *self, const void *state, size_t *size)
{
    ENTER("serializedFMUStateSize", ANY);
    NEED(state && size, "serializedFMUStateSize");
    *size = kr16_state_size();
    return OK;
}

int kr16_call_write_state(kr16_instance *self, const void *state, void *bytes, size_t size)
{
    return self ? kr16_write_state(self, state, bytes, size) : ERROR;
}

int kr16_call_read_state(kr16_instance *self, const void *bytes, size_t size, void **state)
{
    return self ? kr16_read_state(self, bytes, size, state) : ERROR;
}

/* Derivatives ----------------------------------------------------------------------------- */

int kr16_call_derivatives(kr16_instance *self, const kr16_request *request, int adjoint)
{
    ENTER(request->call, ANY & ~AT(INSTANTIATED));
    return adjoint ? kr16_adjoint(self, request) : kr16_directional(self, request);
}

int kr16_call_output_rises(kr16_instance *self, const unsigned *references, size_t n,
                           const int *orders, double *values, size_t count)
{
    ENTER("getOutputDerivatives", AT(STEPPING) | AT(EVENT) | AT(TERMINATED));
    return kr16_output_rises(self, references, n, orders, values, count);
}

/* Phases ---------------------------------------------------------------------------------- */

int kr16_call_event_mode(kr16_instance *self)
{
    ENTER("enterEventMode", AT(EVENT) | AT(CONTINUOUS_TIME) | AT(STEPPING));
    if (!self->model_exchange && !self->event_mode)
        return kr16_fail(self, "enterEventMode: it was not asked for at instantiation");
    self->core.phase = EVENT;
    kr16_stale(self);
    return OK;
}

int kr16_call_after_event(kr16_instance *self, const char *call, int phase)
{
    ENTER(call, AT(EVENT));
    if (self->model_exchange != (phase == CONTINUOUS_TIME))
        return kr16_fail(self, "%s: the instance is one of %s", call,
                         self->model_exchange ? "model exchange" : "co-simulation");
    kr16_hold_flags(self);
    self->core.phase = phase;
    return OK;
}

/* Model exchange -------------------------------------------------------------------------- */

int kr16_call_completed_step(kr16_instance *self, int complete)
{
    ENTER("completedIntegratorStep", AT(CONTINUOUS_TIME));
    NEED(complete, "completedIntegratorStep");
    kr16_watch(self);
    return OK;
}

/* Whether a call of model exchange may go on, with n numbers where there are `right`. */
static int sized(kr16_instance *self, const char *call, unsigned allowed, const void *values,
                 size_t n, int right)
{
    ENTER(call, allowed);
    if (!self->model_exchange)
        return kr16_fail(self, "%s: the instance is one of co-simulation", call);
    if (n != (size_t)right)
        return kr16_fail(self, "%s: %lu numbers; there are %d", call, (unsigned long)n, right);
    NEED(!n || values, call);
    return OK;
}

int kr16_call_set_time(kr16_instance *self, double time)
{
    if (sized(self, "setTime", AT(EVENT) | AT(CONTINUOUS_TIME), NULL, 0, 0) != OK)
        return ERROR;
    if (!isfinite(time))
        return kr16_fail(self, "setTime: %g; it must be a finite number", time);
    self->core.value[SLOT_TIME] = time;
    return OK;
}

int kr16_call_set_states(kr16_instance *self, const double *x, size_t n)
{
    const unsigned allowed = AT(EVENT) | AT(CONTINUOUS_TIME);
    if (sized(self, "setContinuousStates", allowed, x, n, kr16_states()) != OK)
        return ERROR;
    return kr16_set_states(self, x, n);
}

int kr16_call_get_states(kr16_instance *self, double *x, size_t n)
{
    if (sized(self, "getContinuousStates", ANY, x, n, kr16_states()) != OK)
        return ERROR;
    if (n)
        memcpy(x, self->core.value + SLOT_Q, n * sizeof *x);
    return OK;
}

int kr16_call_nominals(kr16_instance *self, double *x, size_t n)
{
    if (sized(self, "getNominalsOfContinuousStates", ANY, x, n, kr16_states()) != OK)
        return ERROR;
    for (size_t i = 0; i < n; i++)
        x[i] = 1.0;
    return OK;
}

int kr16_call_rates(kr16_instance *self, const char *call, double *dx, size_t n)
{
    if (sized(self, call, ANY & ~AT(INSTANTIATED), dx, n, kr16_states()) != OK)
        return ERROR;
    return kr16_derivatives(self, dx, n);
}

int kr16_call_indicators(kr16_instance *self, double *z, size_t n)
{
    const unsigned allowed = ANY & ~AT(INSTANTIATED);
    if (sized(self, "getEventIndicators", allowed, z, n, kr16_indicators()) != OK ||
        (n && kr16_compute(self, GROUP_MARGIN) != OK))
        return ERROR;
    if (n)
        memcpy(z, self->core.value + SLOT_MARGIN_LOWER, n * sizeof *z);
    return OK;
}
