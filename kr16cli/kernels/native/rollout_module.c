/* kr16cli.kernels._native.rollout: buffers in, solvers in threads without the GIL. */
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <string.h>

#ifndef _WIN32
#include <pthread.h>
#endif

#include "batch.h"
#include "module.h"
#include "rollout.h"

#define MAX_THREADS 64
#define BLOCK 8 /* numbers of an aligned block */

static kr16_function found(const kr16_kernel *kernels, const char *name)
{
    for (; kernels->name != NULL; kernels++)
        if (strcmp(kernels->name, name) == 0)
            return kernels->run;
    PyErr_Format(PyExc_ValueError, "no kernel %s", name);
    return NULL;
}

static int find_kernels(const kr16_kernel *kernels, const char *dynamics, kr16_plant_kernels *k)
{
    k->dynamics = found(kernels, dynamics);
    k->jacobian = found(kernels, "jacobian");
    k->pose = found(kernels, "fk");
    return k->dynamics != NULL && k->jacobian != NULL && k->pose != NULL;
}

typedef struct {
    const kr16_rollout *r;
    ptrdiff_t lo, hi;
    double *room;
#ifndef _WIN32
    pthread_t thread;
#endif
} share;

static void *run_share(void *pointer)
{
    const share *s = pointer;
    kr16_rollout_run(s->r, s->lo, s->hi, s->room);
    return NULL;
}

static void run_shares(share *shares, int threads)
{
    int started = 0;
#ifndef _WIN32
    for (int i = 1; i < threads; i++) {
        if (pthread_create(&shares[i].thread, NULL, run_share, &shares[i]) != 0)
            break;
        started = i;
    }
#endif
    run_share(&shares[0]);
    for (int i = started + 1; i < threads; i++)
        run_share(&shares[i]);
#ifndef _WIN32
    for (int i = 1; i <= started; i++)
        pthread_join(shares[i].thread, NULL);
#endif
}

/* 0, or -1 with an exception. */
static int run(const kr16_rollout *r, long threads)
{
    share shares[MAX_THREADS];
    const ptrdiff_t tiles = (r->n + KR16_LANES - 1) / KR16_LANES;
    if (threads > MAX_THREADS)
        threads = MAX_THREADS;
    if (threads > tiles)
        threads = (long)tiles;
    const size_t room = ((size_t)kr16_rollout_room(r) + BLOCK - 1) / BLOCK * BLOCK;
    double *rooms = PyMem_RawCalloc(room * (size_t)threads + BLOCK, sizeof(double));
    if (rooms == NULL) {
        PyErr_NoMemory();
        return -1;
    }
    double *aligned = rooms + BLOCK - (uintptr_t)rooms / sizeof(double) % BLOCK;
    for (long i = 0; i < threads; i++) {
        const ptrdiff_t lo = tiles * i / threads * KR16_LANES;
        const ptrdiff_t hi = tiles * (i + 1) / threads * KR16_LANES;
        shares[i].r = r;
        shares[i].lo = lo;
        shares[i].hi = hi < r->n ? hi : r->n;
        shares[i].room = aligned + room * (size_t)i;
    }
    Py_BEGIN_ALLOW_THREADS
    run_shares(shares, (int)threads);
    Py_END_ALLOW_THREADS
    PyMem_RawFree(rooms);
    return 0;
}

enum { PARAMETERS, STATE, TORQUE, WRENCH, TIMES, OUT, REACHED, TALLY, ARRAYS };

static const char *const array_names[ARRAYS] = {"parameters", "state", "torque", "wrench",
                                                "times",      "out",   "reached", "tally"};

static int get_arrays(PyObject *const *objects, Py_buffer *views)
{
    for (int i = 0; i < ARRAYS; i++) {
        const int flags = PyBUF_C_CONTIGUOUS | (i >= OUT ? PyBUF_WRITABLE : 0);
        if (i == WRENCH && objects[i] == Py_None)
            continue;
        if (PyObject_GetBuffer(objects[i], &views[i], flags) < 0)
            return -1;
        if (views[i].itemsize != 8) {
            PyErr_Format(PyExc_TypeError, "%s: expected numbers of 8 bytes", array_names[i]);
            return -1;
        }
    }
    return 0;
}

