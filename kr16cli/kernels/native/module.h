/* What the files of the extension module share. */
#ifndef KR16_MODULE_H
#define KR16_MODULE_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

extern PyTypeObject KernelType;

/* kernel(*inputs, out, threads): the result, or None where something needs care. */
PyObject *kr16_kernel_call(PyObject *self, PyObject *const *args, size_t flags, PyObject *names);

/* Inputs that a kernel takes. */
int kr16_kernel_groups(PyObject *kernel);

/* Its results' numbers. */
int kr16_kernel_width(PyObject *kernel);

/* One configuration; not 0 where it is not finite, or a guard speaks. */
int kr16_kernel_one(PyObject *kernel, const double *const *inputs, double *out);

int kr16_add_method_type(PyObject *module);
int kr16_add_rollout(PyObject *module);
int kr16_add_stretch_type(PyObject *module);

#endif
