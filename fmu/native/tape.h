#ifndef KR16_TAPE_H
#define KR16_TAPE_H

#include "kr16_model.h"

/* Results y of a tape at x with parameters p, and how they change along the direction dx, dy:
 * exact. What is not wanted may be NULL. */
void kr16_along(const kr16_tape *tape, const double *p, const double *x, const double *dx,
                double *y, double *dy);

#endif
