/* Saved states: the core as it is. The first eight bytes are 0, as one importer frees them. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "kr16_fmu.h"

typedef struct {
    uint64_t zero, build, check, kind;
    kr16_core core;
} saved;

/* FNV-1a. */
static uint64_t hash(uint64_t h, const void *bytes, size_t size)
{
    const unsigned char *b = bytes;
    for (size_t i = 0; i < size; i++)
        h = (h ^ b[i]) * 1099511628211u;
    return h;
}

static uint64_t build(void)
{
    const size_t size = sizeof(saved);
    return hash(hash(14695981039346656037u, &size, sizeof size), kr16_robot.token,
                sizeof kr16_robot.token);
}

static uint64_t checked(const saved *s)
{
    return hash(hash(s->build, &s->kind, sizeof s->kind), &s->core, sizeof s->core);
}

/* What an instance was made for; its phases are not those of another kind. */
static uint64_t kind(const kr16_instance *instance)
{
    return (uint64_t)(instance->model_exchange != 0) + 2u * (uint64_t)(instance->event_mode != 0);
}

size_t kr16_state_size(void)
{
    return sizeof(saved);
}

static int usable(kr16_instance *instance, const saved *state, const char *call)
{
    if (!state)
        return kr16_fail(instance, "%s: no state is given (NULL)", call);
    if (state->zero != 0 || state->build != build())
        return kr16_fail(instance, "%s: the bytes are no state of this build of the FMU", call);
    return OK;
}

int kr16_save(kr16_instance *instance, void **state)
{
    saved *s = *state;
    if (s && usable(instance, s, "getFMUState") != OK)
        return ERROR;
    if (!s && !(s = calloc(1, sizeof *s)))
        return kr16_fail(instance, "getFMUState: out of memory");
    s->build = build();
    s->kind = kind(instance);
    memcpy(&s->core, &instance->core, sizeof s->core);
    *state = s;
    return OK;
}

int kr16_restore(kr16_instance *instance, const void *state)
{
    const saved *s = state;
    if (usable(instance, s, "setFMUState") != OK)
        return ERROR;
    if (s->kind != kind(instance))
        return kr16_fail(instance, "setFMUState: the state is of an instance of another kind: of "
                                   "model exchange, of co-simulation, or of that with events");
    memcpy(&instance->core, &s->core, sizeof s->core);
    return OK;
}

int kr16_forget(kr16_instance *instance, void **state)
{
    (void)instance;
    if (state) { /* NULL is to be ignored */
        free(*state);
        *state = NULL;
    }
    return OK;
}

int kr16_write_state(kr16_instance *instance, const void *state, void *bytes, size_t size)
{
    const saved *s = state;
    if (usable(instance, s, "serializeFMUState") != OK)
        return ERROR;
    if (!bytes || size < sizeof *s)
        return kr16_fail(instance, "serializeFMUState: %lu bytes are too few; %lu are needed",
                         bytes ? (unsigned long)size : 0ul, (unsigned long)sizeof *s);
    saved copy;
    memcpy(&copy, s, sizeof copy);
    copy.core.stop = HUGE_VAL; /* what goes on elsewhere is another experiment */
    copy.check = checked(&copy);
    memset(bytes, 0, size);
    memcpy(bytes, &copy, sizeof copy);
    return OK;
}

int kr16_read_state(kr16_instance *instance, const void *bytes, size_t size, void **state)
{
    saved *s = state ? calloc(1, sizeof *s) : NULL;
    if (!state)
        return kr16_fail(instance, "deserializeFMUState: no place for the state (NULL)");
    if (!s)
        return kr16_fail(instance, "deserializeFMUState: out of memory");
    if (bytes && size >= sizeof *s)
        memcpy(s, bytes, sizeof *s);
    if (s->zero != 0 || s->build != build() || s->check != checked(s)) {
        free(s);
        return kr16_fail(instance, "deserializeFMUState: the %lu bytes are no state of this build "
                                   "of the FMU", bytes ? (unsigned long)size : 0ul);
    }
    s->check = 0;
    *state = s;
    return OK;
}
