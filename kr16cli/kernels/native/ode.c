#include "ode.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define STATES KR16_ODE_STATES
#define SAFETY 0.9
#define SHRINK 0.2 /* limits of the change of the step size */
#define GROW 10.0

int kr16_rk4_step(kr16_rates rates, void *context, int n, double t, double h, double *x)
{
    double k1[STATES], k2[STATES], k3[STATES], k4[STATES], at[STATES];
    int status;
    if ((status = rates(context, t, x, k1)) != 0)
        return status;
    for (int i = 0; i < n; i++)
        at[i] = x[i] + 0.5 * h * k1[i];
    if ((status = rates(context, t + 0.5 * h, at, k2)) != 0)
        return status;
    for (int i = 0; i < n; i++)
        at[i] = x[i] + 0.5 * h * k2[i];
    if ((status = rates(context, t + 0.5 * h, at, k3)) != 0)
        return status;
    for (int i = 0; i < n; i++)
        at[i] = x[i] + h * k3[i];
    if ((status = rates(context, t + h, at, k4)) != 0)
        return status;
    for (int i = 0; i < n; i++)
        x[i] += h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
    return KR16_ODE_FINE;
}

/* Root mean square of v over the tolerated error of each state. */
static double weighted(const kr16_dp54 *s, const double *v, const double *x, const double *y)
{
    double sum = 0.0;
    for (int i = 0; i < s->n; i++) {
        const double scale = s->atol[i] + s->rtol * fmax(fabs(x[i]), fabs(y[i]));
        const double part = v[i] / fmax(scale, DBL_MIN);
        sum += part * part;
    }
    return sqrt(sum / s->n);
}

/* Hairer, Norsett, Wanner 1993, section II.4, for both. */
double kr16_dp54_probe(double size, double slope)
{
    return size < 1e-5 || slope < 1e-5 ? 1e-6 : 0.01 * size / slope;
}

double kr16_dp54_first(double probe, double steepest)
{
    const double h = steepest <= 1e-15 ? fmax(1e-6, 1e-3 * probe) : pow(0.01 / steepest, 0.2);
    return h > 0.0 ? fmin(h, 100.0 * probe) : probe; /* the probe may have overflowed */
}

double kr16_dp54_factor(double error)
{
    if (!(error <= DBL_MAX)) /* the step left the numbers: as far back as allowed */
        return SHRINK;
    return error > 0.0 ? fmin(GROW, fmax(SHRINK, SAFETY * pow(error, -0.2))) : GROW;
}

static int first_step(kr16_dp54 *s, kr16_rates rates, void *context)
{
    double at[STATES], f[STATES], bend[STATES];
    const double size = weighted(s, s->x, s->x, s->x), slope = weighted(s, s->dx, s->x, s->x);
    double h = kr16_dp54_probe(size, slope);
    if (s->h_max > 0.0)
        h = fmin(h, s->h_max);
    for (int i = 0; i < s->n; i++)
        at[i] = s->x[i] + h * s->dx[i];
    s->evaluations++;
    const int status = rates(context, s->t + h, at, f);
    if (status != 0)
        return status;
    for (int i = 0; i < s->n; i++)
        bend[i] = (f[i] - s->dx[i]) / h;
    s->h = kr16_dp54_first(h, fmax(slope, weighted(s, bend, s->x, s->x)));
    return KR16_ODE_FINE;
}

int kr16_dp54_start(kr16_dp54 *s, kr16_rates rates, void *context, double t, const double *x)
{
    const size_t bytes = (size_t)s->n * sizeof *x;
    s->t = s->t_old = t;
    memmove(s->x, x, bytes);
    memset(s->dense, 0, sizeof s->dense);
    memcpy(s->dense[0], s->x, bytes);
    s->steps = s->rejected = 0;
    s->evaluations = 1;
    const int status = rates(context, t, s->x, s->dx);
    return status != 0 ? status : first_step(s, rates, context);
}

/* Dormand, Prince 1980: nodes, stages (the last row gives the solution), and the difference to
 * the embedded solution of order 4. */
