/* Directional and adjoint derivatives as FMI asks for them, and derivatives of outputs by time. */
#include <math.h>

#include "kr16_fmu.h"

/* The entry of an unknown, or of a known, if it may be one. */
static const kr16_entry *entry_of(kr16_instance *instance, const char *call, unsigned reference,
                                  int known)
{
    if (reference - 1u >= (unsigned)kr16_robot.entries) {
        kr16_fail(instance, "%s: no variable has the value reference %u", call, reference);
        return NULL;
    }
    const kr16_entry *entry = &kr16_robot.entry[reference - 1u];
    const int slot = entry->slot, state = slot >= SLOT_Q && slot < SLOT_Q + STATES;
    const int group = kr16_slots[slot].group;
    const int start = slot >= SLOT_Q_START && slot < SLOT_Q_START + STATES &&
                      instance->core.phase <= INITIALIZING;
    const int smooth = state || (kr16_slots[slot].kind == REAL && group != 0);
    if (known ? slot < INPUTS || state || start || slot == SLOT_TIME : smooth)
        return entry;
    kr16_fail(instance,
              known ? "%s: no derivatives by %s; by states and inputs, and by q_start and qd_start "
                      "before the initialization ends"
                    : "%s: no derivatives of %s; of outputs and derivatives of type Real",
              call, kr16_name_of(slot).text);
    return NULL;
}

/* Adds a seed for one number of a known to a direction. */
static void seed(int slot, double value, double *dx, double *du)
{
    if (slot < INPUTS)
        du[slot] += value;
    else if (slot >= SLOT_Q && slot < SLOT_Q + STATES)
        dx[slot - SLOT_Q] += value;
    else if (slot != SLOT_TIME) /* nothing follows from time alone */
        dx[slot - SLOT_Q_START] += value;
}

/* The sizes of unknowns and knowns and the groups of the unknowns. */
static int measure(kr16_instance *instance, const kr16_request *r, size_t *unknowns, size_t *knowns,
                   uint32_t *groups)
{
    *unknowns = *knowns = 0;
    *groups = 0;
    if ((r->unknown_count && !r->unknowns) || (r->known_count && !r->knowns))
        return kr16_fail(instance, "%s: references are missing (NULL)", r->call);
    for (size_t k = 0; k < r->unknown_count; k++) {
        const kr16_entry *entry = entry_of(instance, r->call, r->unknowns[k], 0);
        if (!entry)
            return ERROR;
        *unknowns += entry->count;
        *groups |= 1u << kr16_slots[entry->slot].group;
    }
    for (size_t k = 0; k < r->known_count; k++) {
        const kr16_entry *entry = entry_of(instance, r->call, r->knowns[k], 1);
        if (!entry)
            return ERROR;
        *knowns += entry->count;
    }
    return OK;
}

static int all_finite(kr16_instance *instance, const char *call, const char *what,
                      const double *values, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!isfinite(values[i]))
            return kr16_fail(instance, "%s: %s number %lu is %g; it must be finite", call, what,
                             (unsigned long)i + 1, values[i]);
    return OK;
}

static int sizes_fit(kr16_instance *instance, const kr16_request *r, size_t seeds, size_t results)
{
    if (r->seed_count != seeds || r->result_count != results)
        return kr16_fail(instance, "%s: %lu seeds and %lu sensitivities; there are %lu and %lu",
                         r->call, (unsigned long)r->seed_count, (unsigned long)r->result_count,
                         (unsigned long)seeds, (unsigned long)results);
    if ((seeds && !r->seeds) || (results && !r->results))
        return kr16_fail(instance, "%s: seeds or sensitivities are missing (NULL)", r->call);
    return all_finite(instance, r->call, "seed", r->seeds, seeds);
}

