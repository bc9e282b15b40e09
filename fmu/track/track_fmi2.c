/* A source of wanted joint motions: an FMU of FMI 2.0 for co-simulation, without inputs.
 *
 * Value references: 1 to 6 q_ref, 7 to 12 qd_ref, 13 to 18 qdd_ref, then the parameters.
 */
#include "fmi2Functions.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kr16_track.h"

enum { INSTANTIATED, INITIALIZING, STEPPING, TERMINATED };
enum { OUTPUTS = 18, START = 19, RATE = 20 };

static const char *const phases[] = {"instantiated", "initializing", "stepping", "terminated"};

/* All that a saved state holds. The first eight bytes are 0, as one importer frees them. */
typedef struct {
    uint64_t zero, build;
    double time, stop, start, rate; /* stop: infinite where none was told */
    int32_t phase, unused;
} saved;

typedef struct {
    saved now;
    fmi2CallbackLogger log;
    void *environment;
    char *name;
} source;

static fmi2Status fail(source *self, const char *format, ...)
{
    char text[256];
    va_list arguments;
    if (!self->log)
        return fmi2Error;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    for (char *c = text; *c; c++)
        if (*c == '%') /* some hosts print the text as a format */
            *c = '/';
    self->log(self->environment, self->name, fmi2Error, "logStatusError", text);
    return fmi2Error;
}

static fmi2Status must_be(source *self, const char *call, int first, int last)
{
    const int phase = self->now.phase;
    if (first <= phase && phase <= last)
        return fmi2OK;
    return fail(self, "%s in the wrong order: the instance is %s, not %s", call, phases[phase],
                phases[first]);
}

/* The instance behind c in one of some phases, or return. */
#define ENTER(name, ...)                                                                           \
    source *self = c;                                                                              \
    if (!self || must_be(self, name, __VA_ARGS__) != fmi2OK)                                       \
    return fmi2Error

#define ANY INSTANTIATED, TERMINATED

#define NEED(condition, name)                                                                      \
    if (!(condition))                                                                              \
    return fail(self, "%s: an argument is missing (NULL)", name)

/* FNV-1a of the token: states of another build are refused. */
static uint64_t build(void)
{
    uint64_t h = 14695981039346656037u;
    for (size_t i = 0; i < sizeof kr16_track.token; i++)
        h = (h ^ (unsigned char)kr16_track.token[i]) * 1099511628211u;
    return h;
}

static void begin(source *self)
{
    self->now = (saved){.build = build(), .stop = HUGE_VAL, .rate = 1.0};
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
    (void)on;
    ENTER("setDebugLogging", ANY);
    NEED(!n || names, "setDebugLogging");
    return fmi2OK; /* there are errors alone to tell */
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging)
{
    (void)resources;
    (void)visible;
    (void)logging;
    const char *own = name && name[0] ? name : "trajectory";
    source *self = calloc(1, sizeof *self);
    if (!self || !(self->name = malloc(strlen(own) + 1))) {
        free(self);
        return NULL;
    }
    memcpy(self->name, own, strlen(own) + 1);
    self->log = functions ? functions->logger : NULL;
    self->environment = functions ? functions->componentEnvironment : NULL;
    begin(self);
    if (type != fmi2CoSimulation)
        fail(self, "instantiate: this FMU is for co-simulation alone");
    else if (!guid || strcmp(guid, kr16_track.token) != 0)
        fail(self, "instantiate: the GUID %.60s is not that of this build, %.60s",
             guid ? guid : "(none)", kr16_track.token);
    else
        return self;
    fmi2FreeInstance(self);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c)
{
    source *self = c;
    if (!self)
        return;
    free(self->name);
    free(self);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    (void)has_tolerance;
    (void)tolerance;
    ENTER("setupExperiment", INSTANTIATED, INSTANTIATED);
    if (!isfinite(start) || (has_stop && !(stop >= start)))
        return fail(self, "setupExperiment: start time %g, stop time %g: must be finite and rising",
                    start, stop);
    self->now.time = start;
    self->now.stop = has_stop ? stop : HUGE_VAL;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    ENTER("enterInitializationMode", INSTANTIATED, INSTANTIATED);
    self->now.phase = INITIALIZING;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    ENTER("exitInitializationMode", INITIALIZING, INITIALIZING);
    self->now.phase = STEPPING;
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    ENTER("terminate", INSTANTIATED, STEPPING);
    self->now.phase = TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    ENTER("reset", ANY);
    begin(self);
    return fmi2OK;
}

