#include "trig.h"

#include <math.h>

#include "kr16_fmu.h"
#include "kr16_math.h"

double kr16_sin(double angle)
{
    double sine, cosine;
    kr16_sincos(angle, &sine, &cosine);
    return sine;
}

double kr16_cos(double angle)
{
    double sine, cosine;
    kr16_sincos(angle, &sine, &cosine);
    return cosine;
}

double kr16_angle(double y, double x)
{
    return kr16_atan2(y, x);
}

/* Not a number for angles that are too far away. */
void kr16_trig(const double *angles, double *cs)
{
    for (int i = 0; i < 6; i++) {
        const double angle = fabs(angles[i]) <= KR16_FARTHEST ? angles[i] : NAN;
        kr16_sincos(angle, &cs[6 + i], &cs[i]);
    }
}