int kr16_directional(kr16_instance *instance, const kr16_request *r)
{
    double change[SLOTS] = {0.0}, dx[STATES] = {0.0}, du[INPUTS] = {0.0};
    size_t unknowns, knowns, place = 0;
    uint32_t groups;
    if (measure(instance, r, &unknowns, &knowns, &groups) != OK ||
        sizes_fit(instance, r, knowns, unknowns) != OK)
        return ERROR;
    for (size_t k = 0; k < r->known_count; k++) {
        const kr16_entry *entry = &kr16_robot.entry[r->knowns[k] - 1u];
        for (int i = 0; i < entry->count; i++)
            seed(entry->slot + i, r->seeds[place++], dx, du);
    }
    if (kr16_outputs_along(instance, groups, dx, du, change) != OK)
        return ERROR;
    place = 0;
    for (size_t k = 0; k < r->unknown_count; k++) {
        const kr16_entry *entry = &kr16_robot.entry[r->unknowns[k] - 1u];
        for (int i = 0; i < entry->count; i++)
            r->results[place++] = change[entry->slot + i];
    }
    return all_finite(instance, r->call, "sensitivity", r->results, place);
}

/* Seeds times the change of the unknowns along one number of a known. */
static double dotted(const kr16_request *r, const double *change)
{
    double sum = 0.0;
    size_t place = 0;
    for (size_t k = 0; k < r->unknown_count; k++) {
        const kr16_entry *entry = &kr16_robot.entry[r->unknowns[k] - 1u];
        for (int i = 0; i < entry->count; i++)
            sum += r->seeds[place++] * change[entry->slot + i];
    }
    return sum;
}

int kr16_adjoint(kr16_instance *instance, const kr16_request *r)
{
    size_t unknowns, knowns, place = 0;
    uint32_t groups;
    if (measure(instance, r, &unknowns, &knowns, &groups) != OK ||
        sizes_fit(instance, r, unknowns, knowns) != OK)
        return ERROR;
    for (size_t k = 0; k < r->known_count; k++) {
        const kr16_entry *entry = &kr16_robot.entry[r->knowns[k] - 1u];
        for (int i = 0; i < entry->count; i++) {
            double change[SLOTS] = {0.0}, dx[STATES] = {0.0}, du[INPUTS] = {0.0};
            seed(entry->slot + i, 1.0, dx, du);
            if (kr16_outputs_along(instance, groups, dx, du, change) != OK)
                return ERROR;
            r->results[place++] = dotted(r, change);
        }
    }
    return all_finite(instance, r->call, "sensitivity", r->results, place);
}

int kr16_output_rises(kr16_instance *instance, const unsigned *references, size_t n,
                      const int *orders, double *values, size_t count)
{
    const char *call = "getOutputDerivatives";
    kr16_core *core = &instance->core;
    double change[SLOTS] = {0.0}, dx[STATES] = {0.0};
    const kr16_request r = {call, references, n, NULL, 0, NULL, 0, values, count};
    size_t unknowns, knowns, place = 0;
    uint32_t groups;
    if (n && !orders)
        return kr16_fail(instance, "%s: orders are missing (NULL)", call);
    if (measure(instance, &r, &unknowns, &knowns, &groups) != OK ||
        sizes_fit(instance, &r, 0, unknowns) != OK)
        return ERROR;
    for (size_t k = 0; k < n; k++)
        if (orders[k] != 1)
            return kr16_fail(instance, "%s: order %d; only the first is known", call, orders[k]);
    if (kr16_robot.part == ROBOT && kr16_derivatives(instance, dx, STATES) != OK)
        return ERROR;
    if (kr16_outputs_along(instance, groups, dx, core->rise, change) != OK)
        return ERROR;
    for (size_t k = 0; k < n; k++) {
        const kr16_entry *entry = &kr16_robot.entry[references[k] - 1u];
        for (int i = 0; i < entry->count; i++)
            values[place++] = change[entry->slot + i];
    }
    return all_finite(instance, call, "derivative", values, place);
}
