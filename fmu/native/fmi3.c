/* FMI 3.0 over the machine: co-simulation and model exchange. */
#include "fmi3Functions.h"

#include <string.h>

#include "kr16_fmi3.h"

static void tell(kr16_instance *self, int status, const char *category, const char *text)
{
    fmi3LogMessageCallback log = (fmi3LogMessageCallback)self->callback;
    if (log)
        log(self->environment, (fmi3Status)status, category, text);
}

/* The host may read values, and have the step end here. */
static int between(kr16_instance *self, double time, double *until)
{
    fmi3IntermediateUpdateCallback update = (fmi3IntermediateUpdateCallback)self->update;
    fmi3Boolean wanted = fmi3False;
    update(self->environment, time, fmi3False, fmi3True, fmi3True, self->early_return != 0, &wanted,
           until);
    return wanted && self->early_return;
}

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t n,
                               const fmi3String names[])
{
    ENTER("setDebugLogging", ANY);
    return (fmi3Status)kr16_log_categories(self, on, n, names);
}

static kr16_instance *made(fmi3String name, fmi3String token, int model_exchange,
                           fmi3Boolean logging, void *environment, fmi3LogMessageCallback log)
{
    kr16_instance *self = kr16_new(name, 3, model_exchange);
    if (!self)
        return NULL;
    self->tell = tell;
    self->environment = environment;
    self->callback = (void (*)(void))log;
    kr16_log_categories(self, logging, 0, NULL);
    if (token && strcmp(token, kr16_robot.token) == 0)
        return self;
    kr16_fail(self, "instantiate: the token %.60s is not that of this build, %.60s",
              token ? token : "(none)", kr16_robot.token);
    kr16_free(self);
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    (void)resources;
    (void)visible;
    return made(name, token, 1, logging, environment, log);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                         fmi3Boolean visible, fmi3Boolean logging,
                                         fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference required[], size_t n,
                                         fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update)
{
    (void)resources;
    (void)visible;
    (void)required; /* any value may be read between steps */
    (void)n;
    kr16_instance *self = made(name, token, 0, logging, environment, log);
    if (!self)
        return NULL;
    self->event_mode = event_mode;
    self->early_return = early_return;
    self->update = (void (*)(void))update;
    self->between = update ? between : NULL;
    return self;
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3ClockUpdateCallback clock, fmi3LockPreemptionCallback lock,
    fmi3UnlockPreemptionCallback unlock)
{
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)clock;
    (void)lock;
    (void)unlock;
    if (log)
        log(environment, fmi3Error, "logStatusError",
            "instantiate: there is no scheduled execution; use co-simulation or model exchange");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    kr16_free(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop)
{
    ENTER("enterInitializationMode", AT(INSTANTIATED));
    if (kr16_setup(self, has_tolerance, tolerance, start, has_stop, stop) != OK)
        return fmi3Error;
    self->core.phase = INITIALIZING;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    ENTER("exitInitializationMode", AT(INITIALIZING));
    return (fmi3Status)kr16_leave_initialization(self);
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    ENTER("enterEventMode", AT(CONTINUOUS_TIME) | AT(STEPPING));
    if (!self->model_exchange && !self->event_mode)
        return (fmi3Status)kr16_fail(self, "enterEventMode: it was not asked for at instantiation");
    self->core.phase = EVENT;
    kr16_stale(self);
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    ENTER("terminate", ANY & ~AT(TERMINATED));
    self->core.phase = TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    ENTER("reset", ANY);
    return (fmi3Status)kr16_reset(self);
}

/* Values ---------------------------------------------------------------------------------- */

