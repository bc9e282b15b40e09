/* Sine, cosine and arctangent without branches, so that loops over lanes vectorise.
 *
 * kr16_sincos: |x| <= KR16_TRIG_LIMIT, below 2 ulp of 1; beyond, call the C library instead.
 * kr16_atan2: below 4 ulp where the larger of |x|, |y| is 0 or 1e-300 to 8e307 (a step of scaling
 * for the rest would cost a tenth); zeros, infinities and NaN as the C library, but for -0 as x.
 */
#ifndef KR16_MATH_H
#define KR16_MATH_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define KR16_TRIG_LIMIT 1.0e5

static inline double kr16_flip(double v, uint64_t sign)
{
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    bits ^= sign;
    memcpy(&v, &bits, sizeof bits);
    return v;
}

/* The parts of kr16_sincos, for a number or a vector of them. Quarter turns to the nearest, by
 * adding 1.5 * 2^52; pi/2 in three parts of 33 bits (Cody and Waite), whose products with the
 * count are exact. */
#define KR16_SHIFT 6755399441055744.0
#define KR16_SHIFTED(x) ((x) * 6.36619772367581382433e-01 + KR16_SHIFT)
#define KR16_REDUCED(x, turns)                                                                     \
    ((((x) - (turns) * 1.57079632673412561417e+00) - (turns) * 6.07710050630396597660e-11) -       \
     (turns) * 2.02226624879595063154e-21)
#define KR16_SINE(r, z)                                                                            \
    ((r) + (r) * (z) *                                                                             \
        (-1.66666666666666324348e-01 + (z) * (8.33333333332248946124e-03 +                         \
        (z) * (-1.98412698298579493134e-04 + (z) * (2.75573137070700676789e-06 +                   \
        (z) * (-2.50507602534068634195e-08 + (z) * 1.58969099521155010221e-10))))))
#define KR16_COSINE(z)                                                                             \
    (1.0 + (z) * (-0.5 + (z) *                                                                     \
        (4.16666666666666019037e-02 + (z) * (-1.38888888888741095749e-03 +                         \
        (z) * (2.48015872894767294178e-05 + (z) * (-2.75573143513906633035e-07 +                   \
        (z) * (2.08757232129817482790e-09 + (z) * -1.13596475577881948265e-11)))))))

static inline void kr16_sincos(double x, double *sine, double *cosine)
{
    const double shifted = KR16_SHIFTED(x);
    const double turns = shifted - KR16_SHIFT;
    const double r = KR16_REDUCED(x, turns);
    const double z = r * r;
    const double s = KR16_SINE(r, z), c = KR16_COSINE(z);
    uint64_t k;
    memcpy(&k, &shifted, sizeof k);
    /* An odd quarter turn swaps the two; the second bit, of k and of k + 1, is the sign. */
    const uint64_t odd = k & 1;
    *sine = kr16_flip(odd ? c : s, (k & 2) << 62);
    *cosine = kr16_flip(odd ? s : c, ((k + 1) & 2) << 62);
}

static inline double kr16_atan2(double y, double x)
{
    const double ax = fabs(x), ay = fabs(y);
    const double low = ay > ax ? ax : ay, high = ay > ax ? ay : ax;
    /* Above 22.5 deg turn by 45 deg; >= takes two infinities in, as equals. */
    const int wide = (low >= high * 0.41421356237309503) & (high > 0.0);
    const double turned = low == high ? 0.0 : low - high;
    /* Arithmetic, not a second choice on `wide`, lest a compiler makes two divisions. */
    const double over = high + (high == 0.0 ? 1.0 : 0.0);
    const double t = (wide ? turned : low) / (over + (wide ? 1.0 : 0.0) * low);
    const double z = t * t;
    /* (atan(t)/t - 1)/z on [0, tan(pi/8)^2], Chebyshev, error 3e-17. */
    const double tail = -0.3333333333333333 + z * (0.1999999999999552 + z *
        (-0.14285714284666542 + z * (0.11111111015256361 + z * (-0.09090904578123903 + z *
        (0.07692183190826087 + z * (-0.06664511447381948 + z * (0.0585814891280221 + z *
        (-0.0508544973794026 + z * (0.03923165829558719 + z * -0.01917688711906226)))))))));
    double a = t + t * z * tail;
    a = wide ? 7.85398163397448278999e-01 + (a + 3.06161699786838240165e-17) : a;
    a = ay > ax ? 1.57079632679489655800e+00 - (a - 6.12323399573676603587e-17) : a;
    a = x < 0.0 ? 3.14159265358979311600e+00 - (a - 1.22464679914735317723e-16) : a;
    return copysign(a, y);
}

/* Several at once: a count that the compiler knows becomes vectors. */
static inline __attribute__((always_inline, unused)) void
kr16_atan2_all(int count, const double *y, const double *x, double *angle)
{
#pragma omp simd
    for (int i = 0; i < count; i++)
        angle[i] = kr16_atan2(y[i], x[i]);
}

#endif
