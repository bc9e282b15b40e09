/* FMI 2.0 over the machine: co-simulation and model exchange. */
#include "fmi2Functions.h"

#include <string.h>

#include "kr16_fmu.h"

#define AT(phase) (1u << (phase))
#define ANY (AT(FAILED + 1) - 1u)


/* The instance behind c, or return. */
#define ENTER(name, allowed)                                                                       \
    kr16_instance *self = c;                                                                       \
    if (!self)                                                                                     \
        return fmi2Error;                                                                          \
    if (kr16_must_be(self, name, allowed) != OK)                                                   \
    return fmi2Error

#define NEED(condition, name)                                                                      \
    if (!(condition))                                                                              \
    return (fmi2Status)kr16_fail(self, "%s: an argument is missing (NULL)", name)

static void tell(kr16_instance *self, int status, const char *category, const char *text)
{
    fmi2CallbackLogger log = (fmi2CallbackLogger)self->callback;
    if (log)
        log(self->environment, self->name, (fmi2Status)status, category, text);
}

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[])
{
    ENTER("setDebugLogging", ANY);
    return (fmi2Status)kr16_log_categories(self, on, n, names);
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging)
{
    (void)resources;
    (void)visible;
    kr16_instance *self = kr16_new(name, 2, type == fmi2ModelExchange);
    if (!self)
        return NULL;
    if (functions) {
        self->tell = tell;
        self->environment = functions->componentEnvironment;
        self->callback = (void (*)(void))functions->logger;
    }
    kr16_log_categories(self, logging, 0, NULL);
    if (!guid || strcmp(guid, kr16_robot.token) != 0) {
        kr16_fail(self, "instantiate: the GUID %.60s is not that of this build, %.60s",
                  guid ? guid : "(none)", kr16_robot.token);
        kr16_free(self);
        return NULL;
    }
    return self;
}

void fmi2FreeInstance(fmi2Component c)
{
    kr16_free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    ENTER("setupExperiment", AT(INSTANTIATED));
    return (fmi2Status)kr16_setup(self, has_tolerance, tolerance, start, has_stop, stop);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    ENTER("enterInitializationMode", AT(INSTANTIATED));
    self->core.phase = INITIALIZING;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    ENTER("exitInitializationMode", AT(INITIALIZING));
    return (fmi2Status)kr16_leave_initialization(self);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    ENTER("terminate", ANY & ~AT(TERMINATED));
    self->core.phase = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    ENTER("reset", ANY);
    return (fmi2Status)kr16_reset(self);
}

/* Values ---------------------------------------------------------------------------------- */

