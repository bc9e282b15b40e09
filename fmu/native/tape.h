#ifndef KR16_TAPE_H
#define KR16_TAPE_H

#include "kr16_model.h"

/* Results dy of a tape at x with parameters p, along the direction dx: exact. */
void kr16_along(const kr16_tape *tape, const double *p, const double *x, const double *dx,
                double *dy);

#endif
