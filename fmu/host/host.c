/* A program that is not Python and runs an FMU's library, on any platform.
 *
 * Usage: host JOB ANSWER. JOB holds words: library, token, version of FMI (2, 3), whether by model
 * exchange (0, 1), size of a communication step, integrator steps in each (model exchange, Runge
 * and Kutta's), the first and the last row, the row at which to save the state, the file of the
 * state to begin with, and of the one to save (- for none); the number of inputs and their value
 * references, the same of outputs; then for each row but the last the values of the inputs.
 * ANSWER gets the outputs of each row, before its inputs act. Numbers are written as their 64
 * bits in hexadecimal, so that none is rounded.
 */
#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

enum { STATES = 12, MARGINS = 24 };

static void *library, *instance;
static int version, exchange;

static void stop(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
    exit(1);
}

static void *symbol(const char *name)
{
    void *found;
#ifdef _WIN32
    FARPROC function = GetProcAddress((HMODULE)library, name);
    memcpy(&found, &function, sizeof found);
#else
    found = dlsym(library, name);
#endif
    if (!found)
        stop("the library has no %s", name);
    return found;
}

static void load(const char *name)
{
#ifdef _WIN32
    library = (void *)LoadLibraryA(name);
    if (!library)
        stop("%s is not loaded: error %lu", name, (unsigned long)GetLastError());
#else
    library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
    if (!library)
        stop("%s is not loaded: %s", name, dlerror());
#endif
}

