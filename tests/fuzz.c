/* Calls the functions of an FMU's library in any order with any arguments, from a seed, and says
 * what went wrong. Linked with the library. Usage: fuzz GUID SEED ROUNDS THREADS
 *
 * Held to: every call returns, with a status that FMI has; an error comes with exactly one line in
 * the log and changes nothing; a state that is set back goes on as it did; damaged states are
 * refused; nothing is allocated but by what makes instances and states, and all is given back;
 * threads do not disturb one another.
 * With -DCOUNT (glibc) the allocations are counted. Arrays are as long as the calls say, so that a
 * sanitizer sees what lies beyond.
 */
#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "fmi3Functions.h"

static _Thread_local long allocated, held;
static _Thread_local int hungry; /* this many allocations from now, memory is out; 0: it is not */

#ifdef COUNT
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *block, size_t size);
void __libc_free(void *block);

static int starved(void)
{
    allocated++;
    return hungry > 0 && --hungry == 0;
}

void *malloc(size_t size)
{
    void *block = starved() ? NULL : __libc_malloc(size);
    held += block != NULL;
    return block;
}

void *calloc(size_t count, size_t size)
{
    void *block = starved() ? NULL : __libc_calloc(count, size);
    held += block != NULL;
    return block;
}

void *realloc(void *block, size_t size)
{
    allocated++;
    held += block == NULL;
    return __libc_realloc(block, size);
}

void free(void *block)
{
    held -= block != NULL;
    __libc_free(block);
}
#endif

enum { ENTRIES = 163, INSTANCES = 6, STATES = 6, MOST = 40 };
/* Value references, which begin with the inputs. */
enum { INPUTS = 30, DRIVES = 56, MODE = 75, FREQUENCY = 76, STOPS = 83, TORQUE_LIMIT = 84,
       SPEED_LIMIT = 85, METHOD = 86, STEP = 87, ANGLES = 88, REALS = 119 };

typedef struct {
    void *c;
    int version, exchange, errors, lines;
} robot;

/* One thread's world. `sum` goes over everything that the library answered. */
typedef struct {
    const char *guid;
    uint64_t seed, sum;
    long rounds, errors, calls;
    uint64_t random;
    robot robots[INSTANCES];
    void *states[STATES];
    const char *call;
} world;

static void wrong(const world *w, const char *what)
{
    fprintf(stderr, "seed %llu: %s: %s\n", (unsigned long long)w->seed, w->call, what);
    exit(1);
}

static uint32_t draw(world *w, uint32_t below)
{
    w->random ^= w->random << 13;
    w->random ^= w->random >> 7;
    w->random ^= w->random << 17;
    return (uint32_t)((w->random >> 16) % below);
}

static void add(world *w, const void *bytes, size_t size)
{
    const unsigned char *b = bytes;
    for (size_t i = 0; i < size; i++)
        w->sum = (w->sum ^ b[i]) * 1099511628211u;
}

static void all_numbers(const world *w, const double *values, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!isfinite(values[i]))
            wrong(w, "no error, but what is no number");
}

static double odd(world *w)
{
    static const double pool[] = {0.0, -0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, -1.0, 1e-3, 1e-9, 5e-324,
                                  1e5, 100001.0, -1e6, 1e7, 1e100, 1.7e308, -1.7e308, 1e-300};
    switch (draw(w, 8)) {
    case 0:
        return pool[draw(w, sizeof pool / sizeof *pool)];
    case 1:
        return draw(w, 3) == 0 ? NAN : draw(w, 2) ? INFINITY : -INFINITY;
    case 2:
        return 200.0 * ((double)draw(w, 20001) / 10000.0 - 1.0);
    default:
        return (double)draw(w, 20001) / 10000.0 - 1.0;
    }
}

/* An array of n elements of the size, or NULL now and then; `given` is freed in the end. */
static void *array(world *w, size_t n, size_t size)
{
    unsigned char *block = NULL;
    if (draw(w, 24) == 0)
        return NULL;
    if (!(block = malloc(n * size + (n == 0))))
        abort();
    memset(block, 0x5a, n * size);
    return block;
}

/* A reference from first to last most of the time, else any, and now and then none. */
static unsigned reference(world *w, unsigned first, unsigned last)
{
    static const unsigned pool[] = {0u, ENTRIES, 192u, 193u, 255u, 256u, 65536u, ~0u, 1u << 31};
    if (draw(w, 32) == 0)
        return pool[draw(w, sizeof pool / sizeof *pool)];
    return draw(w, 16) ? first + draw(w, last - first + 1) : 1 + draw(w, ENTRIES - 1);
}

