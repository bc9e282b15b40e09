/* The extension kr16cli.kernels._native: the bare C API, for the lowest cost per call.
 *
 * Kernel(name, parameters, shape)(*inputs, out, threads) answers only what needs no care:
 * float64, contiguous, finite, equal leading axes. For anything else it returns None, and the
 * caller's slower path, which knows the names of the arguments, checks, copies and complains.
 */
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <structmember.h>

#define NPY_NO_DEPRECATED_API NPY_1_22_API_VERSION
#include <numpy/arrayobject.h>

#include "batch.h"
#include "machine.h"
#include "module.h"

#define MAX_RANK 3
#define GIL_THRESHOLD 64 /* smaller batches are over before another thread could run */

typedef struct {
    PyObject_HEAD
    vectorcallfunc call;
    int kernel;
    int groups;
    int rank[3]; /* trailing axes of each input */
    npy_intp count[3];
    int trig[3]; /* angles: None stands for zeros, but for the first input */
    int out_rank;
    npy_intp out_shape[MAX_RANK];
    double *parameters;
} Kernel;

/* The array's data and leading size if it can be used as it is, else NULL. */
static double *usable(PyObject *object, int rank, npy_intp count, PyArrayObject **array)
{
    if (!PyArray_CheckExact(object))
        return NULL;
    PyArrayObject *a = (PyArrayObject *)object;
    if (PyArray_TYPE(a) != NPY_DOUBLE || !PyArray_ISCARRAY_RO(a) || PyArray_NDIM(a) < rank)
        return NULL;
    npy_intp size = 1;
    for (int i = PyArray_NDIM(a) - rank; i < PyArray_NDIM(a); i++)
        size *= PyArray_DIM(a, i);
    if (size != count || (rank == 2 && PyArray_DIM(a, PyArray_NDIM(a) - 1) != 4))
        return NULL;
    *array = a;
    return PyArray_DATA(a);
}

static int same_lead(PyArrayObject *a, int a_rank, PyArrayObject *b, int b_rank)
{
    const int lead = PyArray_NDIM(a) - a_rank;
    return PyArray_NDIM(b) - b_rank == lead &&
           memcmp(PyArray_DIMS(a), PyArray_DIMS(b), (size_t)lead * sizeof(npy_intp)) == 0;
}

