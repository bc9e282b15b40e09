/* FMI 3.0 over the machine: co-simulation and model exchange. */
#include "fmi3Functions.h"

#include "kr16_fmi3.h"

static void tell3(kr16_instance *self, int status, const char *category, const char *text)
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
    return (fmi3Status)kr16_call_log(instance, on, n, names);
}

static kr16_instance *made(fmi3String name, fmi3String token, int model_exchange,
                           fmi3Boolean logging, void *environment, fmi3LogMessageCallback log)
{
    kr16_instance *self = kr16_new(name, 3, model_exchange);
    if (!self)
        return NULL;
    self->tell = tell3;
    self->environment = environment;
    self->callback = (void (*)(void))log;
    kr16_log_categories(self, logging, 0, NULL);
    if (kr16_known(self, token))
        return self;
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
    return (fmi3Status)kr16_call_leave_initialization(instance);
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    return (fmi3Status)kr16_call_event_mode(instance);
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    return (fmi3Status)kr16_call_terminate(instance);
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    return (fmi3Status)kr16_call_reset(instance);
}

/* Values. Some hosts read Booleans as numbers. ---------------------------------------------- */

#define VALUES(NAME, TYPE, CODE, READ, WRITTEN)                                                    \
    fmi3Status fmi3Get##NAME(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,       \
                             TYPE value[], size_t count)                                           \
    {                                                                                              \
        return (fmi3Status)kr16_call_get(instance, "get" #NAME, vr, n, READ, CODE, value, count);  \
    }                                                                                              \
    fmi3Status fmi3Set##NAME(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,       \
                             const TYPE value[], size_t count)                                     \
    {                                                                                              \
        return (fmi3Status)kr16_call_set(instance, "set" #NAME, vr, n, WRITTEN, CODE, value,       \
                                         count);                                                   \
    }

VALUES(Float64, fmi3Float64, AS_DOUBLE, WANT_REAL | WANT_INTEGER | WANT_BOOLEAN, WANT_REAL)
VALUES(Int32, fmi3Int32, AS_INT, WANT_INTEGER | WANT_BOOLEAN, WANT_INTEGER)
VALUES(Boolean, fmi3Boolean, AS_BOOL, WANT_BOOLEAN, WANT_BOOLEAN)

/* States ---------------------------------------------------------------------------------- */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    return (fmi3Status)kr16_call_save(instance, state);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state)
{
    return (fmi3Status)kr16_call_restore(instance, state);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    return (fmi3Status)kr16_call_forget(instance, state);
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
    return (fmi3Status)kr16_call_state_size(instance, state, size);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[],
                                 size_t size)
{
    return (fmi3Status)kr16_call_write_state(instance, state, bytes, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState *state)
{
    return (fmi3Status)kr16_call_read_state(instance, bytes, size, state);
}

/* Derivatives ----------------------------------------------------------------------------- */

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                        size_t n, const fmi3ValueReference knowns[], size_t m,
                                        const fmi3Float64 seeds[], size_t seed_count,
                                        fmi3Float64 results[], size_t result_count)
{
    const kr16_request request = {"getDirectionalDerivative", unknowns, n, knowns, m, seeds,
                                  seed_count, results, result_count};
    return (fmi3Status)kr16_call_derivatives(instance, &request, 0);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[],
                                    size_t n, const fmi3ValueReference knowns[], size_t m,
                                    const fmi3Float64 seeds[], size_t seed_count,
                                    fmi3Float64 results[], size_t result_count)
{
    const kr16_request request = {"getAdjointDerivative", unknowns, n, knowns, m, seeds,
                                  seed_count, results, result_count};
    return (fmi3Status)kr16_call_derivatives(instance, &request, 1);
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t count)
{
    return (fmi3Status)kr16_call_output_rises(instance, vr, n, orders, values, count);
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
    return (fmi3Status)kr16_call_after_event(instance, "enterContinuousTimeMode", CONTINUOUS_TIME);
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    return (fmi3Status)kr16_call_after_event(instance, "enterStepMode", STEPPING);
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean final, fmi3Boolean *event,
                                       fmi3Boolean *terminate)
{
    const fmi3Status status = (fmi3Status)kr16_call_completed_step(instance, event && terminate);
    (void)final;
    if (status == fmi3OK)
        *event = *terminate = fmi3False;
    return status;
}

/* Model exchange -------------------------------------------------------------------------- */

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    return (fmi3Status)kr16_call_set_time(instance, time);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 x[], size_t n)
{
    return (fmi3Status)kr16_call_set_states(instance, x, n);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 dx[], size_t n)
{
    return (fmi3Status)kr16_call_rates(instance, "getContinuousStateDerivatives", dx, n);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 z[], size_t n)
{
    return (fmi3Status)kr16_call_indicators(instance, z, n);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 x[], size_t n)
{
    return (fmi3Status)kr16_call_get_states(instance, x, n);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 x[], size_t n)
{
    return (fmi3Status)kr16_call_nominals(instance, x, n);
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