static unsigned *references(world *w, size_t n, unsigned first, unsigned last)
{
    unsigned *vr = array(w, n, sizeof *vr);
    const unsigned begin = reference(w, first, last);
    const int row = draw(w, 2) == 0; /* such as a host takes them: one after the other */
    for (size_t i = 0; vr && i < n; i++)
        vr[i] = row ? begin + (unsigned)i : reference(w, first, last);
    return vr;
}

static double *doubles(world *w, size_t n)
{
    double *v = array(w, n, sizeof *v);
    const int sane = draw(w, 2) == 0;
    for (size_t i = 0; v && i < n; i++)
        v[i] = sane ? (double)draw(w, 20001) / 10000.0 - 1.0 : odd(w);
    return v;
}

static int *ints(world *w, size_t n)
{
    int *v = array(w, n, sizeof *v);
    for (size_t i = 0; v && i < n; i++)
        v[i] = draw(w, 6) ? (int)draw(w, 7) : draw(w, 2) ? INT32_MAX : INT32_MIN;
    return v;
}

/* Log -------------------------------------------------------------------------------------- */

static void heard(robot *r, int status, const char *category, const char *text)
{
    if (!text || !text[0] || strlen(text) >= 512 || strchr(text, '%') || !category ||
        (strcmp(category, "logStatusError") != 0 && strcmp(category, "logStatusWarning") != 0)) {
        fprintf(stderr, "a bad line in the log: %s\n", text ? text : "(none)");
        exit(1);
    }
    r->errors += status >= 3;
    r->lines++;
}

static void log2_(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status,
                  fmi2String category, fmi2String text, ...)
{
    (void)name;
    heard(e, (int)status, category, text);
}

static void log3_(fmi3InstanceEnvironment e, fmi3Status status, fmi3String category, fmi3String text)
{
    heard(e, (int)status, category, text);
}

static void update(fmi3InstanceEnvironment e, fmi3Float64 time, fmi3Boolean set, fmi3Boolean get,
                   fmi3Boolean finished, fmi3Boolean may, fmi3Boolean *wanted, fmi3Float64 *until)
{
    const robot *r = e;
    const fmi3ValueReference vr[2] = {60, 90};
    fmi3Float64 v[2];
    (void)set;
    (void)get;
    (void)finished;
    fmi3GetFloat64(r->c, vr, 2, v, 2);
    *wanted = may && time - floor(time * 100.0) / 100.0 > 0.004;
    *until = time;
}

/* Calls ------------------------------------------------------------------------------------ */

/* Inputs, angles and speeds; of a controller, which has fewer variables, inputs. */
enum { SEEN = INPUTS + 12 };
static size_t seen_count = SEEN;

static void look(const robot *r, double *seen)
{
    unsigned vr[SEEN];
    for (unsigned i = 0; i < SEEN; i++)
        vr[i] = i < INPUTS ? i + 1 : ANGLES + i - INPUTS;
    if (r->c && (r->version == 2 ? (int)fmi2GetReal(r->c, vr, seen_count, seen)
                                 : (int)fmi3GetFloat64(r->c, vr, seen_count, seen, seen_count)))
        exit(2);
}

/* What FMI's status says, and whether log and instance fit; the rest is of before the call. */
static int judged(world *w, robot *r, int status, long before, int errors, const double *seen)
{
    double now[SEEN];
    w->calls++;
    w->errors += status >= 3;
    if (status < 0 || status > 3)
        wrong(w, "a status that it never gives");
    if (allocated != before)
        wrong(w, "it allocated");
    if (r->c && status == 3 && r->errors != errors + 1)
        wrong(w, "an error without its line in the log");
    if (status < 3 && r->errors != errors)
        wrong(w, "a line of an error, but no error");
    if (r->c && status == 3) { /* a step that fails moves as far as it gets */
        look(r, now);
        if (memcmp(seen, now, (strcmp(w->call, "doStep") ? seen_count : INPUTS) * sizeof *now) != 0)
            wrong(w, "an error, but something has changed");
    }
    add(w, &status, sizeof status);
    return status;
}

#define DO(NAME, CALL)                                                                             \
    (w->call = NAME, look(r, seen), before = allocated, errors = r->errors,                        \
     status = judged(w, r, (int)(CALL), before, errors, seen))