#define FMI2(name) ((fmi2##name##TYPE *)symbol("fmi2" #name))
#define FMI3(name) ((fmi3##name##TYPE *)symbol("fmi3" #name))
#define MUST(call)                                                                                 \
    do {                                                                                           \
        const int status_ = (int)(call);                                                           \
        if (status_ > 1)                                                                           \
            stop("status %d of %s", status_, #call);                                               \
    } while (0)

static void tell2(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status,
                 fmi2String category, fmi2String text, ...)
{
    (void)e;
    fprintf(stderr, "%s, status %d, %s: %s\n", name, (int)status, category, text);
}

static void tell3(fmi3InstanceEnvironment e, fmi3Status status, fmi3String category, fmi3String text)
{
    (void)e;
    fprintf(stderr, "status %d, %s: %s\n", (int)status, category, text);
}

/* Reading the job ------------------------------------------------------------------------- */

static FILE *job;

typedef struct {
    char text[256];
} name;

static name word(void)
{
    name found;
    if (fscanf(job, "%255s", found.text) != 1)
        stop("the job ends too early");
    return found;
}

static long whole(void)
{
    return strtol(word().text, NULL, 10);
}

static double number(void)
{
    const uint64_t bits = strtoull(word().text, NULL, 16);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

typedef struct {
    size_t count;
    unsigned reference[256];
    double value[256];
} group;

static group references(void)
{
    group found = {0};
    found.count = (size_t)whole();
    if (found.count > 256)
        stop("%lu variables are too many", (unsigned long)found.count);
    for (size_t i = 0; i < found.count; i++)
        found.reference[i] = (unsigned)strtoul(word().text, NULL, 10);
    return found;
}

/* What differs between the versions of FMI ------------------------------------------------ */

static void instantiate(const char *token)
{
    static const fmi2CallbackFunctions functions = {tell2, calloc, free, NULL, NULL};
    if (version == 2)
        instance = FMI2(Instantiate)("robot", exchange ? fmi2ModelExchange : fmi2CoSimulation,
                                     token, NULL, &functions, fmi2False, fmi2True);
    else if (exchange)
        instance = FMI3(InstantiateModelExchange)("robot", token, NULL, fmi3False, fmi3True, NULL,
                                                  tell3);
    else
        instance = FMI3(InstantiateCoSimulation)("robot", token, NULL, fmi3False, fmi3True,
                                                 fmi3False, fmi3False, NULL, 0, NULL, tell3, NULL);
    if (!instance)
        stop("no instance is made");
}

/* Through the events of the moment into continuous time. */
static void settle(void)
{
    if (version == 2) {
        fmi2EventInfo info = {.newDiscreteStatesNeeded = fmi2True};
        while (info.newDiscreteStatesNeeded)
            MUST(FMI2(NewDiscreteStates)(instance, &info));
        MUST(FMI2(EnterContinuousTimeMode)(instance));
        return;
    }
    fmi3Boolean again = fmi3True, end, nominals, values, timed;
    fmi3Float64 next;
    while (again)
        MUST(FMI3(UpdateDiscreteStates)(instance, &again, &end, &nominals, &values, &timed, &next));
    MUST(FMI3(EnterContinuousTimeMode)(instance));
}

static void initialize(double start)
{
    if (version == 2) {
        MUST(FMI2(SetupExperiment)(instance, fmi2False, 0.0, start, fmi2False, 0.0));
        MUST(FMI2(EnterInitializationMode)(instance));
        MUST(FMI2(ExitInitializationMode)(instance));
    } else {
        MUST(FMI3(EnterInitializationMode)(instance, fmi3False, 0.0, start, fmi3False, 0.0));
        MUST(FMI3(ExitInitializationMode)(instance));
    }
    if (exchange)
        settle();
}

static void set(const group *g)
{
    if (version == 2)
        MUST(FMI2(SetReal)(instance, g->reference, g->count, g->value));
    else
        MUST(FMI3(SetFloat64)(instance, g->reference, g->count, g->value, g->count));
}

static void get(group *g)
{
    if (version == 2)
        MUST(FMI2(GetReal)(instance, g->reference, g->count, g->value));
    else
        MUST(FMI3(GetFloat64)(instance, g->reference, g->count, g->value, g->count));
}

static void move_to(double time, const double *x)
{
    if (version == 2) {
        MUST(FMI2(SetTime)(instance, time));
        MUST(FMI2(SetContinuousStates)(instance, x, STATES));
    } else {
        MUST(FMI3(SetTime)(instance, time));
        MUST(FMI3(SetContinuousStates)(instance, x, STATES));
    }
}

static void states(double *x)
{
    if (version == 2)
        MUST(FMI2(GetContinuousStates)(instance, x, STATES));
    else
        MUST(FMI3(GetContinuousStates)(instance, x, STATES));
}

static void slopes(double *dx)
{
    if (version == 2)
        MUST(FMI2(GetDerivatives)(instance, dx, STATES));
    else
        MUST(FMI3(GetContinuousStateDerivatives)(instance, dx, STATES));
}

/* Tells of the end of an integrator step; whether the instance asks for an event. */
static int completed(void)
{
    if (version == 2) {
        fmi2Boolean event, end;
        MUST(FMI2(CompletedIntegratorStep)(instance, fmi2True, &event, &end));
        return event;
    }
    fmi3Boolean event, end;
    MUST(FMI3(CompletedIntegratorStep)(instance, fmi3True, &event, &end));
    return event;
}

static void indicators(double *margin)
{
    if (version == 2)
        MUST(FMI2(GetEventIndicators)(instance, margin, MARGINS));
    else
        MUST(FMI3(GetEventIndicators)(instance, margin, MARGINS));
}

static void enter_event(void)
{
    if (version == 2)
        MUST(FMI2(EnterEventMode)(instance));
    else
        MUST(FMI3(EnterEventMode)(instance));
}

/* Steps ----------------------------------------------------------------------------------- */

static void runge_kutta(double t, double h)
{
    static const double node[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    double x[STATES], at[STATES], dx[STATES], sum[STATES] = {0.0};
    states(x);
    memcpy(at, x, sizeof at);
    for (int stage = 0; stage < 4; stage++) {
        for (int i = 0; stage && i < STATES; i++)
            at[i] = x[i] + node[stage] * h * dx[i];
        move_to(t + node[stage] * h, at);
        slopes(dx);
        for (int i = 0; i < STATES; i++)
            sum[i] += weight[stage] * dx[i];
    }
    for (int i = 0; i < STATES; i++)
        x[i] += h / 6.0 * sum[i];
    move_to(t + h, x);
}

static void step(double t, double size, long parts)
{
    if (!exchange && version == 2) {
        MUST(FMI2(DoStep)(instance, t, size, fmi2False));
    } else if (!exchange) {
        fmi3Boolean event, end, early;
        fmi3Float64 reached;
        MUST(FMI3(DoStep)(instance, t, size, fmi3False, &event, &end, &early, &reached));
        if (event || end || early || reached != t + size)
            stop("the step from %.17g by %.17g ended at %.17g", t, size, reached);
    }
    for (long k = 0; exchange && k < parts; k++) {
        double before[MARGINS], after[MARGINS];
        indicators(before);
        runge_kutta(t + size * (double)k / (double)parts, size / (double)parts);
        int event = completed();
        indicators(after);
        for (int i = 0; i < MARGINS; i++)
            event |= (before[i] < 0.0) != (after[i] < 0.0);
        if (event) {
            enter_event();
            settle();
        }
    }
}

/* States ---------------------------------------------------------------------------------- */

static void save(const char *name)
{
    void *state = NULL;
    size_t size;
    unsigned char *bytes;
    FILE *file = fopen(name, "wb");
    if (version == 2) {
        MUST(FMI2(GetFMUstate)(instance, &state));
        MUST(FMI2(SerializedFMUstateSize)(instance, state, &size));
    } else {
        MUST(FMI3(GetFMUState)(instance, &state));
        MUST(FMI3(SerializedFMUStateSize)(instance, state, &size));
    }
    if (!(bytes = malloc(size)) || !file)
        stop("%s cannot be written", name);
    if (version == 2) {
        MUST(FMI2(SerializeFMUstate)(instance, state, (fmi2Byte *)bytes, size));
        MUST(FMI2(FreeFMUstate)(instance, &state));
    } else {
        MUST(FMI3(SerializeFMUState)(instance, state, bytes, size));
        MUST(FMI3(FreeFMUState)(instance, &state));
    }
    if (fwrite(bytes, 1, size, file) != size || fclose(file))
        stop("%s cannot be written", name);
    free(bytes);
}

static void resume(const char *name)
{
    static unsigned char bytes[1 << 20];
    void *state = NULL;
    FILE *file = fopen(name, "rb");
    if (!file)
        stop("%s cannot be read", name);
    const size_t size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    if (version == 2) {
        MUST(FMI2(DeSerializeFMUstate)(instance, (fmi2Byte *)bytes, size, &state));
        MUST(FMI2(SetFMUstate)(instance, state));
        MUST(FMI2(FreeFMUstate)(instance, &state));
    } else {
        MUST(FMI3(DeserializeFMUState)(instance, bytes, size, &state));
        MUST(FMI3(SetFMUState)(instance, state));
        MUST(FMI3(FreeFMUState)(instance, &state));
    }
}

static void print(FILE *answer, const group *g)
{
    for (size_t i = 0; i < g->count; i++) {
        uint64_t bits;
        memcpy(&bits, &g->value[i], sizeof bits);
        fprintf(answer, "%016" PRIx64 " ", bits);
    }
    fputc('\n', answer);
}

int main(int count, char **words)
{
    FILE *answer = count == 3 ? fopen(words[2], "w") : NULL;
    job = count == 3 ? fopen(words[1], "r") : NULL;
    if (!job || !answer)
        stop("usage: host JOB ANSWER");
    load(word().text);
    const name token = word();
    version = (int)whole();
    exchange = (int)whole();
    instantiate(token.text);
    const double size = number();
    const long parts = whole(), first = whole(), last = whole(), saved = whole();
    const name from = word(), to = word();
    group inputs = references(), outputs = references();
    initialize(0.0);
    if (strcmp(from.text, "-") != 0)
        resume(from.text);
    for (long k = first; k <= last; k++) {
        if (k == saved)
            save(to.text);
        get(&outputs);
        print(answer, &outputs);
        if (k == last)
            break;
        for (size_t i = 0; i < inputs.count; i++)
            inputs.value[i] = number();
        set(&inputs);
        step((double)k * size, size, parts);
    }
    if (version == 2) {
        MUST(FMI2(Terminate)(instance));
        FMI2(FreeInstance)(instance);
    } else {
        MUST(FMI3(Terminate)(instance));
        FMI3(FreeInstance)(instance);
    }
    return fclose(answer) ? 1 : 0;
}
