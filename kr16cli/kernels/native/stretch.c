/* Stretch: the arm's motion while its torques and the wrench on its flange stay as they are.
 *
 * One step at a time, for a simulation that looks at each: events, samples, a controller's turn.
 * The rates are those of kr16cli/simulate/plant.py without friction, stops and limits of speed.
 */
#include "module.h"

#include <math.h>

#include "ode.h"

enum { ANGLES = 6, MOTION = 12, STATES = 16 };
enum { WORK_TORQUE = 12, WORK_FRICTION, WORK_WRENCH, WORK_CONTACT };

typedef struct {
    PyObject_HEAD
    PyObject *dynamics, *jacobian, *pose; /* kernels */
    int fixed;                            /* RK4, else Dormand and Prince */
    int pushed, in_flange;
    double torque[6], wrench[6];
    kr16_dp54 s; /* RK4 keeps its time, state and interpolant here as well */
} Stretch;

/* tau += J^T w; not 0 where the state is beyond the kernels. */
static int add_wrench(const Stretch *m, const double *q, double *tau)
{
    double jacobian[36], pose[16], w[6];
    const double *inputs[] = {q};
    if (kr16_kernel_one(m->jacobian, inputs, jacobian) != 0)
        return -1;
    memcpy(w, m->wrench, sizeof w);
    if (m->in_flange) {
        if (kr16_kernel_one(m->pose, inputs, pose) != 0)
            return -1;
        for (int i = 0; i < 6; i++) {
            const double *row = pose + 4 * (i % 3), *v = m->wrench + i / 3 * 3;
            w[i] = row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
        }
    }
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++)
            tau[j] += w[i] * jacobian[6 * i + j];
    return 0;
}

static double power(const double *force, const double *speed)
{
    double sum = 0.0;
    for (int j = 0; j < 6; j++)
        sum += force[j] * speed[j];
    return sum;
}

/* NaN where the kernels have no answer: the solver then steps back. */
static int rates(void *context, double t, const double *x, double *dx)
{
    const Stretch *m = context;
    const double *qd = x + ANGLES;
    double total[6], extra[6] = {0.0};
    (void)t;
    memcpy(dx, qd, 6 * sizeof *dx);
    int bad = m->pushed ? add_wrench(m, x, extra) : 0;
    for (int j = 0; j < 6; j++)
        total[j] = m->torque[j] + extra[j];
    const double *inputs[] = {x, qd, total};
    if (!bad)
        bad = kr16_kernel_one(m->dynamics, inputs, dx + ANGLES);
    for (int i = 0; bad && i < MOTION; i++)
        dx[i] = NAN;
    dx[WORK_TORQUE] = power(m->torque, qd);
    dx[WORK_WRENCH] = power(extra, qd);
    dx[WORK_FRICTION] = dx[WORK_CONTACT] = 0.0;
    return 0;
}

/* A classical step to `end`, and the cubic through states and rates at its ends. */
static void fixed_step(Stretch *m, double end)
{
    kr16_dp54 *s = &m->s;
    const double h = end - s->t;
    double y[STATES], dy[STATES];
    memcpy(y, s->x, sizeof y);
    kr16_rk4_step(rates, m, STATES, s->t, h, y);
    rates(m, end, y, dy);
    s->evaluations += 4; /* the rate at a step's end is the next one's first */
    for (int i = 0; i < STATES; i++) {
        const double rise = y[i] - s->x[i], bend = h * s->dx[i] - rise;
        s->dense[0][i] = s->x[i];
        s->dense[1][i] = rise;
        s->dense[2][i] = bend;
        s->dense[3][i] = rise - h * dy[i] - bend;
        s->dense[4][i] = 0.0;
    }
    memcpy(s->x, y, sizeof y);
    memcpy(s->dx, dy, sizeof dy);
    s->t_old = s->t;
    s->t = end;
}

/* A buffer of `count` numbers (any number of them if below 0), or NULL with an exception. */
static double *numbers(PyObject *object, Py_buffer *view, Py_ssize_t count, int writable)
{
    if (PyObject_GetBuffer(object, view, PyBUF_C_CONTIGUOUS | (writable ? PyBUF_WRITABLE : 0)) < 0)
        return NULL;
    if (view->itemsize == sizeof(double) && (count < 0 || view->len == count * view->itemsize))
        return view->buf;
    PyErr_Format(PyExc_ValueError, "expected %zd numbers of 8 bytes", count);
    PyBuffer_Release(view);
    return NULL;
}

static int copied(PyObject *object, Py_ssize_t count, double *to)
{
    Py_buffer view;
    const double *from = numbers(object, &view, count, 0);
    if (from == NULL)
        return -1;
    memcpy(to, from, (size_t)count * sizeof *to);
    PyBuffer_Release(&view);
    return 0;
}

static PyObject *stretch_new(PyTypeObject *type, PyObject *args, PyObject *kwargs)
{
    PyObject *dynamics, *jacobian, *pose, *atol;
    double rtol;
    int fixed;
    (void)kwargs;
    if (!PyArg_ParseTuple(args, "O!O!O!pdO", &KernelType, &dynamics, &KernelType, &jacobian,
                          &KernelType, &pose, &fixed, &rtol, &atol))
        return NULL;
    if (kr16_kernel_groups(dynamics) != 3 || kr16_kernel_groups(jacobian) != 1 ||
        kr16_kernel_groups(pose) != 1 || kr16_kernel_width(dynamics) != 6 ||
        kr16_kernel_width(jacobian) != 36 || kr16_kernel_width(pose) != 16) {
        PyErr_SetString(PyExc_ValueError, "expected kernels of dynamics, Jacobian and pose");
        return NULL;
    }
    Stretch *m = (Stretch *)type->tp_alloc(type, 0);
    if (m == NULL)
        return NULL;
    m->dynamics = Py_NewRef(dynamics);
    m->jacobian = Py_NewRef(jacobian);
    m->pose = Py_NewRef(pose);
    m->fixed = fixed;
    m->s.n = STATES;
    m->s.rtol = rtol;
    if (copied(atol, STATES, m->s.atol) < 0)
        Py_CLEAR(m);
    return (PyObject *)m;
}