static const double node[7] = {0.0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1.0, 1.0};
const double kr16_dp54_stage[7][6] = {
    {0.0},
    {1.0 / 5},
    {3.0 / 40, 9.0 / 40},
    {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0.0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84},
};
const double kr16_dp54_defect[7] = {71.0 / 57600,      0.0,        -71.0 / 16695, 71.0 / 1920,
                                    -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
/* Hairer, Norsett, Wanner 1993, section II.6: the term of order 4 of the dense output. */
const double kr16_dp54_curve[7] = {-12715105075.0 / 11282082432, 0.0,
                                87487479700.0 / 32700410799,  -10690763975.0 / 1880347072,
                                701980252875.0 / 199316789632, -1453857185.0 / 822651844,
                                69997945.0 / 29380423};

/* weights . slopes of one number, of `count` slopes. */
#define MIXED1(a, k, i) (a)[0] * k[0][i]
#define MIXED2(a, k, i) MIXED1(a, k, i) + (a)[1] * k[1][i]
#define MIXED3(a, k, i) MIXED2(a, k, i) + (a)[2] * k[2][i]
#define MIXED4(a, k, i) MIXED3(a, k, i) + (a)[3] * k[3][i]
#define MIXED5(a, k, i) MIXED4(a, k, i) + (a)[4] * k[4][i]
#define MIXED6(a, k, i) MIXED5(a, k, i) + (a)[5] * k[5][i]
#define MIXED7(a, k, i) MIXED6(a, k, i) + (a)[6] * k[6][i]

/* Slope j, at the state y that the ones before it lead to; the sums are written out, so that the
 * loop over states is vectorised. */
#define SLOPE(j)                                                                                   \
    for (int i = 0; i < n; i++)                                                                    \
        y[i] = s->x[i] + h * (MIXED##j(kr16_dp54_stage[j], k, i));                                 \
    s->evaluations++;                                                                              \
    if ((status = rates(context, s->t + node[j] * h, y, k[j])) != 0)                               \
        return status;

/* All slopes of a step of h: k[6] is the one at its end, y. */
static int slopes(kr16_dp54 *s, kr16_rates rates, void *context, double h, double k[7][STATES],
                  double *y)
{
    const int n = s->n;
    int status;
    memcpy(k[0], s->dx, (size_t)n * sizeof *y);
    SLOPE(1)
    SLOPE(2)
    SLOPE(3)
    SLOPE(4)
    SLOPE(5)
    SLOPE(6)
    return KR16_ODE_FINE;
}

static void combine(int n, const double *weights, double h, double k[7][STATES], double *sum)
{
    for (int i = 0; i < n; i++)
        sum[i] = h * (MIXED7(weights, k, i));
}

static void keep(kr16_dp54 *s, double t, double h, double k[7][STATES], const double *y)
{
    for (int i = 0; i < s->n; i++) {
        const double rise = y[i] - s->x[i], bend = h * k[0][i] - rise;
        s->dense[0][i] = s->x[i];
        s->dense[1][i] = rise;
        s->dense[2][i] = bend;
        s->dense[3][i] = rise - h * k[6][i] - bend;
        s->x[i] = y[i];
        s->dx[i] = k[6][i];
    }
    combine(s->n, kr16_dp54_curve, h, k, s->dense[4]);
    s->t_old = s->t;
    s->t = t;
    s->steps++;
}

int kr16_dp54_step(kr16_dp54 *s, kr16_rates rates, void *context, double t_end)
{
    double k[7][STATES], y[STATES], error[STATES];
    int refused = 0;
    if (!(t_end > s->t))
        return KR16_ODE_FINE;
    for (;;) {
        if (s->h_max > 0.0)
            s->h = fmin(s->h, s->h_max);
        const int last = s->t + 1.01 * s->h >= t_end; /* no tiny last step */
        const double h = last ? t_end - s->t : s->h;
        if (!last && !(h > 10.0 * DBL_EPSILON * fabs(s->t)))
            return KR16_ODE_TOO_SMALL;
        const int status = slopes(s, rates, context, h, k, y);
        if (status != 0)
            return status;
        combine(s->n, kr16_dp54_defect, h, k, error);
        const double norm = weighted(s, error, s->x, y);
        const double factor = kr16_dp54_factor(norm);
        if (norm <= 1.0) {
            const double next = h * (refused ? fmin(1.0, factor) : factor);
            /* a step cut short by t_end says nothing against the size it was cut from */
            s->h = last && !refused ? fmax(s->h, next) : next;
            keep(s, last ? t_end : s->t + h, h, k, y);
            return KR16_ODE_FINE;
        }
        refused = 1;
        s->rejected++;
        s->h = h * factor;
        if (!(s->h > 0.0))
            return KR16_ODE_TOO_SMALL;
    }
}

void kr16_dp54_at(const kr16_dp54 *s, double t, double *x)
{
    const double h = s->t - s->t_old;
    const double u = h > 0.0 ? (t - s->t_old) / h : 0.0, v = 1.0 - u;
    for (int i = 0; i < s->n; i++)
        x[i] = s->dense[0][i] +
               u * (s->dense[1][i] +
                    v * (s->dense[2][i] + u * (s->dense[3][i] + v * s->dense[4][i])));
}
