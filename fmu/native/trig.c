#include "trig.h"

#include <math.h>
#include <string.h>

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

#ifdef __GNUC__
typedef double two __attribute__((vector_size(16)));
typedef int64_t two_whole __attribute__((vector_size(16)));

/* kr16_sincos of two angles at once: the same operations, so the same bits. */
static inline void sincos_of_two(const double *angles, double *sines, double *cosines)
{
    two x;
    memcpy(&x, angles, sizeof x);
    const two shifted = KR16_SHIFTED(x);
    const two turns = shifted - KR16_SHIFT;
    const two r = KR16_REDUCED(x, turns);
    const two z = r * r;
    const two s = KR16_SINE(r, z), c = KR16_COSINE(z);
    const two_whole k = (two_whole)shifted, odd = -(k & 1);
    const two_whole changed = ((two_whole)s ^ (two_whole)c) & odd;
    const two_whole sine = ((two_whole)s ^ changed) ^ (k & 2) << 62;
    const two_whole cosine = ((two_whole)c ^ changed) ^ ((k + 1) & 2) << 62;
    memcpy(sines, &sine, sizeof sine);
    memcpy(cosines, &cosine, sizeof cosine);
}
#else
static void sincos_of_two(const double *angles, double *sines, double *cosines)
{
    for (int i = 0; i < 2; i++)
        kr16_sincos(angles[i], &sines[i], &cosines[i]);
}
#endif

/* Not a number for angles that are too far away. */
void kr16_trig(const double *angles, double *cs)
{
    for (int i = 0; i < 6; i += 2)
        sincos_of_two(angles + i, cs + 6 + i, cs + i);
    for (int i = 0; i < 6; i++)
        if (!(fabs(angles[i]) <= KR16_FARTHEST))
            cs[i] = cs[6 + i] = NAN;
}
