/* Reading and writing values by reference; outputs are computed when they are asked for. */
#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "kr16_fmu.h"

static const char *const kinds[] = {"Real", "Integer", "Boolean"};
static const char *const groups[] = {
    [GROUP_QDD] = "qdd",       [GROUP_TAU_APPLIED] = "tau_applied", [GROUP_POSE] = "pose",
    [GROUP_ENERGY] = "energy", [GROUP_TAU_WANTED] = "tau",          [GROUP_MARGIN] = "margin"};

static const kr16_entry *find(kr16_instance *instance, const char *call, unsigned reference)
{
    if (reference - 1u < (unsigned)kr16_robot.entries)
        return &kr16_robot.entry[reference - 1u];
    kr16_fail(instance, "%s: no variable has the value reference %u; they go from 1 to %d", call,
              reference, (int)kr16_robot.entries);
    return NULL;
}

/* How far beyond a limit a flag goes up: flags that change at events alone do so a little
 * before, so that an event found on the near side of its limit counts. */
#define EARLY 0.5e-9

static double early(const kr16_instance *instance)
{
    return instance->model_exchange || instance->event_mode ? EARLY : 0.0;
}

void kr16_margins(const double *value, const double *x, const double *tau, double *margin)
{
    for (int i = 0; i < 6; i++, margin++) {
        /* A flag that is up comes down on the other side of where it went up. */
        const double outside = KR16_OUTSIDE - (value[SLOT_LIMIT_POSITION + i] ? 2.0 * EARLY : 0.0);
        const double fast = value[SLOT_LIMIT_SPEED + i] ? 1.0 - 2.0 * EARLY : 1.0;
        const double loaded = value[SLOT_LIMIT_TORQUE + i] ? 1.0 - 2.0 * EARLY : 1.0;
        const double speed = kr16_robot.speed[i], torque = kr16_robot.torque[i];
        margin[0] = x[i] - (kr16_robot.lower[i] - outside);
        margin[6] = kr16_robot.upper[i] + outside - x[i];
        margin[12] = isfinite(speed) ? fast * speed - fabs(x[6 + i]) : 1.0;
        margin[18] = isfinite(torque) ? loaded * torque - fabs(tau[i]) : 1.0;
    }
}

static void flags(int group, double before, const double *x, const double *tau, double *value)
{
    for (int i = 0; i < 6; i++) {
        const double slack = KR16_OUTSIDE - before, share = 1.0 - before;
        if (group == GROUP_LIMIT_POSITION)
            value[SLOT_LIMIT_POSITION + i] = !(kr16_robot.lower[i] - slack <= x[i] &&
                                               x[i] <= kr16_robot.upper[i] + slack);
        else if (group == GROUP_LIMIT_SPEED)
            value[SLOT_LIMIT_SPEED + i] = fabs(x[6 + i]) > share * kr16_robot.speed[i];
        else
            value[SLOT_LIMIT_TORQUE + i] = fabs(tau[i]) > share * kr16_robot.torque[i];
    }
}

/* One group of outputs into its slots. */
static int computed(kr16_core *core, int group, double before)
{
    kr16_plant *plant = &core->plant;
    double *value = core->value, tau[6], in[36];
    const double t = value[SLOT_TIME], *x = value + SLOT_Q, *cs = core->cs;
    int status = FINE;
    if (!(core->fresh & 1u) && group != GROUP_LIMIT_POSITION && group != GROUP_LIMIT_SPEED) {
        kr16_trig(x, core->cs);
        core->fresh |= 1u << GROUP_NONE;
    }
    if (group == GROUP_TAU_APPLIED || group == GROUP_TAU_WANTED || group == GROUP_LIMIT_TORQUE ||
        group == GROUP_MARGIN)
        status = kr16_asked(plant, t, x, cs, tau);
    if (status != FINE)
        return status;
    switch (group) {
    case GROUP_QDD:
        status = kr16_plant_rates_at(plant, t, x, cs, in);
        if (status == FINE)
            memcpy(value + SLOT_QDD, in + 6, 6 * sizeof *in);
        return status;
    case GROUP_TAU_APPLIED:
        kr16_applied(plant, x + 6, tau);
        memcpy(value + SLOT_TAU_APPLIED, tau, sizeof tau);
        break;
    case GROUP_TAU_WANTED:
        memcpy(value + SLOT_TAU_WANTED, tau, sizeof tau);
        break;
    case GROUP_POSE:
        kr16_pose(plant->p, cs, value + SLOT_POSE_X);
        break;
    case GROUP_ENERGY:
        kr16_mass_matrix(plant->p, cs, in);
        value[SLOT_ENERGY_KINETIC] = 0.0;
        for (int i = 0; i < 36; i++)
            value[SLOT_ENERGY_KINETIC] += 0.5 * x[6 + i / 6] * in[i] * x[6 + i % 6];
        kr16_potential(plant->p, cs, value + SLOT_ENERGY_POTENTIAL);
        break;
    case GROUP_MARGIN:
        kr16_margins(value, x, tau, value + SLOT_MARGIN_LOWER);
        break;
    default:
        flags(group, before, x, tau, value);
    }
    return FINE;
}