static void stretch_dealloc(PyObject *self)
{
    Stretch *m = (Stretch *)self;
    Py_XDECREF(m->dynamics);
    Py_XDECREF(m->jacobian);
    Py_XDECREF(m->pose);
    Py_TYPE(self)->tp_free(self);
}

static PyObject *stretch_start(PyObject *self, PyObject *args)
{
    Stretch *m = (Stretch *)self;
    PyObject *state, *torque, *wrench;
    double t, x[STATES];
    if (!PyArg_ParseTuple(args, "dOOOp", &t, &state, &torque, &wrench, &m->in_flange) ||
        copied(state, STATES, x) < 0 || copied(torque, 6, m->torque) < 0 ||
        (wrench != Py_None && copied(wrench, 6, m->wrench) < 0))
        return NULL;
    m->pushed = wrench != Py_None;
    if (m->fixed) {
        m->s.t = m->s.t_old = t;
        memcpy(m->s.x, x, sizeof x);
        rates(m, t, x, m->s.dx);
        m->s.evaluations = 1;
    } else {
        kr16_dp54_start(&m->s, rates, m, t, x);
    }
    Py_RETURN_NONE;
}

static PyObject *stretch_step(PyObject *self, PyObject *end)
{
    Stretch *m = (Stretch *)self;
    const double t = PyFloat_AsDouble(end);
    if (t == -1.0 && PyErr_Occurred())
        return NULL;
    if (m->fixed)
        fixed_step(m, t);
    else if (kr16_dp54_step(&m->s, rates, m, t) != KR16_ODE_FINE)
        Py_RETURN_FALSE;
    Py_RETURN_TRUE;
}

static PyObject *stretch_state(PyObject *self, PyObject *out)
{
    Py_buffer view;
    double *to = numbers(out, &view, STATES, 1);
    if (to == NULL)
        return NULL;
    memcpy(to, ((Stretch *)self)->s.x, STATES * sizeof *to);
    PyBuffer_Release(&view);
    Py_RETURN_NONE;
}

static PyObject *stretch_at(PyObject *self, PyObject *args)
{
    PyObject *times, *out;
    Py_buffer seen, made;
    if (!PyArg_ParseTuple(args, "OO", &times, &out))
        return NULL;
    const double *t = numbers(times, &seen, -1, 0);
    if (t == NULL)
        return NULL;
    const Py_ssize_t n = seen.len / (Py_ssize_t)sizeof *t;
    double *to = numbers(out, &made, STATES * n, 1), x[STATES];
    for (Py_ssize_t i = 0; to != NULL && i < n; i++) {
        kr16_dp54_at(&((Stretch *)self)->s, t[i], x);
        for (int j = 0; j < STATES; j++)
            to[j * n + i] = x[j];
    }
    PyBuffer_Release(&seen);
    if (to == NULL)
        return NULL;
    PyBuffer_Release(&made);
    Py_RETURN_NONE;
}

static PyObject *stretch_number(PyObject *self, void *which)
{
    const kr16_dp54 *s = &((Stretch *)self)->s;
    if (which == NULL)
        return PyLong_FromLongLong(s->evaluations);
    return PyFloat_FromDouble(*(const char *)which == 'o' ? s->t_old : s->t);
}

static PyGetSetDef attributes[] = {
    {"t", stretch_number, NULL, "Time, s.", "t"},
    {"t_old", stretch_number, NULL, "Time before the last step, s.", "o"},
    {"evaluations", stretch_number, NULL, "Of the rates, since the start.", NULL},
    {NULL, NULL, NULL, NULL, NULL},
};

static PyMethodDef methods[] = {
    {"start", stretch_start, METH_VARARGS,
     "start(t, state, torque, wrench or None, in flange axes): begin, with these to the end."},
    {"step", stretch_step, METH_O,
     "step(end): one step, which does not pass `end`; RK4's is as long. False: too small a step."},
    {"state", stretch_state, METH_O, "state(out): the 16 numbers of the state."},
    {"at", stretch_at, METH_VARARGS, "at(times, out): (16, n) states within the last step."},
    {NULL, NULL, 0, NULL},
};

static PyTypeObject StretchType = {
    PyVarObject_HEAD_INIT(NULL, 0).tp_name = "kr16cli.kernels._native.Stretch",
    .tp_doc = "Stretch(dynamics, jacobian, pose, fixed, rtol, atol): a motion under held torques.",
    .tp_basicsize = sizeof(Stretch),
    .tp_flags = Py_TPFLAGS_DEFAULT,
    .tp_new = stretch_new,
    .tp_dealloc = stretch_dealloc,
    .tp_methods = methods,
    .tp_getset = attributes,
};

int kr16_add_stretch_type(PyObject *module)
{
    if (PyType_Ready(&StretchType) < 0)
        return -1;
    return PyModule_AddObjectRef(module, "Stretch", (PyObject *)&StretchType);
}