static void make(world *w, robot *r)
{
    static const fmi2CallbackFunctions none = {NULL, NULL, NULL, NULL, NULL};
    fmi2CallbackFunctions functions = {log2_, calloc, free, NULL, r};
    const char *guid = draw(w, 20) ? w->guid : draw(w, 2) ? NULL : "%s%n{no guid}";
    const char *name = draw(w, 4) ? "robot" : draw(w, 2) ? NULL : "";
    const char *folder = draw(w, 2) ? NULL : "file:///nowhere";
    const int logging = (int)draw(w, 2);
    r->version = 2 + (int)draw(w, 2);
    r->exchange = (int)draw(w, 2);
    hungry = draw(w, 16) == 0 ? 1 + (int)draw(w, 2) : 0;
    const int fed = !hungry;
    if (r->version == 2) {
        const fmi2CallbackFunctions *given =
            draw(w, 16) ? &functions : draw(w, 2) ? NULL : &none;
        r->c = fmi2Instantiate(name, r->exchange ? fmi2ModelExchange : fmi2CoSimulation, guid,
                               folder, given, 0, logging);
        if (r->c && given != &functions) { /* nothing is heard of it, so nothing is judged */
            fmi2SetDebugLogging(r->c, 1, 0, NULL);
            fmi2DoStep(r->c, 0.0, NAN, 0);
            fmi2FreeInstance(r->c);
            r->c = NULL;
            return;
        }
    } else if (r->exchange) {
        r->c = fmi3InstantiateModelExchange(name, guid, folder, 0, logging, r, log3_);
    } else {
        r->c = fmi3InstantiateCoSimulation(name, guid, folder, 0, logging, draw(w, 2), draw(w, 2),
                                           NULL, 0, r, log3_, draw(w, 2) ? update : NULL);
    }
    hungry = 0;
    if (fed && !r->c != (guid != w->guid))
        wrong(w, "instantiate: an instance with the wrong GUID, or none with the right one");
}

static void release(robot *r)
{
    if (r->version == 2)
        fmi2FreeInstance(r->c);
    else if (r->version == 3)
        fmi3FreeInstance(r->c);
    r->c = NULL;
}

/* What a host does before the first step, with any of the modes and methods. */
static void begin(world *w, robot *r)
{
    const unsigned choices[3] = {MODE, STOPS, METHOD}, flags[3] = {DRIVES, TORQUE_LIMIT, SPEED_LIMIT};
    const unsigned step = STEP;
    const int chosen[3] = {1 + (int)draw(w, 5), 1 + (int)draw(w, 2), 1 + (int)draw(w, 5)};
    const int yes[3] = {(int)draw(w, 2), (int)draw(w, 2), (int)draw(w, 2)};
    const fmi3Boolean truths[3] = {yes[0], yes[1], yes[2]};
    const double size = draw(w, 2) ? 1e-3 : 0.1;
    const unsigned wrist = 11; /* its reference a quarter turn away, which is singular */
    const double away = 0.5235987755982988 + 1.5707963267948966;
    if (draw(w, 4) == 0 && r->version == 2)
        fmi2SetReal(r->c, &wrist, 1, &away);
    else if (draw(w, 4) == 0)
        fmi3SetFloat64(r->c, &wrist, 1, &away, 1);
    if (r->version == 2) {
        fmi2SetInteger(r->c, choices, 3, chosen);
        fmi2SetBoolean(r->c, flags, 3, yes);
        fmi2SetReal(r->c, &step, 1, &size);
        fmi2EnterInitializationMode(r->c);
        fmi2ExitInitializationMode(r->c);
        if (r->exchange && draw(w, 2))
            fmi2EnterContinuousTimeMode(r->c);
    } else {
        fmi3SetInt32(r->c, choices, 3, chosen, 3);
        fmi3SetBoolean(r->c, flags, 3, truths, 3);
        fmi3SetFloat64(r->c, &step, 1, &size, 1);
        fmi3EnterInitializationMode(r->c, 0, 0.0, 0.0, 0, 0.0);
        fmi3ExitInitializationMode(r->c);
        if (draw(w, 2))
            (void)(r->exchange ? fmi3EnterContinuousTimeMode(r->c) : fmi3EnterStepMode(r->c));
    }
}

/* A step that does not take long: few internal ones. */
static double size(world *w)
{
    static const double pool[] = {1e-3, 1e-3, 1e-3, 4e-3, 0.01, 1.5e-3, 1e-9, 5e-324};
    const double any = odd(w);
    return draw(w, 10) ? pool[draw(w, 8)] : any > 0.02 && any < 1e9 ? 0.02 : any;
}

static unsigned clock_reference; /* of the variable time: the last */

static double time_of(const robot *r)
{
    double now = 0.0;
    if (r->version == 2 && r->c)
        fmi2GetRealStatus(r->c, fmi2LastSuccessfulTime, &now);
    else if (r->c)
        fmi3GetFloat64(r->c, &clock_reference, 1, &now, 1);
    return now;
}

