/* What the functions of FMI 3.0 begin with. */
#ifndef KR16_FMI3_H
#define KR16_FMI3_H

#include "kr16_fmu.h"

#define AT(phase) (1u << (phase))
#define ANY (AT(FAILED + 1) - 1u)

/* The instance, or return. */
#define ENTER(name, allowed)                                                                       \
    kr16_instance *self = instance;                                                                \
    if (!self)                                                                                     \
        return fmi3Error;                                                                          \
    if (kr16_must_be(self, name, allowed) != OK)                                                   \
    return fmi3Error

#define NEED(condition, name)                                                                      \
    if (!(condition))                                                                              \
    return (fmi3Status)kr16_fail(self, "%s: an argument is missing (NULL)", name)

#endif