PyObject *kr16_kernel_call(PyObject *self, PyObject *const *args, size_t flags, PyObject *names)
{
    Kernel *k = (Kernel *)self;
    const Py_ssize_t given = PyVectorcall_NARGS(flags);
    if (given != k->groups + 2 || names != NULL) {
        PyErr_Format(PyExc_TypeError, "expected %d inputs, out and threads", k->groups);
        return NULL;
    }
    const double *inputs[3];
    PyArrayObject *first = NULL, *array;
    for (int g = 0; g < k->groups; g++) {
        if (args[g] == Py_None && g > 0 && k->trig[g]) {
            inputs[g] = NULL;
            continue;
        }
        inputs[g] = usable(args[g], k->rank[g], k->count[g], &array);
        if (inputs[g] == NULL || (first != NULL && !same_lead(first, k->rank[0], array, k->rank[g])))
            Py_RETURN_NONE;
        if (first == NULL)
            first = array;
    }
    if (first == NULL)
        Py_RETURN_NONE;
    const int lead = PyArray_NDIM(first) - k->rank[0];
    npy_intp shape[NPY_MAXDIMS], n = 1;
    if (lead + k->out_rank > NPY_MAXDIMS)
        Py_RETURN_NONE;
    for (int i = 0; i < lead; i++)
        n *= shape[i] = PyArray_DIM(first, i);
    memcpy(shape + lead, k->out_shape, (size_t)k->out_rank * sizeof(npy_intp));

    PyObject *wanted = args[k->groups + 1];
    const long threads = PyLong_CheckExact(wanted) ? PyLong_AsLong(wanted) : 0;
    if (threads < 1) {
        PyErr_Clear();
        Py_RETURN_NONE;
    }
    PyObject *out = args[k->groups];
    if (out == Py_None) {
        out = PyArray_SimpleNew(lead + k->out_rank, shape, NPY_DOUBLE);
        if (out == NULL)
            return NULL;
    } else {
        if (!PyArray_CheckExact(out))
            Py_RETURN_NONE;
        PyArrayObject *o = (PyArrayObject *)out;
        if (PyArray_TYPE(o) != NPY_DOUBLE || !PyArray_ISCARRAY(o) ||
            PyArray_NDIM(o) != lead + k->out_rank ||
            memcmp(PyArray_DIMS(o), shape, (size_t)(lead + k->out_rank) * sizeof(npy_intp)) != 0)
            Py_RETURN_NONE;
        const double *start = PyArray_DATA(o), *end = start + PyArray_SIZE(o);
        for (int g = 0; g < k->groups; g++)
            if (inputs[g] != NULL && inputs[g] < end && start < inputs[g] + n * k->count[g])
                Py_RETURN_NONE;
        Py_INCREF(out);
    }
    double *result = PyArray_DATA((PyArrayObject *)out);
    int verdict;
    if (n == 1) {
        verdict = kr16_run_one(k->kernel, k->parameters, inputs, result);
    } else if (n < GIL_THRESHOLD) {
        verdict = kr16_run(k->kernel, k->parameters, inputs, n, result, 1);
    } else {
        Py_BEGIN_ALLOW_THREADS
        verdict = kr16_run(k->kernel, k->parameters, inputs, n, result, (int)threads);
        Py_END_ALLOW_THREADS
    }
    if (verdict != KR16_FINE) {
        Py_DECREF(out);
        Py_RETURN_NONE;
    }
    return out;
}

int kr16_kernel_groups(PyObject *kernel)
{
    return ((Kernel *)kernel)->groups;
}

int kr16_kernel_width(PyObject *kernel)
{
    return kr16_batch_kernels[((Kernel *)kernel)->kernel].width;
}

int kr16_kernel_one(PyObject *kernel, const double *const *inputs, double *out)
{
    const Kernel *k = (const Kernel *)kernel;
    return kr16_run_one(k->kernel, k->parameters, inputs, out);
}

static int find_kernel(const char *name)
{
    for (int i = 0; kr16_batch_kernels[i].name != NULL; i++)
        if (strcmp(kr16_batch_kernels[i].name, name) == 0)
            return i;
    return -1;
}

static PyObject *kernel_new(PyTypeObject *type, PyObject *args, PyObject *kwargs)
{
    const char *name;
    PyObject *parameters, *shape;
    if (kwargs != NULL && PyDict_Size(kwargs) != 0) {
        PyErr_SetString(PyExc_TypeError, "Kernel takes no keyword arguments");
        return NULL;
    }
    if (!PyArg_ParseTuple(args, "sOO!", &name, &parameters, &PyTuple_Type, &shape))
        return NULL;
    const int index = find_kernel(name);
    const Py_ssize_t rank = PyTuple_GET_SIZE(shape);
    if (index < 0 || rank > MAX_RANK) {
        PyErr_Format(PyExc_ValueError, "no kernel %s with %zd result axes", name, rank);
        return NULL;
    }
    PyObject *values = PySequence_Fast(parameters, "parameters must be a sequence");
    if (values == NULL)
        return NULL;
    const Py_ssize_t length = PySequence_Fast_GET_SIZE(values);
    Kernel *self = (Kernel *)type->tp_alloc(type, 0);
    if (self == NULL || length != kr16_parameter_count) {
        if (self != NULL)
            PyErr_Format(PyExc_ValueError, "%zd parameters; expected %d", length,
                         kr16_parameter_count);
        goto failed;
    }
    const kr16_kernel *k = &kr16_batch_kernels[index];
    self->call = kr16_kernel_call;
    self->kernel = index;
    self->groups = k->groups;
    for (int g = 0; g < k->groups; g++) {
        self->count[g] = k->group[g].count;
        self->trig[g] = k->group[g].kind == 't';
        self->rank[g] = k->group[g].count == 16 ? 2 : 1;
    }
    self->out_rank = (int)rank;
    npy_intp width = 1;
    for (Py_ssize_t i = 0; i < rank; i++) {
        self->out_shape[i] = PyLong_AsSsize_t(PyTuple_GET_ITEM(shape, i));
        if (self->out_shape[i] < 0)
            goto failed;
        width *= self->out_shape[i];
    }
    if (width != k->width) {
        PyErr_Format(PyExc_ValueError, "%s has %d results, not %zd", name, k->width, width);
        goto failed;
    }
    self->parameters = PyMem_Malloc((size_t)length * sizeof(double));
    if (self->parameters == NULL) {
        PyErr_NoMemory();
        goto failed;
    }
    for (Py_ssize_t i = 0; i < length; i++) {
        self->parameters[i] = PyFloat_AsDouble(PySequence_Fast_GET_ITEM(values, i));
        if (self->parameters[i] == -1.0 && PyErr_Occurred())
            goto failed;
    }
    Py_DECREF(values);
    return (PyObject *)self;
failed:
    Py_DECREF(values);
    Py_XDECREF(self);
    return NULL;
}

