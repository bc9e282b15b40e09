/* The library of the FMU on Linux: finds libpython, loads pythonfmu's library, forwards each call.
 *
 * pythonfmu's own library expects Python's symbols in the process, which only Python has. On the
 * way through, the shim also mends what that library cannot do:
 *   - a resource path that is empty, NULL or holds %XX, and resources that are not there;
 *   - an exception of the slave is an error of one call (fmi2Error), not the end of the process
 *     (fmi2Fatal), and is logged once, with or without debug logging;
 *   - Python stays initialized when the host unloads the FMU, so that it can be loaded again;
 *   - a freed FMU state becomes NULL, and begins with a zero word that some importers look at.
 */

#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "shim.h"

/* Instances --------------------------------------------------------------------------------- */

static void forget_categories(Instance *c) {
    for (size_t i = 0; i < c->n_categories; i++) free(c->categories[i]);
    free(c->categories);
    c->categories = NULL;
    c->n_categories = 0;
}

static void discard(Instance *c) {
    forget_categories(c);
    free(c->name);
    free(c);
}

EXPORT String fmi2GetTypesPlatform(void) { return "default"; }
EXPORT String fmi2GetVersion(void) { return "2.0"; }

EXPORT Component fmi2Instantiate(String name, int type, String guid, String location,
                                 const Callbacks *host, Boolean visible, Boolean logging) {
    char folder[TEXT], text[TEXT];
    String shown = name && *name ? name : "KR16";
    const char *why = folder_of(location, folder) ? NULL : "the resource location is too long";
    if (!why) why = refusal(type, guid, folder, text);
    Instance *c = why ? NULL : calloc(1, sizeof *c);
    if (c && !(c->name = strdup(shown))) {
        free(c);
        c = NULL;
    }
    if (!c) {
        tell(host, shown, ERROR, "logStatusError", why ? why : "no memory for an instance");
        return NULL;
    }
    c->host = host;
    c->logging = logging;
    if (host) c->own = *host;
    c->own.logger = relay;
    c->own.environment = c;
    Component (*make)(String, int, String, String, const Callbacks *, Boolean, Boolean) =
        (Component(*)(String, int, String, String, const Callbacks *, Boolean, Boolean))api.Instantiate;
    c->inner = make(shown, type, guid ? guid : "", folder, &c->own, visible, 1);
    if (!c->inner) {
        discard(c);
        return NULL;
    }
    return c;
}

EXPORT void fmi2FreeInstance(Component component) {
    Instance *c = component;
    if (!c) return;
    ((void (*)(Component))api.FreeInstance)(c->inner);
    discard(c);
}

EXPORT Status fmi2SetDebugLogging(Component component, Boolean on, size_t n, const String names[]) {
    Instance *c = component;
    if (!c) return ERROR;
    forget_categories(c);
    c->logging = on;
    if (n && !(c->categories = calloc(n, sizeof *c->categories))) return ERROR;
    for (; c->n_categories < n; c->n_categories++)
        if (!(c->categories[c->n_categories] = strdup(names[c->n_categories]))) return ERROR;
    return OK;
}

/* Calls ------------------------------------------------------------------------------------- */

static Status settled(Status status) { return status == FATAL ? ERROR : status; }

/* The call of pythonfmu's function; its fatal errors are errors of this call. */
#define FORWARD(name, types, arguments)                                                            \
    Instance *c = component;                                                                       \
    if (!c) return ERROR;                                                                          \
    c->said = 0;                                                                                   \
    return settled(((Status(*) types)api.name)arguments)

EXPORT Status fmi2SetupExperiment(Component component, Boolean tolerance_defined, Real tolerance,
                                  Real start, Boolean stop_defined, Real stop) {
    FORWARD(SetupExperiment, (Component, Boolean, Real, Real, Boolean, Real),
            (c->inner, tolerance_defined, tolerance, start, stop_defined, stop));
}

EXPORT Status fmi2DoStep(Component component, Real time, Real size, Boolean no_set_state) {
    FORWARD(DoStep, (Component, Real, Real, Boolean), (c->inner, time, size, no_set_state));
}

#define SIMPLE(name)                                                                               \
    EXPORT Status fmi2##name(Component component) {                                                \
        FORWARD(name, (Component), (c->inner));                                                    \
    }
SIMPLE(EnterInitializationMode)
SIMPLE(ExitInitializationMode)
SIMPLE(Terminate)
SIMPLE(Reset)

#define VALUES(name, type)                                                                         \
    EXPORT Status fmi2##name(Component component, const Reference r[], size_t n, type v[]) {       \
        if (n == 0) return component ? OK : ERROR;                                                 \
        FORWARD(name, (Component, const Reference *, size_t, type *), (c->inner, r, n, v));        \
    }
VALUES(GetReal, Real)
VALUES(GetInteger, Integer)
VALUES(GetBoolean, Boolean)
VALUES(GetString, String)
VALUES(SetReal, const Real)
VALUES(SetInteger, const Integer)
VALUES(SetBoolean, const Boolean)
VALUES(SetString, const String)

/* States ------------------------------------------------------------------------------------ */

