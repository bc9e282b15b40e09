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
#include <ctype.h>
#include <dlfcn.h>
#include <link.h>
#include <pthread.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define EXPORT __attribute__((visibility("default")))
#define TEXT 4096

/* FMI 2.0's types, as its headers have them on every 64-bit platform. */
typedef void *Component;
typedef void *State;
typedef unsigned int Reference;
typedef double Real;
typedef int Integer;
typedef int Boolean;
typedef const char *String;
typedef char Byte;
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING } Status;
typedef void (*Logger)(void *, String, Status, String, String, ...);
typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, Status);
    void *environment;
} Callbacks;

typedef struct {
    Component inner;
    Callbacks own;
    const Callbacks *host;
    char *name;
    Boolean logging;
    size_t n_categories;
    char **categories;
    Boolean said; /* the slave has told the reason of the error */
} Instance;

typedef struct {
    void *zero;
    State inner;
} Saved;

/* FMI's functions of pythonfmu's library, by name. */
#define FUNCTIONS(X)                                                                               \
    X(Instantiate) X(FreeInstance) X(SetupExperiment) X(EnterInitializationMode)                   \
    X(ExitInitializationMode) X(Terminate) X(Reset) X(GetReal) X(GetInteger) X(GetBoolean)         \
    X(GetString) X(SetReal) X(SetInteger) X(SetBoolean) X(SetString) X(GetFMUstate)                \
    X(SetFMUstate) X(FreeFMUstate) X(SerializedFMUstateSize) X(SerializeFMUstate)                  \
    X(DeSerializeFMUstate) X(DoStep) X(GetRealStatus) X(GetBooleanStatus)
#define DECLARE(name) void *name;
static struct { FUNCTIONS(DECLARE) } api;
static pthread_once_t once = PTHREAD_ONCE_INIT;
static char problem[TEXT];

/* Loading ---------------------------------------------------------------------------------- */

static int is_libpython(struct dl_phdr_info *info, size_t size, void *found) {
    (void)size;
    const char *name = info->dlpi_name ? strrchr(info->dlpi_name, '/') : NULL;
    if (!name || strncmp(name, "/libpython3.", 12) || strlen(info->dlpi_name) >= TEXT) return 0;
    strcpy(found, info->dlpi_name);
    return 1;
}

static int opened(const char *path) {
    return path[0] && dlopen(path, RTLD_NOW | RTLD_GLOBAL) && dlsym(RTLD_DEFAULT, "Py_Initialize");
}

/* The libpython of the python3 of the path; no output where it has none. */
static void ask_python(char *path) {
    path[0] = 0;
    FILE *answer = popen("python3 -c \"import os, sysconfig as s; "
                         "print(os.path.join(s.get_config_var('LIBDIR') or '', "
                         "s.get_config_var('INSTSONAME') or ''))\" 2>/dev/null", "r");
    if (!answer) return;
    if (!fgets(path, TEXT, answer)) path[0] = 0;
    pclose(answer);
    path[strcspn(path, "\n")] = 0;
}

static int find_python(void) {
    char path[TEXT] = "";
    if (dlsym(RTLD_DEFAULT, "Py_Initialize")) return 1;
    if (dl_iterate_phdr(is_libpython, path) && opened(path)) return 1;
    const char *chosen = getenv("KR16_LIBPYTHON");
    if (chosen && *chosen) {
        if (opened(chosen)) return 1;
        const char *why = dlerror();
        snprintf(problem, TEXT, "KR16_LIBPYTHON=%s cannot be loaded: %s", chosen, why ? why : "?");
        return 0;
    }
    ask_python(path);
    if (opened(path)) return 1;
    for (int minor = 20; minor >= 11; minor--) {
        snprintf(path, TEXT, "libpython3.%d.so.1.0", minor);
        if (opened(path)) return 1;
    }
    snprintf(problem, TEXT, "no libpython of Python 3.11 or later is found; install one (Debian: "
             "libpython3.11), or set KR16_LIBPYTHON to its path");
    return 0;
}

/* The folder of this library, ending in a slash. */
static int own_folder(char *folder) {
    Dl_info info;
    if (!dladdr((void *)own_folder, &info) || !realpath(info.dli_fname, folder)) return 0;
    strrchr(folder, '/')[1] = 0;
    return 1;
}

/* Python that starts in a host takes paths for ASCII where no locale is set; they are UTF-8. */
static void expect_utf8(void) {
    int (*initialized)(void) = (int (*)(void))dlsym(RTLD_DEFAULT, "Py_IsInitialized");
    int *mode = dlsym(RTLD_DEFAULT, "Py_UTF8Mode");
    if (mode && initialized && !initialized()) *mode = 1;
}