static void kernel_dealloc(PyObject *self)
{
    PyMem_Free(((Kernel *)self)->parameters);
    Py_TYPE(self)->tp_free(self);
}

static PyMemberDef kernel_members[] = {
    {"__vectorcalloffset__", T_PYSSIZET, offsetof(Kernel, call), READONLY, NULL},
    {NULL, 0, 0, 0, NULL},
};

PyTypeObject KernelType = {
    PyVarObject_HEAD_INIT(NULL, 0).tp_name = "kr16cli.kernels._native.Kernel",
    .tp_doc = "Kernel(name, parameters, shape): call with inputs, out or None, threads.",
    .tp_basicsize = sizeof(Kernel),
    .tp_flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_VECTORCALL,
    .tp_new = kernel_new,
    .tp_dealloc = kernel_dealloc,
    .tp_call = PyVectorcall_Call,
    .tp_vectorcall_offset = offsetof(Kernel, call),
    .tp_members = kernel_members,
};

/* Elementary functions on arrays of float64, for their tests. */
static PyObject *elementary(PyObject *const *args, Py_ssize_t count, int which)
{
    PyArrayObject *arrays[4] = {NULL};
    for (Py_ssize_t i = 0; i < count; i++) {
        if (!PyArray_CheckExact(args[i]) || PyArray_TYPE((PyArrayObject *)args[i]) != NPY_DOUBLE ||
            !PyArray_ISCARRAY((PyArrayObject *)args[i]) ||
            PyArray_SIZE((PyArrayObject *)args[i]) != PyArray_SIZE((PyArrayObject *)args[0])) {
            PyErr_SetString(PyExc_TypeError, "expected contiguous float64 arrays of one size");
            return NULL;
        }
        arrays[i] = (PyArrayObject *)args[i];
    }
    const npy_intp n = PyArray_SIZE(arrays[0]);
    const double *a = PyArray_DATA(arrays[0]);
    double *b = PyArray_DATA(arrays[1]), *c = PyArray_DATA(arrays[2]);
    for (npy_intp i = 0; i < n; i++) {
        if (which == 0)
            kr16_sincos(a[i], &b[i], &c[i]);
        else
            c[i] = kr16_atan2(a[i], b[i]);
    }
    Py_RETURN_NONE;
}

static PyObject *native_sincos(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    (void)self;
    if (count != 3)
        return PyErr_Format(PyExc_TypeError, "sincos(x, sine, cosine)");
    return elementary(args, count, 0);
}

static PyObject *native_atan2(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    (void)self;
    if (count != 3)
        return PyErr_Format(PyExc_TypeError, "atan2(y, x, angle)");
    return elementary(args, count, 1);
}

