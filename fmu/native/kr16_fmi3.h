/* What the functions of FMI 3.0 begin with. */
#ifndef KR16_FMI3_H
#define KR16_FMI3_H

#include "calls.h"

/* The instance, or return. */
#define ENTER(name, allowed)                                                                       \
    kr16_instance *self = instance;                                                                \
    if (kr16_enter(self, name, allowed) != OK)                                                     \
    return fmi3Error

#define NEED(condition, name)                                                                      \
    if (!(condition))                                                                              \
    return (fmi3Status)kr16_missing(self, name)

#endif