#define GETTER(NAME, TYPE, WANT, CONVERTED)                                                        \
    fmi3Status fmi3Get##NAME(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,       \
                             TYPE value[], size_t room)                                            \
    {                                                                                              \
        size_t used = 0;                                                                           \
        ENTER("get" #NAME, ANY);                                                                   \
        NEED(!n || (vr && value), "get" #NAME);                                                    \
        for (size_t k = 0; k < n; k++) {                                                           \
            const double *found;                                                                   \
            size_t count;                                                                          \
            if (kr16_look(self, "get" #NAME, vr[k], WANT, &found, &count) != OK)                   \
                return fmi3Error;                                                                  \
            if (count > room - used)                                                               \
                return (fmi3Status)kr16_fail(self, "get" #NAME ": room for %lu values is too little", \
                                             (unsigned long)room);                                 \
            for (size_t i = 0; i < count; i++)                                                     \
                value[used++] = CONVERTED;                                                         \
        }                                                                                          \
        if (used != room)                                                                          \
            return (fmi3Status)kr16_fail(self, "get" #NAME ": room for %lu values; there are %lu", \
                                         (unsigned long)room, (unsigned long)used);                \
        return fmi3OK;                                                                             \
    }

#define SETTER(NAME, TYPE, WANT, FROM)                                                             \
    fmi3Status fmi3Set##NAME(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,       \
                             const TYPE value[], size_t count)                                     \
    {                                                                                              \
        ENTER("set" #NAME, ANY);                                                                   \
        return (fmi3Status)kr16_put(self, "set" #NAME, vr, n, WANT, FROM, value, count);           \
    }

/* Some hosts read Booleans as numbers. */
GETTER(Float64, fmi3Float64, WANT_REAL | WANT_INTEGER | WANT_BOOLEAN, found[i])
GETTER(Int32, fmi3Int32, WANT_INTEGER | WANT_BOOLEAN, (fmi3Int32)found[i])
GETTER(Boolean, fmi3Boolean, WANT_BOOLEAN, found[i] != 0.0)
SETTER(Float64, fmi3Float64, WANT_REAL, FROM_DOUBLE)
SETTER(Int32, fmi3Int32, WANT_INTEGER, FROM_INT)
SETTER(Boolean, fmi3Boolean, WANT_BOOLEAN, FROM_BOOL)

/* States ---------------------------------------------------------------------------------- */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    ENTER("getFMUState", ANY);
    NEED(state, "getFMUState");
    return (fmi3Status)kr16_save(self, state);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state)
{
    ENTER("setFMUState", ANY);
    return (fmi3Status)kr16_restore(self, state);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    ENTER("freeFMUState", ANY);
    return (fmi3Status)kr16_forget(self, state);
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
    ENTER("serializedFMUStateSize", ANY);
    NEED(state && size, "serializedFMUStateSize");
    *size = kr16_state_size();
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[],
                                 size_t size)
{
    ENTER("serializeFMUState", ANY);
    return (fmi3Status)kr16_write_state(self, state, bytes, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState *state)
{
    ENTER("deserializeFMUState", ANY);
    return (fmi3Status)kr16_read_state(self, bytes, size, state);
}

/* Derivatives ----------------------------------------------------------------------------- */

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                        size_t n, const fmi3ValueReference knowns[], size_t m,
                                        const fmi3Float64 seeds[], size_t seed_count,
                                        fmi3Float64 results[], size_t result_count)
{
    ENTER("getDirectionalDerivative", ANY & ~AT(INSTANTIATED));
    const kr16_request request = {"getDirectionalDerivative", unknowns, n, knowns, m, seeds,
                                  seed_count, results, result_count};
    return (fmi3Status)kr16_directional(self, &request);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                    size_t n, const fmi3ValueReference knowns[], size_t m,
                                    const fmi3Float64 seeds[], size_t seed_count,
                                    fmi3Float64 results[], size_t result_count)
{
    ENTER("getAdjointDerivative", ANY & ~AT(INSTANTIATED));
    const kr16_request request = {"getAdjointDerivative", unknowns, n, knowns, m, seeds,
                                  seed_count, results, result_count};
    return (fmi3Status)kr16_adjoint(self, &request);
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t count)
{
    ENTER("getOutputDerivatives", AT(STEPPING) | AT(EVENT) | AT(TERMINATED));
    return (fmi3Status)kr16_output_rises(self, vr, n, orders, values, count);
}

/* Phases ---------------------------------------------------------------------------------- */

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    ENTER("evaluateDiscreteStates", AT(INITIALIZING) | AT(EVENT));
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *again,
                                    fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *values, fmi3Boolean *has_next, fmi3Float64 *next)
{
    ENTER("updateDiscreteStates", AT(EVENT));
    NEED(again && terminate && nominals && values && has_next && next, "updateDiscreteStates");
    *again = *terminate = *nominals = *values = *has_next = fmi3False;
    *next = 0.0;
    kr16_hold_flags(self);
    return fmi3OK;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    ENTER("enterContinuousTimeMode", AT(EVENT));
    if (!self->model_exchange)
        return (fmi3Status)kr16_fail(self, "enterContinuousTimeMode: the instance is one of "
                                           "co-simulation");
    kr16_hold_flags(self);
    self->core.phase = CONTINUOUS_TIME;
    return fmi3OK;
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    ENTER("enterStepMode", AT(EVENT));
    if (self->model_exchange)
        return (fmi3Status)kr16_fail(self, "enterStepMode: the instance is one of model exchange");
    kr16_hold_flags(self);
    self->core.phase = STEPPING;
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean final, fmi3Boolean *event,
                                       fmi3Boolean *terminate)
{
    (void)final;
    ENTER("completedIntegratorStep", AT(CONTINUOUS_TIME));
    NEED(event && terminate, "completedIntegratorStep");
    kr16_watch(self);
    *event = *terminate = fmi3False;
    return fmi3OK;
}

/* Model exchange -------------------------------------------------------------------------- */

static fmi3Status sized(kr16_instance *self, const char *call, const void *values, size_t n,
                        int right)
{
    if (!self->model_exchange)
        return (fmi3Status)kr16_fail(self, "%s: the instance is one of co-simulation", call);
    if (n != (size_t)right)
        return (fmi3Status)kr16_fail(self, "%s: %lu numbers; there are %d", call, (unsigned long)n,
                                     right);
    if (n && !values)
        return (fmi3Status)kr16_fail(self, "%s: an argument is missing (NULL)", call);
    return fmi3OK;
}

#define SIZED(name, values, n, right)                                                              \
    if (sized(self, name, values, n, right) != fmi3OK)                                             \
    return fmi3Error

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    ENTER("setTime", AT(EVENT) | AT(CONTINUOUS_TIME));
    SIZED("setTime", NULL, 0, 0);
    if (!(time - time == 0.0))
        return (fmi3Status)kr16_fail(self, "setTime: %g; it must be a finite number", time);
    self->core.value[SLOT_TIME] = time;
    return fmi3OK;
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 x[], size_t n)
{
    ENTER("setContinuousStates", AT(EVENT) | AT(CONTINUOUS_TIME));
    SIZED("setContinuousStates", x, n, kr16_states());
    return (fmi3Status)kr16_set_states(self, x, n);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 dx[], size_t n)
{
    ENTER("getContinuousStateDerivatives", ANY & ~AT(INSTANTIATED));
    SIZED("getContinuousStateDerivatives", dx, n, kr16_states());
    return (fmi3Status)kr16_derivatives(self, dx, n);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 z[], size_t n)
{
    ENTER("getEventIndicators", ANY & ~AT(INSTANTIATED));
    SIZED("getEventIndicators", z, n, kr16_indicators());
    if (n && kr16_compute(self, GROUP_MARGIN) != OK)
        return fmi3Error;
    if (n)
        memcpy(z, self->core.value + SLOT_MARGIN_LOWER, n * sizeof *z);
    return fmi3OK;
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 x[], size_t n)
{
    ENTER("getContinuousStates", ANY);
    SIZED("getContinuousStates", x, n, kr16_states());
    if (n)
        memcpy(x, self->core.value + SLOT_Q, n * sizeof *x);
    return fmi3OK;
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 x[], size_t n)
{
    ENTER("getNominalsOfContinuousStates", ANY);
    SIZED("getNominalsOfContinuousStates", x, n, kr16_states());
    for (size_t i = 0; i < n; i++)
        x[i] = 1.0;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *n)
{
    ENTER("getNumberOfEventIndicators", ANY);
    NEED(n, "getNumberOfEventIndicators");
    *n = (size_t)kr16_indicators();
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *n)
{
    ENTER("getNumberOfContinuousStates", ANY);
    NEED(n, "getNumberOfContinuousStates");
    *n = (size_t)kr16_states();
    return fmi3OK;
}

/* Co-simulation --------------------------------------------------------------------------- */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 size,
                      fmi3Boolean no_set_state, fmi3Boolean *event, fmi3Boolean *terminate,
                      fmi3Boolean *early, fmi3Float64 *reached)
{
    kr16_step_result result;
    (void)no_set_state;
    ENTER("doStep", ANY);
    NEED(event && terminate && early && reached, "doStep");
    const int status = kr16_do_step(self, time, size, &result);
    *event = result.event != 0;
    *terminate = fmi3False;
    *early = result.early != 0;
    *reached = result.reached;
    return (fmi3Status)status;
}
