/* Calls an FMU as a host in C does, many times in a row, so that a clock around it measures the
 * FMU alone. The functions are fmi2DoStep, fmi2SetContinuousStates and fmi2GetDerivatives,
 * fmi2Instantiate and fmi2FreeInstance; each call here returns how many failed. */
#include <stddef.h>

typedef int step_function(void *, double, double, int);
typedef int write_function(void *, const double *, size_t);
typedef int read_function(void *, double *, size_t);
typedef void *make_function(const char *, int, const char *, const char *, const void *, int, int);
typedef void free_function(void *);

__attribute__((visibility("default"))) long steps(step_function *step, void *c, double time,
                                                  double size, long count)
{
    long failed = 0;
    for (long k = 0; k < count; k++)
        failed += step(c, time + (double)k * size, size, 1) != 0;
    return failed;
}

/* Each right-hand side at another state. */
__attribute__((visibility("default"))) long rates(write_function *write, read_function *read,
                                                  void *c, double *x, long count)
{
    double dx[12];
    long failed = 0;
    for (long k = 0; k < count; k++) {
        x[0] += 1e-6;
        failed += write(c, x, 12) != 0;
        failed += read(c, dx, 12) != 0;
    }
    return failed;
}

__attribute__((visibility("default"))) long instances(make_function *make, free_function *release,
                                                      const char *token, long count)
{
    long failed = 0;
    for (long k = 0; k < count; k++) {
        void *c = make("timed", 1, token, "", NULL, 0, 0);
        failed += !c;
        if (c)
            release(c);
    }
    return failed;
}