static void values(world *w, robot *r)
{
    /* Of each kind: what is set, and what is read. */
    static const unsigned first[6] = {1, MODE, DRIVES, ANGLES, MODE, DRIVES};
    static const unsigned last[6] = {INPUTS, METHOD, SPEED_LIMIT, ENTRIES - 1, METHOD, 137};
    const int kind = (int)draw(w, 6);
    const size_t n = draw(w, 8), claimed = draw(w, 16) ? n : draw(w, 8);
    unsigned *vr = references(w, n, first[kind], last[kind]);
    double *v = doubles(w, n > claimed ? n : claimed);
    int *i = ints(w, n > claimed ? n : claimed);
    fmi3Boolean *b = array(w, n > claimed ? n : claimed, sizeof *b);
    double seen[SEEN];
    long before;
    int errors, status;
    for (size_t k = 0; b && k < (n > claimed ? n : claimed); k++)
        b[k] = draw(w, 2);
    /* Internal steps of a microsecond would take the rest of the day. */
    for (size_t k = 0; vr && v && k < n; k++)
        if (v[k] > 0.0 && v[k] < 5e-4)
            v[k] = 5e-4;
    if (r->version == 2) {
        switch (kind) {
        case 0: DO("setReal", fmi2SetReal(r->c, vr, n, v)); break;
        case 1: DO("setInteger", fmi2SetInteger(r->c, vr, n, i)); break;
        case 2: DO("setBoolean", fmi2SetBoolean(r->c, vr, n, i)); break;
        case 3: DO("getReal", fmi2GetReal(r->c, vr, n, v)); break;
        case 4: DO("getInteger", fmi2GetInteger(r->c, vr, n, i)); break;
        default: DO("getBoolean", fmi2GetBoolean(r->c, vr, n, i)); break;
        }
    } else {
        switch (kind) {
        case 0: DO("setFloat64", fmi3SetFloat64(r->c, vr, n, v, claimed)); break;
        case 1: DO("setInt32", fmi3SetInt32(r->c, vr, n, i, claimed)); break;
        case 2: DO("setBoolean", fmi3SetBoolean(r->c, vr, n, b, claimed)); break;
        case 3: DO("getFloat64", fmi3GetFloat64(r->c, vr, n, v, claimed)); break;
        case 4: DO("getInt32", fmi3GetInt32(r->c, vr, n, i, claimed)); break;
        default: DO("getBoolean", fmi3GetBoolean(r->c, vr, n, b, claimed)); break;
        }
    }
    if (status == 0 && kind == 3) {
        add(w, v, n * sizeof *v);
        all_numbers(w, v, n);
    }
    free(vr), free(v), free(i), free(b);
}

static void derivatives(world *w, robot *r)
{
    const size_t n = draw(w, 8), m = draw(w, 8);
    const size_t s = draw(w, 16) ? m : draw(w, 8), t = draw(w, 16) ? n : draw(w, 8);
    const int kind = (int)draw(w, 4), rising = kind == 2;
    unsigned *unknowns = references(w, n, rising ? 1 : ANGLES, rising ? INPUTS : REALS);
    unsigned *knowns = references(w, m, 1, draw(w, 2) ? INPUTS : ANGLES + 11);
    double *seeds = doubles(w, m > s ? m : s), *results = doubles(w, n > t ? n : t);
    int *orders = ints(w, n);
    double seen[SEEN];
    long before;
    int errors, status;
    for (size_t k = 0; orders && k < n; k++)
        orders[k] = draw(w, 16) ? 1 : orders[k];
    switch (kind) {
    case 0:
        if (r->version == 2)
            DO("getDirectionalDerivative",
               fmi2GetDirectionalDerivative(r->c, unknowns, n, knowns, m, seeds, results));
        else
            DO("getDirectionalDerivative",
               fmi3GetDirectionalDerivative(r->c, unknowns, n, knowns, m, seeds, s, results, t));
        if (status == 0) {
            add(w, results, n * sizeof *results);
            all_numbers(w, results, n);
        }
        break;
    case 1: /* adjoint: as many seeds as unknowns */
        if (r->version == 3)
            DO("getAdjointDerivative",
               fmi3GetAdjointDerivative(r->c, knowns, m, unknowns, n, seeds, s, results, t));
        break;
    case 2:
        if (r->version == 2)
            DO("setRealInputDerivatives",
               fmi2SetRealInputDerivatives(r->c, unknowns, n, orders, results));
        break;
    default:
        if (r->version == 2)
            DO("getRealOutputDerivatives",
               fmi2GetRealOutputDerivatives(r->c, unknowns, n, orders, results));
        else
            DO("getOutputDerivatives",
               fmi3GetOutputDerivatives(r->c, unknowns, n, orders, results, t));
    }
    free(unknowns), free(knowns), free(seeds), free(results), free(orders);
}

