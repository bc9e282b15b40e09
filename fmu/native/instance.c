/* Making, freeing and resetting instances; their log. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kr16_fmu.h"

static const char *const categories[] = {"logStatusWarning", "logStatusError"};

kr16_instance *kr16_new(const char *name, int version, int model_exchange)
{
    kr16_instance *instance = calloc(1, sizeof *instance);
    const char *own = name && name[0] ? name : "KR16";
    if (!instance)
        return NULL;
    instance->name = malloc(strlen(own) + 1);
    if (!instance->name) {
        free(instance);
        return NULL;
    }
    memcpy(instance->name, own, strlen(own) + 1);
    instance->version = version;
    instance->model_exchange = model_exchange;
    kr16_reset(instance);
    return instance;
}

void kr16_free(kr16_instance *instance)
{
    if (!instance)
        return;
    free(instance->name);
    free(instance);
}

int kr16_reset(kr16_instance *instance)
{
    kr16_core *core = &instance->core;
    memset(core, 0, sizeof *core);
    memcpy(core->value, kr16_robot.start, sizeof core->value);
    core->tolerance = 1e-8;
    core->stop = HUGE_VAL;
    return OK;
}

void kr16_stale(kr16_instance *instance)
{
    const uint32_t flags =
        1u << GROUP_LIMIT_POSITION | 1u << GROUP_LIMIT_SPEED | 1u << GROUP_LIMIT_TORQUE;
    const int phase = instance->core.phase;
    const int held = phase == CONTINUOUS_TIME || (phase == STEPPING && instance->event_mode);
    instance->core.fresh &= held ? flags : 0u;
}

static void tell(kr16_instance *instance, int status, uint32_t category, const char *format,
                 va_list arguments)
{
    char text[512];
    int place = 0;
    if (!instance->tell)
        return;
    while (!(category >> place & 1u))
        place++;
    vsnprintf(text, sizeof text, format, arguments);
    for (char *c = text; *c; c++)
        if (*c == '%') /* some hosts print the text as a format */
            *c = '/';
    instance->tell(instance, status, categories[place], text);
}

void kr16_say(kr16_instance *instance, int status, uint32_t category, const char *format, ...)
{
    va_list arguments;
    if (!instance->logging || !(instance->categories & category))
        return;
    va_start(arguments, format);
    tell(instance, status, category, format, arguments);
    va_end(arguments);
}

int kr16_fail(kr16_instance *instance, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    tell(instance, ERROR, LOG_ERRORS, format, arguments);
    va_end(arguments);
    return ERROR;
}

int kr16_log_categories(kr16_instance *instance, int on, size_t count, const char *const *names)
{
    uint32_t chosen = count ? 0u : (uint32_t)LOG_ALL;
    if (count && !names)
        return kr16_fail(instance, "setDebugLogging: no categories are given, but %lu of them",
                         (unsigned long)count);
    for (size_t k = 0; k < count; k++) {
        uint32_t bit = names[k] && !strcmp(names[k], "logAll") ? (uint32_t)LOG_ALL : 0u;
        for (uint32_t i = 0; i < sizeof categories / sizeof *categories; i++)
            if (names[k] && !strcmp(names[k], categories[i]))
                bit |= 1u << i;
        if (!bit)
            return kr16_fail(instance, "setDebugLogging: there is no category \"%.40s\"",
                             names[k] ? names[k] : "(none)");
        chosen |= bit;
    }
    instance->logging = on != 0;
    instance->categories = chosen;
    return OK;
}