static void load(void) {
    char path[TEXT + 32];
    if (!find_python()) return;
    expect_utf8();
    if (!own_folder(path)) {
        snprintf(problem, TEXT, "the FMU's library cannot tell where it lies");
        return;
    }
    strcat(path, "libpythonfmu-export.so");
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (!library) {
        const char *why = dlerror();
        snprintf(problem, TEXT, "pythonfmu's library cannot be loaded: %s", why ? why : path);
        return;
    }
#define RESOLVE(name)                                                                              \
    if (!(api.name = dlsym(library, "fmi2" #name))) {                                              \
        snprintf(problem, TEXT, "pythonfmu's library lacks fmi2" #name);                           \
        return;                                                                                    \
    }
    FUNCTIONS(RESOLVE)
}

/* Logging ---------------------------------------------------------------------------------- */

static void tell(const Callbacks *host, String name, Status status, String category, String text) {
    char escaped[2 * TEXT], *out = escaped;
    if (!host || !host->logger) return;
    /* A message is a format: a percent sign must be doubled. */
    for (; *text && out < escaped + sizeof escaped - 3; text++) {
        *out++ = *text == '\n' ? ' ' : *text;
        if (*text == '%') *out++ = '%';
    }
    *out = 0;
    host->logger(host->environment, name, status, category, escaped);
}

static Boolean listed(const Instance *c, String category) {
    for (size_t i = 0; i < c->n_categories; i++)
        if (!strcmp(c->categories[i], category) || !strcmp(c->categories[i], "logAll")) return 1;
    return c->n_categories == 0;
}

/* What the slave and pythonfmu's library log. */
static void relay(void *environment, String name, Status status, String category, String text, ...) {
    Instance *c = environment;
    (void)name;
    if (status == FATAL) status = ERROR;
    if (!category || !*category) category = status >= ERROR ? "logStatusError" : "logAll";
    if (status >= ERROR) {
        if (c->said) return; /* the library repeats the slave's error */
        c->said = 1;
    } else if (!c->logging || !listed(c, category)) {
        return;
    }
    tell(c->host, c->name, status, category, text);
}

/* Instances --------------------------------------------------------------------------------- */

static int readable(const char *folder, const char *name) {
    char path[2 * TEXT];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return access(path, R_OK) == 0;
}

static int hex(char c) { return isdigit((unsigned char)c) ? c - '0' : (c | 32) - 'a' + 10; }

/* The folder meant by a resource location: a file URI, a path, or nothing. 0 if too long. */
static int folder_of(String location, char *folder) {
    if (!location || !*location) {
        if (!own_folder(folder) || strlen(folder) + 32 > TEXT) return 0;
        strcat(folder, "../../resources");
        return 1;
    }
    int uri = !strncmp(location, "file:", 5);
    if (uri) {
        location += 5;
        if (!strncmp(location, "//", 2)) {
            const char *path = strchr(location + 2, '/');
            location = path ? path : location + 2;
        }
    }
    char *out = folder;
    while (*location) {
        if (out >= folder + TEXT - 1) return 0;
        if (uri && *location == '%' && isxdigit((unsigned char)location[1]) &&
            isxdigit((unsigned char)location[2])) {
            *out++ = (char)(16 * hex(location[1]) + hex(location[2]));
            location += 3;
        } else {
            *out++ = *location++;
        }
    }
    while (out > folder + 1 && out[-1] == '/') out--;
    *out = 0;
    return 1;
}

/* The first line of a file of the resources; empty if there is none. */
static void first_line(const char *folder, const char *name, char *line, int size) {
    char path[2 * TEXT];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    line[0] = 0;
    FILE *file = fopen(path, "r");
    if (!file) return;
    if (!fgets(line, size, file)) line[0] = 0;
    fclose(file);
    line[strcspn(line, "\r\n")] = 0;
}

/* Why an instance cannot be made of these arguments, or NULL. */
static const char *refusal(int type, String guid, const char *folder, char *text) {
    char line[256], script[300];
    if (type != 1) return "this FMU is for co-simulation only";
    pthread_once(&once, load);
    if (*problem) return problem;
    first_line(folder, "slavemodule.txt", line, sizeof line);
    snprintf(script, sizeof script, "%s.py", line);
    if (!*line || !readable(folder, script)) {
        snprintf(text, TEXT, "%.3000s: the resources of the FMU are not there (%s); unpack it anew",
                 folder, *line ? script : "slavemodule.txt");
        return text;
    }
    first_line(folder, "guid.txt", line, sizeof line);
    if (*line && (!guid || strcmp(guid, line))) {
        snprintf(text, TEXT, "the GUID %.200s is not that of this FMU, %s", guid ? guid : "", line);
        return text;
    }
    return NULL;
}

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