static PyObject *native_operations(PyObject *self, PyObject *unused)
{
    (void)self;
    (void)unused;
    PyObject *table = PyDict_New();
    for (int i = 0; table != NULL && kr16_batch_kernels[i].name != NULL; i++) {
        PyObject *count = PyLong_FromLong(kr16_batch_kernels[i].operations);
        if (count == NULL || PyDict_SetItemString(table, kr16_batch_kernels[i].name, count) < 0)
            Py_CLEAR(table);
        Py_XDECREF(count);
    }
    return table;
}

static PyObject *native_multiply_adds(PyObject *self, PyObject *rounds)
{
    (void)self;
    const long n = PyLong_AsLong(rounds);
    if (n == -1 && PyErr_Occurred())
        return NULL;
    return Py_BuildValue("dd", kr16_multiply_adds_flops(n), kr16_multiply_adds(n));
}

static PyObject *native_touch(PyObject *self, PyObject *const *args, Py_ssize_t count)
{
    (void)self;
    if (count != 2 || !PyArray_CheckExact(args[0]) ||
        PyArray_TYPE((PyArrayObject *)args[0]) != NPY_DOUBLE ||
        !PyArray_ISCARRAY((PyArrayObject *)args[0])) {
        PyErr_SetString(PyExc_TypeError, "touch(array of float64, write)");
        return NULL;
    }
    const int write = PyObject_IsTrue(args[1]);
    if (write < 0)
        return NULL;
    double *numbers = PyArray_DATA((PyArrayObject *)args[0]);
    const npy_intp n = PyArray_SIZE((PyArrayObject *)args[0]);
    if (!write)
        return PyFloat_FromDouble(kr16_read(numbers, n));
    kr16_write(numbers, n);
    Py_RETURN_NONE;
}

static PyMethodDef methods[] = {
    {"sincos", (PyCFunction)(void (*)(void))native_sincos, METH_FASTCALL,
     "sincos(x, sine, cosine): fill two arrays; |x| <= 1e5."},
    {"atan2", (PyCFunction)(void (*)(void))native_atan2, METH_FASTCALL,
     "atan2(y, x, angle): fill the third array."},
    {"multiply_adds", native_multiply_adds, METH_O,
     "multiply_adds(rounds): (floating-point operations done, their result)."},
    {"touch", (PyCFunction)(void (*)(void))native_touch, METH_FASTCALL,
     "touch(array, write): read every number, or fill the array past the caches."},
    {"operations", native_operations, METH_NOARGS,
     "Arithmetic operations per configuration, by kernel."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module = {
    PyModuleDef_HEAD_INIT, "_native", "Compiled kernels of the model.", -1, methods,
    NULL, NULL, NULL, NULL,
};

static int kernels_fit(void)
{
    for (const kr16_kernel *k = kr16_batch_kernels; k->name != NULL; k++) {
        int rows = 0;
        for (int g = 0; g < k->groups; g++)
            rows += k->group[g].count * (k->group[g].kind == 't' ? 2 : 1);
        if (rows > KR16_MAX_ROWS || k->width + k->guards > KR16_MAX_RESULTS) {
            PyErr_Format(PyExc_ImportError, "kernel %s has %d input and %d result rows; room is "
                         "for %d and %d", k->name, rows, k->width + k->guards, KR16_MAX_ROWS,
                         KR16_MAX_RESULTS);
            return 0;
        }
    }
    return 1;
}

PyMODINIT_FUNC PyInit__native(void)
{
    import_array();
    if (!kernels_fit())
        return NULL;
    if (PyType_Ready(&KernelType) < 0)
        return NULL;
    PyObject *m = PyModule_Create(&module);
    if (m != NULL && (PyModule_AddObjectRef(m, "Kernel", (PyObject *)&KernelType) < 0 ||
                      kr16_add_method_type(m) < 0 || kr16_add_rollout(m) < 0 ||
                      kr16_add_stretch_type(m) < 0))
        Py_CLEAR(m);
    return m;
}