static void exchange(world *w, robot *r)
{
    const size_t n = draw(w, 8) ? (draw(w, 2) ? 12 : 24) : draw(w, MOST);
    double *x = doubles(w, n);
    fmi3Boolean b[5];
    fmi2Boolean event, end;
    fmi2EventInfo info;
    size_t count;
    double next;
    double seen[SEEN];
    long before;
    int errors, status;
    const int null = draw(w, 16) == 0;
    (void)status;
    if (r->version == 2) {
        switch (draw(w, 10)) {
        case 0: DO("enterEventMode", fmi2EnterEventMode(r->c)); break;
        case 1: DO("newDiscreteStates", fmi2NewDiscreteStates(r->c, null ? NULL : &info)); break;
        case 2: DO("enterContinuousTimeMode", fmi2EnterContinuousTimeMode(r->c)); break;
        case 3:
            DO("completedIntegratorStep",
               fmi2CompletedIntegratorStep(r->c, 1, null ? NULL : &event, &end));
            break;
        case 4: DO("setTime", fmi2SetTime(r->c, odd(w))); break;
        case 5: DO("setContinuousStates", fmi2SetContinuousStates(r->c, x, n)); break;
        case 6: DO("getDerivatives", fmi2GetDerivatives(r->c, x, n)); break;
        case 7: DO("getEventIndicators", fmi2GetEventIndicators(r->c, x, n)); break;
        case 8: DO("getContinuousStates", fmi2GetContinuousStates(r->c, x, n)); break;
        default: DO("getNominals", fmi2GetNominalsOfContinuousStates(r->c, x, n)); break;
        }
    } else {
        switch (draw(w, 14)) {
        case 0: DO("enterEventMode", fmi3EnterEventMode(r->c)); break;
        case 1:
            DO("updateDiscreteStates", fmi3UpdateDiscreteStates(r->c, null ? NULL : b, b + 1, b + 2,
                                                                b + 3, b + 4, &next));
            break;
        case 2: DO("enterContinuousTimeMode", fmi3EnterContinuousTimeMode(r->c)); break;
        case 3:
            DO("completedIntegratorStep",
               fmi3CompletedIntegratorStep(r->c, 1, null ? NULL : b, b + 1));
            break;
        case 4: DO("setTime", fmi3SetTime(r->c, odd(w))); break;
        case 5: DO("setContinuousStates", fmi3SetContinuousStates(r->c, x, n)); break;
        case 6: DO("getDerivatives", fmi3GetContinuousStateDerivatives(r->c, x, n)); break;
        case 7: DO("getEventIndicators", fmi3GetEventIndicators(r->c, x, n)); break;
        case 8: DO("getContinuousStates", fmi3GetContinuousStates(r->c, x, n)); break;
        case 9: DO("getNominals", fmi3GetNominalsOfContinuousStates(r->c, x, n)); break;
        case 10: DO("enterStepMode", fmi3EnterStepMode(r->c)); break;
        case 11: DO("evaluateDiscreteStates", fmi3EvaluateDiscreteStates(r->c)); break;
        case 12: DO("events", fmi3GetNumberOfEventIndicators(r->c, null ? NULL : &count)); break;
        default: DO("states", fmi3GetNumberOfContinuousStates(r->c, null ? NULL : &count)); break;
        }
    }
    free(x);
}