/* Values ---------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    double row[OUTPUTS];
    ENTER("getReal", ANY);
    NEED(!n || (vr && value), "getReal");
    const double rate = self->now.rate;
    kr16_play((self->now.time - self->now.start) * rate, row);
    for (size_t k = 0; k < n; k++) {
        if (vr[k] < 1 || vr[k] > RATE)
            return fail(self, "getReal: no variable has the value reference %u; they go from 1 to "
                              "%d", vr[k], RATE);
        if (vr[k] > OUTPUTS)
            value[k] = vr[k] == START ? self->now.start : rate;
        else /* faster by `rate`: speeds go with it, accelerations with its square */
            value[k] = row[vr[k] - 1] * (vr[k] <= 6 ? 1.0 : vr[k] <= 12 ? rate : rate * rate);
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                       const fmi2Real value[])
{
    ENTER("setReal", INSTANTIATED, INITIALIZING);
    NEED(!n || (vr && value), "setReal");
    for (size_t k = 0; k < n; k++) {
        if (vr[k] != START && vr[k] != RATE)
            return fail(self, "setReal: the value reference %u is that of no parameter", vr[k]);
        if (!isfinite(value[k]) || (vr[k] == RATE && !(1e-3 <= value[k] && value[k] <= 1e3)))
            return fail(self, "setReal: %s = %g: must be %s",
                        vr[k] == START ? "motion.start" : "motion.rate", value[k],
                        vr[k] == START ? "a finite number" : "0.001 to 1000");
    }
    for (size_t k = 0; k < n; k++)
        *(vr[k] == START ? &self->now.start : &self->now.rate) = value[k];
    return fmi2OK;
}

