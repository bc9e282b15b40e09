/* Explicit Runge-Kutta solvers for small systems: plain C99, no allocation, no global state. */
#ifndef KR16_ODE_H
#define KR16_ODE_H

#define KR16_ODE_STATES 32

/* Writes dx/dt of x (n numbers) at t; 0, or a reason to give up that the solvers hand through. */
typedef int (*kr16_rates)(void *context, double t, const double *x, double *dx);

/* One classical step of order 4 from t to t + h, in place. */
int kr16_rk4_step(kr16_rates rates, void *context, int n, double t, double h, double *x);

/* Dormand and Prince 1980, order 5(4), with dense output of order 4. Copying the struct copies
 * the solver's whole state. */
typedef struct {
    int n;
    double rtol, atol[KR16_ODE_STATES];
    double h_max;                            /* longest step; 0 for none */
    double t, h;                             /* where it stands; the step to try next */
    double x[KR16_ODE_STATES], dx[KR16_ODE_STATES];
    double t_old;                            /* the last step went from t_old to t */
    double dense[5][KR16_ODE_STATES];        /* its interpolant */
    long long steps, rejected, evaluations;
} kr16_dp54;

enum { KR16_ODE_FINE = 0, KR16_ODE_TOO_SMALL = -1 };

/* Start or restart at (t, x): n, rtol, atol and h_max are set before. Chooses h, counts anew. */
int kr16_dp54_start(kr16_dp54 *s, kr16_rates rates, void *context, double t, const double *x);

/* One accepted step that does not pass t_end. KR16_ODE_TOO_SMALL: the step size vanished. */
int kr16_dp54_step(kr16_dp54 *s, kr16_rates rates, void *context, double t_end);

/* x at a time in [t_old, t]. */
void kr16_dp54_at(const kr16_dp54 *s, double t, double *x);

/* The method's parts, for solvers that step many systems at once: stages (the last row is the
 * solution), the difference to the embedded solution, the dense output's last term. */
extern const double kr16_dp54_stage[7][6], kr16_dp54_defect[7], kr16_dp54_curve[7];

/* Step to probe the system with, from the weighted sizes of x and dx; the first step, from the
 * probe and the greater of the weighted sizes of dx and of its rate; the next step over the last
 * one, from the weighted error. */
double kr16_dp54_probe(double size, double slope);
double kr16_dp54_first(double probe, double steepest);
double kr16_dp54_factor(double error);

#endif
