/* The numbers of the robot, and the table of slots. */
#include <math.h>

#include "kr16_fmu.h"

const kr16_slot kr16_slots[SLOTS] = KR16_SLOT_ROWS;
const kr16_range kr16_ranges[] = KR16_RANGE_ROWS;

#include "kr16_robot_data.h"