EXPORT Status fmi2FreeFMUstate(Component component, State *state) {
    Instance *c = component;
    if (!c) return ERROR;
    if (!state || !*state) return OK;
    Saved *saved = *state;
    ((Status(*)(Component, State *))api.FreeFMUstate)(c->inner, &saved->inner);
    free(saved);
    *state = NULL;
    return OK;
}

/* Takes a state that pythonfmu made, in place of what *state held. */
static Status keep(Instance *c, State *state, Status status, State inner) {
    if (status != OK) return settled(status);
    fmi2FreeFMUstate(c, state);
    Saved *saved = calloc(1, sizeof *saved);
    if (!saved) return ERROR;
    saved->inner = inner;
    *state = saved;
    return OK;
}

EXPORT Status fmi2GetFMUstate(Component component, State *state) {
    Instance *c = component;
    State inner = NULL;
    if (!c || !state) return ERROR;
    c->said = 0;
    Status status = ((Status(*)(Component, State *))api.GetFMUstate)(c->inner, &inner);
    return keep(c, state, status, inner);
}

static Boolean no_state(Instance *c, State state) {
    if (state) return 0;
    tell(c->host, c->name, ERROR, "logStatusError", "the FMU state is NULL; get one first");
    return 1;
}

EXPORT Status fmi2SetFMUstate(Component component, State state) {
    if (component && no_state(component, state)) return ERROR;
    FORWARD(SetFMUstate, (Component, State), (c->inner, ((Saved *)state)->inner));
}

EXPORT Status fmi2SerializedFMUstateSize(Component component, State state, size_t *size) {
    if (component && no_state(component, state)) return ERROR;
    FORWARD(SerializedFMUstateSize, (Component, State, size_t *),
            (c->inner, ((Saved *)state)->inner, size));
}

EXPORT Status fmi2SerializeFMUstate(Component component, State state, Byte bytes[], size_t size) {
    size_t needed = 0;
    if (component && no_state(component, state)) return ERROR;
    Status known = fmi2SerializedFMUstateSize(component, state, &needed);
    if (known != OK) return known;
    if (size < needed) {
        Instance *c = component;
        tell(c->host, c->name, ERROR, "logStatusError", "the buffer is too small for the FMU state");
        return ERROR;
    }
    FORWARD(SerializeFMUstate, (Component, State, Byte *, size_t),
            (c->inner, ((Saved *)state)->inner, bytes, needed));
}

EXPORT Status fmi2DeSerializeFMUstate(Component component, const Byte bytes[], size_t size,
                                      State *state) {
    Instance *c = component;
    State inner = NULL;
    if (!c || !state || !bytes) return ERROR;
    c->said = 0;
    Status status = ((Status(*)(Component, const Byte *, size_t, State *))api.DeSerializeFMUstate)(
        c->inner, bytes, size, &inner);
    return keep(c, state, status, inner);
}

/* What the FMU does not offer ---------------------------------------------------------------- */

static Status refuse(Component component, String what) {
    Instance *c = component;
    char text[256];
    if (!c) return ERROR;
    snprintf(text, sizeof text, "%s is not offered, as the model description says", what);
    tell(c->host, c->name, ERROR, "logStatusError", text);
    return ERROR;
}

EXPORT Status fmi2GetDirectionalDerivative(Component c, const Reference u[], size_t nu,
                                           const Reference k[], size_t nk, const Real dk[],
                                           Real du[]) {
    (void)u, (void)nu, (void)k, (void)nk, (void)dk, (void)du;
    return refuse(c, "fmi2GetDirectionalDerivative");
}

EXPORT Status fmi2SetRealInputDerivatives(Component c, const Reference r[], size_t n,
                                          const Integer order[], const Real v[]) {
    (void)r, (void)n, (void)order, (void)v;
    return refuse(c, "fmi2SetRealInputDerivatives");
}

EXPORT Status fmi2GetRealOutputDerivatives(Component c, const Reference r[], size_t n,
                                           const Integer order[], Real v[]) {
    (void)r, (void)n, (void)order, (void)v;
    return refuse(c, "fmi2GetRealOutputDerivatives");
}

EXPORT Status fmi2CancelStep(Component c) { return refuse(c, "fmi2CancelStep"); }

EXPORT Status fmi2GetRealStatus(Component component, int kind, Real *value) {
    FORWARD(GetRealStatus, (Component, int, Real *), (c->inner, kind, value));
}

EXPORT Status fmi2GetBooleanStatus(Component component, int kind, Boolean *value) {
    FORWARD(GetBooleanStatus, (Component, int, Boolean *), (c->inner, kind, value));
}

EXPORT Status fmi2GetStatus(Component c, int kind, Status *value) {
    (void)kind, (void)value;
    return refuse(c, "fmi2GetStatus");
}

EXPORT Status fmi2GetIntegerStatus(Component c, int kind, Integer *value) {
    (void)kind, (void)value;
    return refuse(c, "fmi2GetIntegerStatus");
}

EXPORT Status fmi2GetStringStatus(Component c, int kind, String *value) {
    (void)kind, (void)value;
    return refuse(c, "fmi2GetStringStatus");
}