#define NONE(CALL, TYPE)                                                                           \
    fmi2Status fmi2##CALL(fmi2Component c, const fmi2ValueReference vr[], size_t n, TYPE value[])  \
    {                                                                                              \
        (void)vr;                                                                                  \
        (void)value;                                                                               \
        ENTER(#CALL, ANY);                                                                         \
        return n ? fail(self, #CALL ": there are no variables of that type") : fmi2OK;             \
    }

NONE(GetInteger, fmi2Integer)
NONE(GetBoolean, fmi2Boolean)
NONE(GetString, fmi2String)
NONE(SetInteger, const fmi2Integer)
NONE(SetBoolean, const fmi2Boolean)
NONE(SetString, const fmi2String)

/* States ---------------------------------------------------------------------------------- */

static int usable(const saved *state)
{
    return state && state->zero == 0 && state->build == build() && isfinite(state->time) &&
           isfinite(state->start) && !isnan(state->stop) && 1e-3 <= state->rate && state->rate <= 1e3 &&
           state->phase >= INSTANTIATED && state->phase <= TERMINATED;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    ENTER("getFMUstate", ANY);
    NEED(state, "getFMUstate");
    if (*state && !usable(*state))
        return fail(self, "getFMUstate: that is no state of this build of the FMU");
    if (!*state && !(*state = malloc(sizeof self->now)))
        return fail(self, "getFMUstate: out of memory");
    memcpy(*state, &self->now, sizeof self->now);
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    ENTER("setFMUstate", ANY);
    if (!usable(state))
        return fail(self, "setFMUstate: that is no state of this build of the FMU");
    memcpy(&self->now, state, sizeof self->now);
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    ENTER("freeFMUstate", ANY);
    if (state) { /* NULL is to be ignored */
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    ENTER("serializedFMUstateSize", ANY);
    NEED(state && size, "serializedFMUstateSize");
    *size = sizeof self->now;
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    ENTER("serializeFMUstate", ANY);
    NEED(state && bytes, "serializeFMUstate");
    if (size < sizeof self->now)
        return fail(self, "serializeFMUstate: %lu bytes are too few; %lu are needed",
                    (unsigned long)size, (unsigned long)sizeof self->now);
    saved copy;
    memcpy(&copy, state, sizeof copy);
    copy.stop = HUGE_VAL; /* what goes on elsewhere is another experiment */
    memcpy(bytes, &copy, sizeof copy);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state)
{
    saved found;
    ENTER("deSerializeFMUstate", ANY);
    NEED(bytes && state, "deSerializeFMUstate");
    memset(&found, 0, sizeof found);
    if (size >= sizeof found)
        memcpy(&found, bytes, sizeof found);
    if (!usable(&found))
        return fail(self, "deSerializeFMUstate: the bytes are no state of this build of the FMU");
    if (!(*state = malloc(sizeof found)))
        return fail(self, "deSerializeFMUstate: out of memory");
    memcpy(*state, &found, sizeof found);
    return fmi2OK;
}

/* What this FMU does not have --------------------------------------------------------------- */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[],
                                        size_t n, const fmi2ValueReference knowns[], size_t m,
                                        const fmi2Real seeds[], fmi2Real results[])
{
    (void)unknowns, (void)n, (void)knowns, (void)m, (void)seeds, (void)results;
    ENTER("getDirectionalDerivative", ANY);
    return fail(self, "getDirectionalDerivative: the outputs follow from time alone");
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[])
{
    (void)vr, (void)order, (void)value;
    ENTER("setRealInputDerivatives", ANY);
    return n ? fail(self, "setRealInputDerivatives: there are no inputs") : fmi2OK;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[])
{
    double row[OUTPUTS];
    ENTER("getRealOutputDerivatives", ANY);
    NEED(!n || (vr && order && value), "getRealOutputDerivatives");
    const double rate = self->now.rate;
    kr16_play((self->now.time - self->now.start) * rate, row);
    for (size_t k = 0; k < n; k++) {
        if (vr[k] < 1 || vr[k] > 12 || order[k] != 1)
            return fail(self, "getRealOutputDerivatives: order 1 of q_ref and qd_ref alone");
        value[k] = row[vr[k] + 5] * (vr[k] <= 6 ? rate : rate * rate);
    }
    return fmi2OK;
}

/* Steps ----------------------------------------------------------------------------------- */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_set_state)
{
    (void)no_set_state;
    ENTER("doStep", STEPPING, STEPPING);
    const double now = self->now.time;
    const double slack = 1e-9 * fmax(1.0, fmax(fabs(time), fabs(now)));
    if (!(isfinite(size) && size > 0.0))
        return fail(self, "communication step %g s: must be a positive number", size);
    if (!(fabs(time - now) <= fmax(slack, 1e-6 * size)))
        return fail(self, "communication point %g s: the instance stands at %g s; go on from there",
                    time, now);
    if (!(time + size <= self->now.stop + fmax(slack, 1e-6 * size)))
        return fail(self, "communication step of %g s at %g s: it goes past the stop time, %g s",
                    size, time, self->now.stop);
    self->now.time = time + size;
    return fmi2OK;
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    ENTER("cancelStep", ANY);
    return fail(self, "cancelStep: no step is under way; doStep never waits");
}

#define STATUS(KIND, TYPE)                                                                         \
    fmi2Status fmi2Get##KIND##Status(fmi2Component c, const fmi2StatusKind kind, TYPE *value)      \
    {                                                                                              \
        (void)c;                                                                                   \
        (void)kind;                                                                                \
        (void)value;                                                                               \
        return fmi2Discard; /* no step is ever pending */                                          \
    }

STATUS(, fmi2Status)
STATUS(Real, fmi2Real)
STATUS(Integer, fmi2Integer)
STATUS(Boolean, fmi2Boolean)
STATUS(String, fmi2String)
