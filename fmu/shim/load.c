/* Finds libpython, loads pythonfmu's library, and says what is missing. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <link.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "shim.h"

Api api;
static pthread_once_t once = PTHREAD_ONCE_INIT;
static char problem[TEXT];

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

const char *refusal(int type, String guid, const char *folder, char *text) {
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