static void phases(world *w, robot *r)
{
    const char *names[3] = {"logAll", draw(w, 3) ? "logStatusError" : "logNothing%s", NULL};
    const size_t n = draw(w, 4);
    fmi2Status answer;
    fmi2Real real;
    fmi2Boolean yes;
    const fmi2StatusKind asked = (fmi2StatusKind)draw(w, 4);
    const int null = draw(w, 16) == 0;
    const double start = draw(w, 4) ? 0.0 : odd(w), stop = odd(w), fine = fabs(odd(w)) * 1e-3;
    double seen[SEEN];
    long before;
    int errors, status;
    if (r->version == 2) {
        switch (draw(w, 10)) {
        case 0: DO("setupExperiment",
                   fmi2SetupExperiment(r->c, draw(w, 3) == 0, fine, start, draw(w, 3) == 0, stop));
            break;
        case 1:
        case 2: DO("enterInitializationMode", fmi2EnterInitializationMode(r->c)); break;
        case 3:
        case 4: DO("exitInitializationMode", fmi2ExitInitializationMode(r->c)); break;
        case 5: DO("reset", draw(w, 4) ? fmi2OK : fmi2Reset(r->c)); break;
        case 6: DO("terminate", draw(w, 8) ? fmi2OK : fmi2Terminate(r->c)); break;
        case 7: DO("setDebugLogging", fmi2SetDebugLogging(r->c, 1, n, draw(w, 8) ? names : NULL));
            break;
        case 8: DO("getStatus", fmi2GetStatus(r->c, asked, null ? NULL : &answer)); break;
        default:
            DO("getRealStatus", fmi2GetRealStatus(r->c, asked, null ? NULL : &real));
            DO("getBooleanStatus", fmi2GetBooleanStatus(r->c, asked, null ? NULL : &yes));
            DO("getIntegerStatus", fmi2GetIntegerStatus(r->c, asked, NULL));
            DO("getStringStatus", fmi2GetStringStatus(r->c, asked, NULL));
            DO("cancelStep", fmi2CancelStep(r->c));
            DO("getString", fmi2GetString(r->c, NULL, n, NULL));
            DO("setString", fmi2SetString(r->c, NULL, n, NULL));
        }
    } else {
        switch (draw(w, 8)) {
        case 0:
        case 1: DO("enterInitializationMode",
                   fmi3EnterInitializationMode(r->c, draw(w, 3) == 0, fine, start,
                                               draw(w, 3) == 0, stop));
            break;
        case 2:
        case 3: DO("exitInitializationMode", fmi3ExitInitializationMode(r->c)); break;
        case 4: DO("reset", draw(w, 4) ? fmi3OK : fmi3Reset(r->c)); break;
        case 5: DO("terminate", draw(w, 8) ? fmi3OK : fmi3Terminate(r->c)); break;
        case 6: DO("setDebugLogging", fmi3SetDebugLogging(r->c, 1, n, draw(w, 8) ? names : NULL));
            break;
        default:
            DO("configuration", fmi3EnterConfigurationMode(r->c));
            DO("configuration", fmi3ExitConfigurationMode(r->c));
            DO("partition", fmi3ActivateModelPartition(r->c, reference(w, 1, 9), odd(w)));
            DO("getString", fmi3GetString(r->c, NULL, n, NULL, n));
            DO("getBinary", fmi3GetBinary(r->c, NULL, n, NULL, NULL, n));
            DO("setClock", fmi3SetClock(r->c, NULL, n, NULL));
            DO("getIntervalDecimal", fmi3GetIntervalDecimal(r->c, NULL, n, NULL, NULL));
            DO("setUInt64", fmi3SetUInt64(r->c, NULL, n, NULL, n));
            DO("dependencies", fmi3GetNumberOfVariableDependencies(r->c, reference(w, 1, 9), NULL));
        }
    }
}

static void step(world *w, robot *r)
{
    const double t = draw(w, 16) ? time_of(r) : odd(w), h = size(w);
    fmi3Boolean event = 0, end = 0, early = 0;
    fmi3Float64 reached = 0.0;
    double seen[SEEN];
    long before;
    int errors, status;
    if (r->version == 2) {
        DO("doStep", fmi2DoStep(r->c, t, h, 1));
        return;
    }
    DO("doStep", fmi3DoStep(r->c, t, h, 1, &event, draw(w, 16) ? &end : NULL, &early, &reached));
    if (status == 0 && !(reached == t + h || ((event || early) && reached <= t + h)))
        wrong(w, "it says that it ended elsewhere");
    if (status == 0)
        add(w, &reached, sizeof reached);
}

/* Most of what a host does with an instance between its making and its end. */
static void any(world *w, robot *r)
{
    switch (draw(w, 12)) {
    case 0:
    case 1:
    case 2:
        values(w, r);
        break;
    case 3:
    case 4:
        derivatives(w, r);
        break;
    case 5:
    case 6:
        exchange(w, r);
        break;
    case 7:
    case 8:
        phases(w, r);
        break;
    default:
        step(w, r);
    }
}

/* States ----------------------------------------------------------------------------------- */

static int take(robot *r, void **state)
{
    return r->version == 2 ? (int)fmi2GetFMUstate(r->c, state) : (int)fmi3GetFMUState(r->c, state);
}

static int put_back(robot *r, void *state)
{
    return r->version == 2 ? (int)fmi2SetFMUstate(r->c, state) : (int)fmi3SetFMUState(r->c, state);
}

static void forget(robot *r, void **state)
{
    if (r->version == 2)
        fmi2FreeFMUstate(r->c, state);
    else
        fmi3FreeFMUState(r->c, state);
}

static int write_state(robot *r, void *state, unsigned char *bytes, size_t size)
{
    return r->version == 2 ? (int)fmi2SerializeFMUstate(r->c, state, (fmi2Byte *)bytes, size)
                           : (int)fmi3SerializeFMUState(r->c, state, bytes, size);
}

