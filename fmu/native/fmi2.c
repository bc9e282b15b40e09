/* FMI 2.0 over the machine: co-simulation and model exchange. */
#include "fmi2Functions.h"

#include <string.h>

#include "calls.h"

#define ENTER(name, allowed)                                                                       \
    kr16_instance *self = c;                                                                       \
    if (kr16_enter(self, name, allowed) != OK)                                                     \
    return fmi2Error

static void tell2(kr16_instance *self, int status, const char *category, const char *text)
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
    return (fmi2Status)kr16_call_log(c, on, n, names);
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
        self->tell = tell2;
        self->environment = functions->componentEnvironment;
        self->callback = (void (*)(void))functions->logger;
    }
    kr16_log_categories(self, logging, 0, NULL);
    if (kr16_known(self, guid))
        return self;
    kr16_free(self);
    return NULL;
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
    return (fmi2Status)kr16_call_leave_initialization(c);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    return (fmi2Status)kr16_call_terminate(c);
}

fmi2Status fmi2Reset(fmi2Component c)
{
    return (fmi2Status)kr16_call_reset(c);
}

/* Values. Some hosts read Booleans as numbers. ---------------------------------------------- */

#define VALUES(NAME, TYPE, CODE, READ, WRITTEN)                                                    \
    fmi2Status fmi2Get##NAME(fmi2Component c, const fmi2ValueReference vr[], size_t n,             \
                             TYPE value[])                                                         \
    {                                                                                              \
        return (fmi2Status)kr16_call_get(c, "get" #NAME, vr, n, READ, CODE, value, n);             \
    }                                                                                              \
    fmi2Status fmi2Set##NAME(fmi2Component c, const fmi2ValueReference vr[], size_t n,             \
                             const TYPE value[])                                                   \
    {                                                                                              \
        return (fmi2Status)kr16_call_set(c, "set" #NAME, vr, n, WRITTEN, CODE, value, n);          \
    }

VALUES(Real, fmi2Real, AS_DOUBLE, WANT_REAL | WANT_INTEGER | WANT_BOOLEAN, WANT_REAL)
VALUES(Integer, fmi2Integer, AS_INT, WANT_INTEGER | WANT_BOOLEAN, WANT_INTEGER)
VALUES(Boolean, fmi2Boolean, AS_INT, WANT_BOOLEAN, WANT_BOOLEAN)

/* No variable is of type String: of no type is wanted. */
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                         fmi2String value[])
{
    return (fmi2Status)kr16_call_get(c, "getString", vr, n, 0, AS_DOUBLE, value, n);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                         const fmi2String value[])
{
    return (fmi2Status)kr16_call_set(c, "setString", vr, n, 0, AS_DOUBLE, value, n);
}

/* States ---------------------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return (fmi2Status)kr16_call_save(c, state);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    return (fmi2Status)kr16_call_restore(c, state);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return (fmi2Status)kr16_call_forget(c, state);
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    return (fmi2Status)kr16_call_state_size(c, state, size);
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    return (fmi2Status)kr16_call_write_state(c, state, bytes, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state)
{
    return (fmi2Status)kr16_call_read_state(c, bytes, size, state);
}

/* Derivatives ----------------------------------------------------------------------------- */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[],
                                        size_t n, const fmi2ValueReference knowns[], size_t m,
                                        const fmi2Real seeds[], fmi2Real results[])
{
    const kr16_request request = {
        "getDirectionalDerivative", unknowns, n, knowns, m, seeds, m, results, n};
    return (fmi2Status)kr16_call_derivatives(c, &request, 0);
}

/* Model exchange -------------------------------------------------------------------------- */

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    return (fmi2Status)kr16_call_event_mode(c);
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    ENTER("newDiscreteStates", AT(EVENT));
    if (!info)
        return (fmi2Status)kr16_missing(self, "newDiscreteStates");
    memset(info, 0, sizeof *info);
    kr16_hold_flags(self);
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    return (fmi2Status)kr16_call_after_event(c, "enterContinuousTimeMode", CONTINUOUS_TIME);
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean final, fmi2Boolean *event,
                                       fmi2Boolean *terminate)
{
    const fmi2Status status = (fmi2Status)kr16_call_completed_step(c, event && terminate);
    (void)final;
    if (status == fmi2OK)
        *event = *terminate = fmi2False;
    return status;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    return (fmi2Status)kr16_call_set_time(c, time);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n)
{
    return (fmi2Status)kr16_call_set_states(c, x, n);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n)
{
    return (fmi2Status)kr16_call_rates(c, "getDerivatives", dx, n);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n)
{
    return (fmi2Status)kr16_call_indicators(c, z, n);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n)
{
    return (fmi2Status)kr16_call_get_states(c, x, n);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n)
{
    return (fmi2Status)kr16_call_nominals(c, x, n);
}

/* Co-simulation --------------------------------------------------------------------------- */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    ENTER("setRealInputDerivatives", AT(INSTANTIATED) | AT(INITIALIZING) | AT(STEPPING));
    return (fmi2Status)kr16_input_rises(self, vr, n, order, value);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[])
{
    return (fmi2Status)kr16_call_output_rises(c, vr, n, order, value, n);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_set_state)
{
    kr16_step_result result;
    (void)no_set_state;
    return c ? (fmi2Status)kr16_do_step(c, time, size, &result) : fmi2Error;
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    ENTER("cancelStep", ANY);
    return (fmi2Status)kr16_fail(self, "cancelStep: no step is under way; doStep never waits");
}

/* A status that there is, of an instance and with a place for it; else why not. */
static fmi2Status status_of(kr16_instance *self, const char *call, const void *value, int there)
{
    if (!self)
        return fmi2Error;
    if (!value)
        return (fmi2Status)kr16_missing(self, call);
    return there ? fmi2OK : fmi2Discard;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    const fmi2Status found = status_of(c, "getStatus", value, 1);
    (void)kind; /* only DoStepStatus is a status, and no step is ever pending */
    if (found == fmi2OK)
        *value = ((kr16_instance *)c)->core.phase == FAILED ? fmi2Error : fmi2OK;
    return found;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    const fmi2Status found = status_of(c, "getRealStatus", value, kind == fmi2LastSuccessfulTime);
    if (found == fmi2OK)
        *value = ((kr16_instance *)c)->core.value[SLOT_TIME];
    return found;
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
    const fmi2Status found = status_of(c, "getBooleanStatus", value, kind == fmi2Terminated);
    if (found == fmi2OK)
        *value = ((kr16_instance *)c)->core.phase == TERMINATED;
    return found;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    (void)c;
    (void)kind;
    (void)value;
    return fmi2Discard; /* no step is ever pending */
}
