/* Method(kernel, required, fallback): a Python method whose plain cases a kernel answers.
 *
 * method(*inputs, out=None, threads=1) asks the kernel first; whatever it leaves, and any other
 * argument, goes to `fallback` unchanged. Saves the Python frames of a call of 0.2 us.
 */
#include "module.h"

#include <structmember.h>

#define MOST 5 /* inputs, out, threads */

typedef struct {
    PyObject_HEAD
    vectorcallfunc call;
    PyObject *kernel, *fallback;
    Py_ssize_t groups, required;
} Method;

static PyObject *name_out, *name_threads, *one;

static PyObject *method_call(PyObject *self, PyObject *const *args, size_t flags, PyObject *names)
{
    Method *m = (Method *)self;
    const Py_ssize_t given = PyVectorcall_NARGS(flags);
    PyObject *all[MOST];
    if (given < m->required || given > m->groups)
        goto careful;
    for (Py_ssize_t g = 0; g < m->groups; g++)
        all[g] = g < given ? args[g] : Py_None;
    all[m->groups] = Py_None;
    all[m->groups + 1] = one;
    for (Py_ssize_t i = 0; names != NULL && i < PyTuple_GET_SIZE(names); i++) {
        if (PyTuple_GET_ITEM(names, i) == name_out)
            all[m->groups] = args[given + i];
        else if (PyTuple_GET_ITEM(names, i) == name_threads)
            all[m->groups + 1] = args[given + i];
        else
            goto careful;
    }
    PyObject *result = kr16_kernel_call(m->kernel, all, (size_t)m->groups + 2, NULL);
    if (result != Py_None)
        return result;
    Py_DECREF(result);
careful:
    return PyObject_Vectorcall(m->fallback, args, flags, names);
}

static PyObject *method_new(PyTypeObject *type, PyObject *args, PyObject *kwargs)
{
    PyObject *kernel, *fallback;
    Py_ssize_t required;
    if (kwargs != NULL && PyDict_Size(kwargs) != 0) {
        PyErr_SetString(PyExc_TypeError, "Method takes no keyword arguments");
        return NULL;
    }
    if (!PyArg_ParseTuple(args, "O!nO", &KernelType, &kernel, &required, &fallback))
        return NULL;
    const int groups = kr16_kernel_groups(kernel);
    if (groups + 2 > MOST || required < 1 || required > groups) {
        PyErr_Format(PyExc_ValueError, "%zd of %d inputs cannot be required", required, groups);
        return NULL;
    }
    Method *self = (Method *)type->tp_alloc(type, 0);
    if (self == NULL)
        return NULL;
    self->call = method_call;
    self->kernel = Py_NewRef(kernel);
    self->fallback = Py_NewRef(fallback);
    self->groups = groups;
    self->required = required;
    return (PyObject *)self;
}

static int method_traverse(PyObject *self, visitproc visit, void *arg)
{
    Py_VISIT(((Method *)self)->kernel);
    Py_VISIT(((Method *)self)->fallback);
    return 0;
}

static int method_clear(PyObject *self)
{
    Py_CLEAR(((Method *)self)->kernel);
    Py_CLEAR(((Method *)self)->fallback);
    return 0;
}

static void method_dealloc(PyObject *self)
{
    PyObject_GC_UnTrack(self);
    method_clear(self);
    Py_TYPE(self)->tp_free(self);
}

static PyObject *method_attribute(PyObject *self, void *name)
{
    return PyObject_GetAttrString(((Method *)self)->fallback, name);
}

static PyMemberDef method_members[] = {
    {"__vectorcalloffset__", T_PYSSIZET, offsetof(Method, call), READONLY, NULL},
    {"__wrapped__", T_OBJECT_EX, offsetof(Method, fallback), READONLY, NULL},
    {NULL, 0, 0, 0, NULL},
};

static PyGetSetDef method_attributes[] = {
    {"__doc__", method_attribute, NULL, NULL, "__doc__"},
    {"__name__", method_attribute, NULL, NULL, "__name__"},
    {"__qualname__", method_attribute, NULL, NULL, "__qualname__"},
    {"__self__", method_attribute, NULL, NULL, "__self__"},
    {NULL, NULL, NULL, NULL, NULL},
};

static PyTypeObject MethodType = {
    PyVarObject_HEAD_INIT(NULL, 0).tp_name = "kr16cli.kernels._native.Method",
    .tp_basicsize = sizeof(Method),
    .tp_flags = Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_VECTORCALL | Py_TPFLAGS_HAVE_GC,
    .tp_new = method_new,
    .tp_dealloc = method_dealloc,
    .tp_traverse = method_traverse,
    .tp_clear = method_clear,
    .tp_call = PyVectorcall_Call,
    .tp_vectorcall_offset = offsetof(Method, call),
    .tp_members = method_members,
    .tp_getset = method_attributes,
};

int kr16_add_method_type(PyObject *module)
{
    name_out = PyUnicode_InternFromString("out");
    name_threads = PyUnicode_InternFromString("threads");
    one = PyLong_FromLong(1);
    if (name_out == NULL || name_threads == NULL || one == NULL || PyType_Ready(&MethodType) < 0)
        return -1;
    return PyModule_AddObjectRef(module, "Method", (PyObject *)&MethodType);
}