static int read_state(robot *r, const unsigned char *bytes, size_t size, void **state)
{
    return r->version == 2
               ? (int)fmi2DeSerializeFMUstate(r->c, (const fmi2Byte *)bytes, size, state)
               : (int)fmi3DeserializeFMUState(r->c, bytes, size, state);
}

/* Two runs from one state are the same run. */
static void repeat(world *w, robot *r)
{
    void *state = NULL;
    const int count = 1 + (int)draw(w, 20);
    uint64_t sums[2], random = w->random, sum = w->sum;
    w->call = "getFMUState";
    if (!r->c || take(r, &state) != 0 || !state)
        wrong(w, "no state");
    for (int turn = 0; turn < 2; turn++) {
        if (turn && put_back(r, state) != 0)
            wrong(w, "the state is not set back");
        w->random = random;
        w->sum = sum;
        for (int k = 0; k < count; k++)
            any(w, r);
        sums[turn] = w->sum;
    }
    w->call = "setFMUState";
    if (sums[0] != sums[1])
        wrong(w, "what follows differs from the first time");
    forget(r, &state);
    if (state)
        wrong(w, "the state is freed, but not its pointer set to NULL");
}

/* A serialized state, whole and damaged. */
static void serialize(world *w, robot *r)
{
    void *state = NULL, *other = NULL;
    size_t size = 0;
    w->call = "serializeFMUState";
    if (!r->c || take(r, &state) != 0)
        wrong(w, "no state");
    if ((r->version == 2 ? (int)fmi2SerializedFMUstateSize(r->c, state, &size)
                         : (int)fmi3SerializedFMUStateSize(r->c, state, &size)) != 0 ||
        !size)
        wrong(w, "no size");
    const size_t cut = draw(w, (uint32_t)size), place = draw(w, (uint32_t)size);
    unsigned char *bytes = malloc(size), *part = malloc(cut + 1);
    if (!bytes || !part)
        abort();
    if (write_state(r, state, bytes, size) != 0 || write_state(r, state, part, cut) != 3 ||
        write_state(r, NULL, bytes, size) != 3 || write_state(r, state, NULL, size) != 3)
        wrong(w, "the wrong one is refused");
    w->call = "deserializeFMUState";
    hungry = draw(w, 4) == 0;
    if (hungry && read_state(r, bytes, size, &other) == 0 && hungry == 0)
        wrong(w, "memory is out, but there is a state");
    forget(r, &other);
    hungry = 0;
    memcpy(part, bytes, cut);
    if (read_state(r, part, cut, &other) != 3 || read_state(r, NULL, size, &other) != 3 ||
        read_state(r, bytes, size, NULL) != 3)
        wrong(w, "what is cut off, or missing, is taken");
    if (read_state(r, bytes, size, &other) != 0 || put_back(r, other) != 0)
        wrong(w, "what is whole is refused");
    forget(r, &other);
    bytes[place] ^= (unsigned char)(1u << draw(w, 8));
    if (read_state(r, bytes, size, &other) != 3)
        wrong(w, "what is damaged is taken");
    if (put_back(r, NULL) != 3 || take(r, NULL) != 3)
        wrong(w, "a missing state is taken");
    forget(r, &state);
    free(bytes), free(part);
}

/* States of one instance, set in another: refused or taken, never mixed up. */
static void swap(world *w, robot *r)
{
    void **state = &w->states[draw(w, STATES)];
    w->call = "getFMUState or setFMUState";
    hungry = draw(w, 16) == 0;
    const int fed = !hungry;
    if (*state && draw(w, 4) == 0) {
        forget(r, state);
        if (r->c && *state)
            wrong(w, "a state is freed, but not its pointer set to NULL");
    } else if (draw(w, 2)) {
        const int had = *state != NULL, status = take(r, state);
        if (fed && (status != 0) != (r->c == NULL))
            wrong(w, "a state is refused");
        if (status != 0 && !had && *state)
            wrong(w, "an error, but a state");
    } else if (*state && r->c) {
        const int status = put_back(r, *state);
        if (status != 0 && status != 3)
            wrong(w, "a status that it never gives");
    }
    hungry = 0;
}

/* Worlds ----------------------------------------------------------------------------------- */

