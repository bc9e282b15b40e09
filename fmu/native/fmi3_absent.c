/* The functions of FMI 3.0 for what a robot has not: other types, clocks, structural parameters. */
#include "fmi3Functions.h"

#include "kr16_fmi3.h"

static fmi3Status none_of(kr16_instance *self, size_t n)
{
    if (!self)
        return fmi3Error;
    return n ? (fmi3Status)kr16_fail(self, "there are only variables of types Float64, Int32 and "
                                           "Boolean")
             : fmi3OK;
}

#define NONE(NAME, TYPE)                                                                           \
    fmi3Status fmi3Get##NAME(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,       \
                             TYPE value[], size_t count)                                           \
    {                                                                                              \
        (void)vr;                                                                                  \
        (void)value;                                                                               \
        (void)count;                                                                               \
        return none_of(instance, n);                                                  \
    }                                                                                              \
    fmi3Status fmi3Set##NAME(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,       \
                             const TYPE value[], size_t count)                                     \
    {                                                                                              \
        (void)vr;                                                                                  \
        (void)value;                                                                               \
        (void)count;                                                                               \
        return none_of(instance, n);                                                  \
    }

NONE(Float32, fmi3Float32)
NONE(Int8, fmi3Int8)
NONE(UInt8, fmi3UInt8)
NONE(Int16, fmi3Int16)
NONE(UInt16, fmi3UInt16)
NONE(UInt32, fmi3UInt32)
NONE(Int64, fmi3Int64)
NONE(UInt64, fmi3UInt64)
NONE(String, fmi3String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                         size_t sizes[], fmi3Binary value[], size_t count)
{
    (void)vr;
    (void)sizes;
    (void)value;
    (void)count;
    return none_of(instance, n);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                         const size_t sizes[], const fmi3Binary value[], size_t count)
{
    (void)vr;
    (void)sizes;
    (void)value;
    (void)count;
    return none_of(instance, n);
}

#define CLOCKS(NAME, ...)                                                                          \
    fmi3Status fmi3##NAME(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,          \
                          __VA_ARGS__)                                                             \
    {                                                                                              \
        (void)vr;                                                                                  \
        (void)value;                                                                               \
        return none_of(instance, n);                                                        \
    }
#define CLOCKS2(NAME, SECOND, ...)                                                                 \
    fmi3Status fmi3##NAME(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,          \
                          __VA_ARGS__)                                                             \
    {                                                                                              \
        (void)vr;                                                                                  \
        (void)value;                                                                               \
        (void)SECOND;                                                                              \
        return none_of(instance, n);                                                        \
    }

CLOCKS(GetClock, fmi3Clock value[])
CLOCKS(SetClock, const fmi3Clock value[])
CLOCKS2(GetIntervalDecimal, q, fmi3Float64 value[], fmi3IntervalQualifier q[])
CLOCKS(GetShiftDecimal, fmi3Float64 value[])
CLOCKS2(GetShiftFraction, r, fmi3UInt64 value[], fmi3UInt64 r[])
CLOCKS(SetIntervalDecimal, const fmi3Float64 value[])
CLOCKS2(SetIntervalFraction, r, const fmi3UInt64 value[], const fmi3UInt64 r[])
CLOCKS(SetShiftDecimal, const fmi3Float64 value[])
CLOCKS2(SetShiftFraction, r, const fmi3UInt64 value[], const fmi3UInt64 r[])

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
                                   fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier qualifiers[])
{
    (void)vr;
    (void)counters;
    (void)resolutions;
    (void)qualifiers;
    return none_of(instance, n);
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clock,
                                      fmi3Float64 time)
{
    (void)clock;
    (void)time;
    return none_of(instance, 1);
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference vr,
                                               size_t *count)
{
    ENTER("getNumberOfVariableDependencies", ANY);
    (void)vr;
    (void)count;
    return (fmi3Status)kr16_fail(self, "getNumberOfVariableDependencies: the dependencies never "
                                       "change; they stand in the model description");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference vr,
                                       size_t elements[], fmi3ValueReference knowns[],
                                       size_t known_elements[], fmi3DependencyKind kinds[],
                                       size_t n)
{
    ENTER("getVariableDependencies", ANY);
    (void)vr;
    (void)elements;
    (void)knowns;
    (void)known_elements;
    (void)kinds;
    (void)n;
    return (fmi3Status)kr16_fail(self, "getVariableDependencies: the dependencies never change; "
                                       "they stand in the model description");
}

static fmi3Status unstructured(fmi3Instance instance, const char *call)
{
    kr16_instance *self = instance;
    if (!self)
        return fmi3Error;
    return (fmi3Status)kr16_fail(self, "%s: there are no structural parameters", call);
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
    return unstructured(instance, "enterConfigurationMode");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
    return unstructured(instance, "exitConfigurationMode");
}