/* Whether what was computed are numbers; huge inputs and states give none. */
static int in_range(const double *value, int group)
{
    static const struct {
        uint8_t first, count;
    } places[] = {[GROUP_QDD] = {SLOT_QDD, 6},
                  [GROUP_TAU_APPLIED] = {SLOT_TAU_APPLIED, 6},
                  [GROUP_POSE] = {SLOT_POSE_X, 6},
                  [GROUP_ENERGY] = {SLOT_ENERGY_KINETIC, 2},
                  [GROUP_TAU_WANTED] = {SLOT_TAU_WANTED, 6},
                  [GROUP_MARGIN] = {SLOT_MARGIN_LOWER, 24}};
    double sum = 0.0;
    for (int i = 0; i < places[group].count; i++)
        sum += value[places[group].first + i] - value[places[group].first + i];
    return sum == 0.0;
}

int kr16_compute(kr16_instance *instance, int group)
{
    kr16_core *core = &instance->core;
    if (core->fresh >> group & 1u)
        return OK;
    if (kr16_ready(instance) != OK)
        return ERROR;
    const int status = computed(core, group, early(instance));
    if (status != FINE)
        return kr16_fail(instance,
                         "the orientation error has a pitch of %.4g deg, 90 deg is singular; start "
                         "nearer to the reference or move it more slowly",
                         core->plant.pitch * 57.29577951308232);
    if (!in_range(core->value, group))
        return kr16_fail(instance, "at %.6g s %s leaves the range of numbers; the inputs or the "
                                   "states are too large", core->value[SLOT_TIME], groups[group]);
    core->fresh |= 1u << group;
    return OK;
}

static int wrong_type(kr16_instance *instance, const char *call, int slot)
{
    return kr16_fail(instance, "%s: %s is of type %s", call, kr16_name_of(slot).text,
                     kinds[kr16_slots[slot].kind]);
}

int kr16_take(kr16_instance *instance, const char *call, const unsigned *references, size_t n,
              unsigned want, int type, void *values, size_t count)
{
    size_t used = 0;
    if (n && (!references || !values))
        return kr16_fail(instance, "%s: references or values are missing (NULL)", call);
    for (size_t k = 0; k < n; k++) {
        const kr16_entry *entry = find(instance, call, references[k]);
        if (!entry)
            return ERROR;
        const kr16_slot *slot = &kr16_slots[entry->slot];
        if (!(want >> slot->kind & 1u))
            return wrong_type(instance, call, entry->slot);
        if (slot->group && kr16_compute(instance, slot->group) != OK)
            return ERROR;
        if (entry->count > count - used)
            return kr16_fail(instance, "%s: room for %lu values is too little", call,
                             (unsigned long)count);
        for (int i = 0; i < entry->count; i++, used++) {
            const double value = instance->core.value[entry->slot + i];
            if (type == AS_DOUBLE)
                ((double *)values)[used] = value;
            else if (type == AS_INT)
                ((int *)values)[used] = (int)value;
            else
                ((bool *)values)[used] = value != 0.0;
        }
    }
    if (used != count)
        return kr16_fail(instance, "%s: room for %lu values; there are %lu", call,
                         (unsigned long)count, (unsigned long)used);
    return OK;
}

static double number(int type, const void *values, size_t place)
{
    if (type == AS_DOUBLE)
        return ((const double *)values)[place];
    if (type == AS_INT)
        return ((const int *)values)[place];
    return ((const bool *)values)[place];
}

