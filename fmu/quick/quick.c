/* The written-out functions as a Python module: name(p, list, ...) -> list, all of floats.
 *
 * Of Python's stable ABI, so that one library serves Python 3.11 and every later one. The
 * functions themselves are written by kr16cli from its model.
 */
#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include <math.h>

#include "functions.h"

#define MOST_NUMBERS 64 /* of all groups together, angles counted twice */
#define MOST_RESULTS 64

typedef void (*Function)(const double *p, const double *x, double *y);
typedef struct {
    int angles; /* six angles enter as their cosines, then their sines */
    int count;
} Group;

/* Copies `count` floats of a list or tuple; 0 with an exception if that is not what it holds. */
static int copied(PyObject *from, Py_ssize_t count, double *to) {
    const int list = PyList_Check(from);
    if (!list && !PyTuple_Check(from)) {
        PyErr_SetString(PyExc_TypeError, "expected a list or tuple of floats");
        return 0;
    }
    const Py_ssize_t size = list ? PyList_Size(from) : PyTuple_Size(from);
    if (size != count) {
        PyErr_Format(PyExc_ValueError, "expected %zd numbers, not %zd", count, size);
        return 0;
    }
    for (Py_ssize_t i = 0; i < count; i++) {
        PyObject *item = list ? PyList_GetItem(from, i) : PyTuple_GetItem(from, i);
        to[i] = PyFloat_AsDouble(item);
        if (to[i] == -1.0 && PyErr_Occurred()) return 0;
    }
    return 1;
}

static PyObject *answered(Function run, int results, int groups, const Group *group,
                          PyObject *const *arguments, Py_ssize_t given) {
    double p[PARAMETERS], x[MOST_NUMBERS], y[MOST_RESULTS], *next = x;
    if (given != groups + 1)
        return PyErr_Format(PyExc_TypeError, "expected %d arguments, not %zd", groups + 1, given);
    if (!copied(arguments[0], PARAMETERS, p)) return NULL;
    for (int g = 0; g < groups; g++) {
        if (!group[g].angles) {
            if (!copied(arguments[g + 1], group[g].count, next)) return NULL;
            next += group[g].count;
            continue;
        }
        double angles[6];
        if (!copied(arguments[g + 1], 6, angles)) return NULL;
        for (int i = 0; i < 6; i++) {
            next[i] = cos(angles[i]);
            next[6 + i] = sin(angles[i]);
        }
        next += 12;
    }
    run(p, x, y);
    PyObject *list = PyList_New(results);
    for (int i = 0; list && i < results; i++) {
        PyObject *value = PyFloat_FromDouble(y[i]);
        if (!value || PyList_SetItem(list, i, value) < 0) Py_CLEAR(list);
    }
    return list;
}

#define ENTRY(name, results, groups, ...)                                                          \
    static PyObject *py_##name(PyObject *module, PyObject *const *arguments, Py_ssize_t given) {   \
        static const Group group[] = {__VA_ARGS__};                                                \
        (void)module;                                                                              \
        return answered(name, results, groups, group, arguments, given);                           \
    }
ENTRIES
#undef ENTRY

#define ENTRY(name, results, groups, ...)                                                          \
    {#name, (PyCFunction)(void (*)(void))py_##name, METH_FASTCALL, NULL},
static PyMethodDef methods[] = {ENTRIES{NULL, NULL, 0, NULL}};

static struct PyModuleDef definition = {
    PyModuleDef_HEAD_INIT, "quick", NULL, 0, methods, NULL, NULL, NULL, NULL,
};

PyMODINIT_FUNC PyInit_quick(void) { return PyModuleDef_Init(&definition); }
