/* A host that is not Python: loads an FMU's library, runs it, prints log and angles.
 * Usage: host LIBRARY GUID RESOURCES STEPS; "-" as RESOURCES passes NULL. */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;

static void print(void *e, const char *name, int status, const char *category, const char *text, ...) {
    (void)e;
    printf("log %s %d %s: %s\n", name, status, category ? category : "-", text);
}

static void *symbol(void *library, const char *name) {
    void *found = dlsym(library, name);
    if (!found) exit(3);
    return found;
}

int main(int count, char **words) {
    if (count != 5) return 2;
    Callbacks callbacks = {print, calloc, free, NULL, NULL};
    int steps = atoi(words[4]);
    for (int round = 0; round < 2; round++) { /* the second run is what kills some FMUs */
        void *library = dlopen(words[1], RTLD_NOW | RTLD_LOCAL);
        if (!library) return printf("not loaded: %s\n", dlerror()), 3;
        void *(*make)(const char *, int, const char *, const char *, const Callbacks *, int, int) =
            symbol(library, "fmi2Instantiate");
        const char *resources = strcmp(words[3], "-") ? words[3] : NULL;
        void *c = make("robot", 1, words[2], resources, &callbacks, 0, 0);
        if (!c) return printf("not instantiated\n"), 1;
        int (*setup)(void *, int, double, double, int, double) = symbol(library, "fmi2SetupExperiment");
        int (*enter)(void *) = symbol(library, "fmi2EnterInitializationMode");
        int (*leave)(void *) = symbol(library, "fmi2ExitInitializationMode");
        int (*step)(void *, double, double, int) = symbol(library, "fmi2DoStep");
        int (*get)(void *, const unsigned *, size_t, double *) = symbol(library, "fmi2GetReal");
        void (*release)(void *) = symbol(library, "fmi2FreeInstance");
        if (setup(c, 0, 0.0, 0.0, 0, 0.0) || enter(c) || leave(c)) return 4;
        clock_t start = clock();
        for (int k = 0; k < steps; k++)
            if (step(c, k * 0.001, 0.001, 1)) return 5;
        double each = (double)(clock() - start) / CLOCKS_PER_SEC / (steps ? steps : 1);
        if (step(c, 0.0, -1.0, 1) != 3) return 6; /* an error, and the instance lives on */
        double value;
        unsigned reference = 0;
        if (get(c, &reference, 1, &value)) return 7;
        printf("round %d: %g us a step\n", round, 1e6 * each);
        release(c);
        dlclose(library);
    }
    printf("done\n");
    return 0;
}