static void *live(void *argument)
{
    world *w = argument;
    const long before = held;
    w->random = (w->seed + 1) * 0x9e3779b97f4a7c15u;
    w->sum = 14695981039346656037u;
    for (long k = 0; k < w->rounds; k++) {
        robot *r = &w->robots[draw(w, INSTANCES)];
        const uint32_t turn = draw(w, 64);
        if (turn == 0 || (!r->c && turn < 32)) {
            release(r);
            make(w, r);
            if (r->c && draw(w, 4))
                begin(w, r);
        } else if (turn < 3 && r->c) {
            repeat(w, r);
        } else if (turn < 5 && r->c) {
            serialize(w, r);
        } else if (turn < 8 && r->version) {
            swap(w, r);
        } else if (r->version) {
            any(w, r);
        }
    }
    for (int k = 0; k < STATES; k++) {
        robot keeper = {.version = 2};
        robot *r = &w->robots[0];
        if (!r->c) {
            fmi2CallbackFunctions functions = {log2_, calloc, free, NULL, &keeper};
            keeper.c = fmi2Instantiate("keeper", fmi2CoSimulation, w->guid, NULL, &functions, 0, 0);
            r = &keeper;
        }
        forget(r, &w->states[k]);
        if (keeper.c)
            release(&keeper);
    }
    for (int k = 0; k < INSTANCES; k++)
        release(&w->robots[k]);
    w->call = "at the end";
    if (held != before)
        wrong(w, "memory is not given back");
    return NULL;
}

/* Many instances at once, each where it should be. */
static void crowd(const char *guid, int count)
{
    robot *all = calloc((size_t)count, sizeof *all);
    fmi2CallbackFunctions functions = {log2_, calloc, free, NULL, NULL};
    double first = 0.0, value = 0.0;
    const unsigned vr = seen_count == SEEN ? ANGLES + 2 : clock_reference - 6;
    for (int k = 0; k < count; k++) {
        functions.componentEnvironment = &all[k];
        all[k].c = fmi2Instantiate("one", fmi2CoSimulation, guid, NULL, &functions, 0, 0);
        if (!all[k].c || fmi2EnterInitializationMode(all[k].c) != fmi2OK ||
            fmi2ExitInitializationMode(all[k].c) != fmi2OK)
            exit(2);
    }
    for (int k = 0; k < count; k++)
        if (fmi2DoStep(all[k].c, 0.0, 0.01, 1) != fmi2OK)
            exit(2);
    for (int k = 0; k < count; k++) {
        if (fmi2GetReal(all[k].c, &vr, 1, k ? &value : &first) != fmi2OK || (k && value != first))
            exit(2);
        fmi2FreeInstance(all[k].c);
    }
    free(all);
}

static void find_clock(const char *guid)
{
    robot r = {.version = 3};
    double value;
    r.c = fmi3InstantiateModelExchange("one", guid, NULL, 0, 0, &r, log3_);
    if (!r.c)
        exit(2);
    for (unsigned vr = 1; fmi3GetFloat64(r.c, &vr, 1, &value, 1) == fmi3OK; vr++)
        clock_reference = vr;
    fmi3FreeInstance(r.c);
    seen_count = clock_reference < ENTRIES - 1 ? INPUTS : SEEN;
    if (strcmp(fmi2GetVersion(), "2.0") != 0 || strcmp(fmi3GetVersion(), "3.0") != 0 ||
        strcmp(fmi2GetTypesPlatform(), "default") != 0 ||
        fmi3InstantiateScheduledExecution("one", guid, NULL, 0, 0, &r, log3_, NULL, NULL, NULL))
        exit(2);
    fmi2FreeInstance(NULL);
    fmi3FreeInstance(NULL);
}

int main(int count, char **words)
{
    if (count != 5)
        return 2;
    find_clock(words[1]);
    const int threads = atoi(words[4]);
    world *serial = calloc((size_t)threads, sizeof *serial);
    world *parallel = calloc((size_t)threads, sizeof *parallel);
    pthread_t *ids = calloc((size_t)threads, sizeof *ids);
    long calls = 0, errors = 0;
    for (int k = 0; k < threads; k++) {
        serial[k].guid = words[1];
        serial[k].seed = strtoull(words[2], NULL, 10) + (uint64_t)k;
        serial[k].rounds = atol(words[3]);
        parallel[k] = serial[k];
        live(&serial[k]);
        calls += serial[k].calls;
        errors += serial[k].errors;
    }
    for (int k = 0; threads > 1 && k < threads; k++)
        if (pthread_create(&ids[k], NULL, live, &parallel[k]) != 0)
            return 2;
    for (int k = 0; threads > 1 && k < threads; k++) {
        pthread_join(ids[k], NULL);
        if (parallel[k].sum != serial[k].sum)
            wrong(&parallel[k], "another thread changed what it answers");
    }
    crowd(words[1], 3000);
    printf("%ld calls, %ld errors\n", calls, errors);
    free(serial), free(parallel), free(ids);
    return 0;
}