#define GETTER(NAME, TYPE, WANT, CONVERTED)                                                        \
    fmi2Status fmi2Get##NAME(fmi2Component c, const fmi2ValueReference vr[], size_t n,             \
                             TYPE value[])                                                         \
    {                                                                                              \
        ENTER("get" #NAME, ANY);                                                                   \
        NEED(!n || (vr && value), "get" #NAME);                                                    \
        for (size_t k = 0; k < n; k++) {                                                           \
            const double *found;                                                                   \
            size_t count;                                                                          \
            if (kr16_look(self, "get" #NAME, vr[k], WANT, &found, &count) != OK)                   \
                return fmi2Error;                                                                  \
            value[k] = CONVERTED;                                                                  \
        }                                                                                          \
        return fmi2OK;                                                                             \
    }

#define SETTER(NAME, TYPE, WANT, FROM)                                                             \
    fmi2Status fmi2Set##NAME(fmi2Component c, const fmi2ValueReference vr[], size_t n,             \
                             const TYPE value[])                                                   \
    {                                                                                              \
        ENTER("set" #NAME, ANY);                                                                   \
        return (fmi2Status)kr16_put(self, "set" #NAME, vr, n, WANT, FROM, value, n);               \
    }

/* Some hosts read Booleans as numbers. */
GETTER(Real, fmi2Real, WANT_REAL | WANT_INTEGER | WANT_BOOLEAN, *found)
GETTER(Integer, fmi2Integer, WANT_INTEGER | WANT_BOOLEAN, (fmi2Integer)*found)
GETTER(Boolean, fmi2Boolean, WANT_BOOLEAN, *found != 0.0)
SETTER(Real, fmi2Real, WANT_REAL, FROM_DOUBLE)
SETTER(Integer, fmi2Integer, WANT_INTEGER, FROM_INT)
SETTER(Boolean, fmi2Boolean, WANT_BOOLEAN, FROM_INT)

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                         fmi2String value[])
{
    (void)vr;
    (void)value;
    ENTER("getString", ANY);
    return n ? (fmi2Status)kr16_fail(self, "getString: there are no variables of type String")
             : fmi2OK;
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                         const fmi2String value[])
{
    (void)vr;
    (void)value;
    ENTER("setString", ANY);
    return n ? (fmi2Status)kr16_fail(self, "setString: there are no variables of type String")
             : fmi2OK;
}

/* States ---------------------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    ENTER("getFMUstate", ANY);
    NEED(state, "getFMUstate");
    return (fmi2Status)kr16_save(self, state);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    ENTER("setFMUstate", ANY);
    return (fmi2Status)kr16_restore(self, state);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    ENTER("freeFMUstate", ANY);
    return (fmi2Status)kr16_forget(self, state);
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    ENTER("serializedFMUstateSize", ANY);
    NEED(state && size, "serializedFMUstateSize");
    *size = kr16_state_size();
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    ENTER("serializeFMUstate", ANY);
    return (fmi2Status)kr16_write_state(self, state, bytes, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state)
{
    ENTER("deSerializeFMUstate", ANY);
    return (fmi2Status)kr16_read_state(self, bytes, size, state);
}

/* Derivatives ----------------------------------------------------------------------------- */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[],
                                        size_t n, const fmi2ValueReference knowns[], size_t m,
                                        const fmi2Real seeds[], fmi2Real results[])
{
    ENTER("getDirectionalDerivative", ANY & ~AT(INSTANTIATED));
    const kr16_request request = {
        "getDirectionalDerivative", unknowns, n, knowns, m, seeds, m, results, n};
    return (fmi2Status)kr16_directional(self, &request);
}

/* Model exchange -------------------------------------------------------------------------- */

#define EXCHANGE(name)                                                                             \
    if (!self->model_exchange)                                                                     \
    return (fmi2Status)kr16_fail(self, "%s: the instance is one of co-simulation", name)

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    ENTER("enterEventMode", AT(CONTINUOUS_TIME));
    self->core.phase = EVENT;
    kr16_stale(self);
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    ENTER("newDiscreteStates", AT(EVENT));
    NEED(info, "newDiscreteStates");
    memset(info, 0, sizeof *info);
    kr16_hold_flags(self);
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    ENTER("enterContinuousTimeMode", AT(EVENT));
    kr16_hold_flags(self);
    self->core.phase = CONTINUOUS_TIME;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean final, fmi2Boolean *event,
                                       fmi2Boolean *terminate)
{
    (void)final;
    ENTER("completedIntegratorStep", AT(CONTINUOUS_TIME));
    NEED(event && terminate, "completedIntegratorStep");
    kr16_watch(self);
    *event = *terminate = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    ENTER("setTime", AT(EVENT) | AT(CONTINUOUS_TIME));
    EXCHANGE("setTime");
    if (!(time - time == 0.0))
        return (fmi2Status)kr16_fail(self, "setTime: %g; it must be a finite number", time);
    self->core.value[SLOT_TIME] = time;
    return fmi2OK;
}

static fmi2Status sized(kr16_instance *self, const char *call, const void *values, size_t n,
                        int right)
{
    if (!self->model_exchange)
        return (fmi2Status)kr16_fail(self, "%s: the instance is one of co-simulation", call);
    if (n != (size_t)right)
        return (fmi2Status)kr16_fail(self, "%s: %lu numbers; there are %d", call, (unsigned long)n,
                                     right);
    if (n && !values)
        return (fmi2Status)kr16_fail(self, "%s: an argument is missing (NULL)", call);
    return fmi2OK;
}

#define SIZED(name, values, n, right)                                                              \
    if (sized(self, name, values, n, right) != fmi2OK)                                             \
    return fmi2Error

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n)
{
    ENTER("setContinuousStates", AT(EVENT) | AT(CONTINUOUS_TIME));
    SIZED("setContinuousStates", x, n, kr16_states());
    return (fmi2Status)kr16_set_states(self, x, n);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n)
{
    ENTER("getDerivatives", ANY & ~AT(INSTANTIATED));
    SIZED("getDerivatives", dx, n, kr16_states());
    return (fmi2Status)kr16_derivatives(self, dx, n);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n)
{
    ENTER("getEventIndicators", ANY & ~AT(INSTANTIATED));
    SIZED("getEventIndicators", z, n, kr16_indicators());
    if (n && kr16_compute(self, GROUP_MARGIN) != OK)
        return fmi2Error;
    if (n)
        memcpy(z, self->core.value + SLOT_MARGIN_LOWER, n * sizeof *z);
    return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n)
{
    ENTER("getContinuousStates", ANY);
    SIZED("getContinuousStates", x, n, kr16_states());
    if (n)
        memcpy(x, self->core.value + SLOT_Q, n * sizeof *x);
    return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n)
{
    ENTER("getNominalsOfContinuousStates", ANY);
    SIZED("getNominalsOfContinuousStates", x, n, kr16_states());
    for (size_t i = 0; i < n; i++)
        x[i] = 1.0;
    return fmi2OK;
}

/* Co-simulation --------------------------------------------------------------------------- */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    ENTER("setRealInputDerivatives", AT(INITIALIZING) | AT(STEPPING));
    return (fmi2Status)kr16_input_rises(self, vr, n, order, value);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[])
{
    ENTER("getRealOutputDerivatives", AT(STEPPING) | AT(TERMINATED));
    return (fmi2Status)kr16_output_rises(self, vr, n, order, value, n);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_set_state)
{
    kr16_step_result result;
    (void)no_set_state;
    ENTER("doStep", ANY);
    return (fmi2Status)kr16_do_step(self, time, size, &result);
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    ENTER("cancelStep", ANY);
    return (fmi2Status)kr16_fail(self, "cancelStep: no step is under way; doStep never waits");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    ENTER("getStatus", ANY);
    NEED(value, "getStatus");
    (void)kind; /* only DoStepStatus is a status, and no step is ever pending */
    *value = self->core.phase == FAILED ? fmi2Error : fmi2OK;
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    ENTER("getRealStatus", ANY);
    NEED(value, "getRealStatus");
    if (kind != fmi2LastSuccessfulTime)
        return fmi2Discard;
    *value = self->core.value[SLOT_TIME];
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    (void)c;
    (void)kind;
    (void)value;
    return fmi2Discard; /* no status is an Integer */
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    ENTER("getBooleanStatus", ANY);
    NEED(value, "getBooleanStatus");
    if (kind != fmi2Terminated)
        return fmi2Discard;
    *value = self->core.phase == TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)c;
    (void)kind;
    (void)value;
    return fmi2Discard; /* no step is ever pending */
}