/* Whether a variable may be set now. */
static int may_set(kr16_instance *instance, const char *call, const kr16_entry *entry,
                   unsigned want)
{
    const int phase = instance->core.phase, slot = entry->slot;
    const char *reason = NULL;
    if (!(want >> kr16_slots[slot].kind & 1u))
        return wrong_type(instance, call, slot);
    if (phase == TERMINATED || phase == FAILED)
        return kr16_fail(instance, "%s: %s cannot be set: the instance is %s; reset", call,
                         kr16_name_of(slot).text, kr16_phase(instance));
    if (entry->causality == INPUT)
        return OK;
    /* In model exchange some hosts set states by their references. */
    if (instance->model_exchange && (phase == EVENT || phase == CONTINUOUS_TIME) &&
        entry->slot >= SLOT_Q && entry->slot < SLOT_Q + STATES)
        return OK;
    if (entry->causality != PARAMETER)
        reason = "is no input and no parameter; it cannot be set";
    else if (entry->variability == FIXED && phase > INITIALIZING)
        reason = "is fixed; set it before the initialization ends, or reset";
    else if (phase == CONTINUOUS_TIME)
        reason = "can only be set at events";
    if (!reason)
        return OK;
    return kr16_fail(instance, "%s: %s %s", call, kr16_name_of(slot).text, reason);
}

static int makes_sense(kr16_instance *instance, const char *call, const kr16_entry *entry,
                       double value)
{
    const kr16_slot *slot = &kr16_slots[entry->slot];
    const kr16_range *range = &kr16_ranges[slot->range];
    if (slot->kind == BOOLEAN)
        return OK;
    if (!isfinite(value))
        return kr16_fail(instance, "%s: %s = %g: must be a finite number", call,
                         kr16_name_of(entry->slot).text, value);
    if (!(range->low <= value && value <= range->high))
        return kr16_fail(instance, "%s: %s = %g %s: must be %g to %g", call,
                         kr16_name_of(entry->slot).text, value, range->unit, range->low,
                         range->high);
    return OK;
}

static void store(kr16_core *core, const kr16_entry *entry, size_t k, double value)
{
    const int place = entry->slot + (int)k;
    core->value[place] = kr16_slots[place].kind == BOOLEAN ? value != 0.0 : value;
    if (entry->causality == PARAMETER)
        core->ready = 0;
    core->current = 0;
    /* Until the initialization ends, the state is that of the start. */
    if (place >= SLOT_Q_START && place < SLOT_Q_START + STATES && kr16_robot.part == ROBOT)
        core->value[SLOT_Q + place - SLOT_Q_START] = value;
}

int kr16_put(kr16_instance *instance, const char *call, const unsigned *references, size_t n,
             unsigned want, int type, const void *values, size_t count)
{
    size_t used = 0;
    if (n && (!references || (count && !values)))
        return kr16_fail(instance, "%s: references or values are missing (NULL)", call);
    for (size_t k = 0; k < n; k++) {
        const kr16_entry *entry = find(instance, call, references[k]);
        if (!entry || may_set(instance, call, entry, want) != OK)
            return ERROR;
        if (entry->count > count - used)
            return kr16_fail(instance, "%s: %lu values are too few", call, (unsigned long)count);
        for (size_t i = 0; i < entry->count; i++, used++)
            if (makes_sense(instance, call, entry, number(type, values, used)) != OK)
                return ERROR;
    }
    if (used != count)
        return kr16_fail(instance, "%s: %lu values for variables that hold %lu", call,
                         (unsigned long)count, (unsigned long)used);
    used = 0;
    for (size_t k = 0; k < n; k++) {
        const kr16_entry *entry = &kr16_robot.entry[references[k] - 1u];
        for (size_t i = 0; i < entry->count; i++, used++)
            store(&instance->core, entry, i, number(type, values, used));
    }
    kr16_stale(instance);
    return OK;
}

int kr16_input_rises(kr16_instance *instance, const unsigned *references, size_t n,
                     const int *orders, const double *values)
{
    const char *call = "setRealInputDerivatives";
    if (n && (!references || !orders || !values))
        return kr16_fail(instance, "%s: an argument is missing (NULL)", call);
    for (size_t k = 0; k < n; k++) {
        const kr16_entry *entry = find(instance, call, references[k]);
        if (!entry || may_set(instance, call, entry, WANT_REAL) != OK)
            return ERROR;
        if (entry->causality != INPUT)
            return kr16_fail(instance, "%s: %s is no input", call, kr16_name_of(entry->slot).text);
        if (orders[k] != 1)
            return kr16_fail(instance, "%s: order %d of %s; only the first is used", call,
                             orders[k], kr16_name_of(entry->slot).text);
        if (!isfinite(values[k]))
            return kr16_fail(instance, "%s: derivative %g of %s; it must be finite", call,
                             values[k], kr16_name_of(entry->slot).text);
    }
    for (size_t k = 0; k < n; k++) {
        const int slot = kr16_robot.entry[references[k] - 1u].slot;
        if (slot < INPUTS) /* what a controller measures acts at communication points alone */
            instance->core.rise[slot] = values[k];
    }
    instance->core.current = 0;
    return OK;
}