/* The count of an array's numbers if it holds one group of `one` or n groups, else -1. */
static ptrdiff_t groups_of(const Py_buffer *views, int which, ptrdiff_t one, ptrdiff_t n)
{
    const ptrdiff_t count = views[which].len / 8;
    if (count == one || count == one * n)
        return count;
    PyErr_Format(PyExc_ValueError, "%s has %zd numbers; expected %zd or %zd", array_names[which],
                 count, one, one * n);
    return -1;
}

/* What the arrays say of a rollout; 0, or -1 with an exception. */
static int describe(const Py_buffer *views, kr16_rollout *r)
{
    r->n = views[STATE].len / 8 / KR16_STATES;
    r->count = views[TIMES].len / 8;
    const ptrdiff_t parameters = groups_of(views, PARAMETERS, kr16_parameter_count, r->n);
    const ptrdiff_t torque = groups_of(views, TORQUE, 6 * r->samples, r->n);
    const ptrdiff_t wrench = views[WRENCH].obj == NULL ? 0 : groups_of(views, WRENCH, 6, r->n);
    if (parameters < 0 || torque < 0 || wrench < 0)
        return -1;
    if (views[OUT].len / 8 != r->n * r->count * KR16_STATES || views[REACHED].len / 8 != r->n ||
        views[TALLY].len / 8 != 3 * r->n) {
        PyErr_SetString(PyExc_ValueError, "out, reached or tally has the wrong size");
        return -1;
    }
    r->parameters = views[PARAMETERS].buf;
    r->own = parameters != kr16_parameter_count;
    r->state = views[STATE].buf;
    r->torque = views[TORQUE].buf;
    r->torque_row = torque == 6 * r->samples ? 0 : 6 * r->samples;
    r->wrench = views[WRENCH].obj == NULL ? NULL : views[WRENCH].buf;
    r->wrench_row = wrench == 6 ? 0 : 6;
    r->times = views[TIMES].buf;
    r->out = views[OUT].buf;
    r->reached = views[REACHED].buf;
    r->tally = views[TALLY].buf;
    return 0;
}

static PyObject *native_rollout(PyObject *self, PyObject *args)
{
    kr16_rollout r = {0};
    Py_buffer views[ARRAYS] = {{0}};
    PyObject *objects[ARRAYS], *result = NULL;
    const char *dynamics, *own_dynamics;
    int method, in_flange;
    Py_ssize_t samples;
    long threads;
    (void)self;
    if (!PyArg_ParseTuple(args, "iss(OOOOO)(OOO)pn(ddddd)Ll", &method, &dynamics, &own_dynamics,
                          &objects[PARAMETERS], &objects[STATE], &objects[TORQUE],
                          &objects[WRENCH], &objects[TIMES], &objects[OUT], &objects[REACHED],
                          &objects[TALLY], &in_flange, &samples, &r.hold, &r.duration, &r.step,
                          &r.rtol, &r.atol, &r.max_steps, &threads))
        return NULL;
    r.method = method == KR16_RK4 ? KR16_RK4 : KR16_DP54;
    r.in_flange = in_flange;
    r.samples = samples;
    if (get_arrays(objects, views) == 0 && describe(views, &r) == 0 &&
        find_kernels(kr16_single_kernels, dynamics, &r.one) &&
        find_kernels(r.own ? kr16_own_kernels : kr16_batch_kernels,
                     r.own ? own_dynamics : dynamics, &r.tile) &&
        (r.n == 0 || run(&r, threads < 1 ? 1 : threads) == 0))
        result = Py_NewRef(Py_None);
    for (int i = 0; i < ARRAYS; i++)
        if (views[i].obj != NULL)
            PyBuffer_Release(&views[i]);
    return result;
}

static PyMethodDef methods[] = {
    {"rollout", native_rollout, METH_VARARGS,
     "rollout(method, kernel, own kernel, (parameters, state, torque, wrench or None, times), "
     "(out, reached, tally), wrench in flange axes, samples, (hold, duration, step, rtol, atol), "
     "max_steps, threads): fill three arrays; see rollout.h."},
    {NULL, NULL, 0, NULL},
};

int kr16_add_rollout(PyObject *m)
{
    return PyModule_AddFunctions(m, methods);
}
