/* The numbers of the robot, and the table of slots. */
#include <math.h>
#include <stdio.h>

#include "kr16_fmu.h"

const kr16_slot kr16_slots[SLOTS] = KR16_SLOT_ROWS;
const kr16_range kr16_ranges[] = KR16_RANGE_ROWS;

static const char stems[][KR16_STEM] = KR16_STEM_ROWS;

kr16_name kr16_name_of(int slot)
{
    const int stem = kr16_slots[slot].stem;
    int first = slot;
    kr16_name name;
    while (first > 0 && kr16_slots[first - 1].stem == stem)
        first--;
    const int alone = first == slot && (slot + 1 == SLOTS || kr16_slots[slot + 1].stem != stem);
    snprintf(name.text, sizeof name.text, alone ? "%s" : "%s[%d]", stems[stem], slot - first + 1);
    return name;
}

#include "kr16_robot_data.h"
