/* Calls kernels from Python: checks the arguments, and lays them out as 64-bit words (entries.py).
 *
 * A short burst takes several calls, and code that has not run for a while costs far more:
 * a call must be little code. It needs Python's stable interface, and fields that NumPy has kept at
 * their places in every array since version 1.7. Neither needs header files.
 */
#include <stdint.h>

typedef struct object Object;
typedef intptr_t Size;
typedef struct {
    const char *name;
    Object *(*call)(Object *, Object *const *, Size);
    int flags;
    const char *text;
} Method;
typedef struct {
    char head[16];
    char *data;
    int n_dimensions;
    Size *shape, *strides;
    Object *base, *dtype;
    int flags;
} Array;
typedef struct {
    Method method;
    /* Types of arguments and results: i, d, c: numbers; b: an argument block; else an array, by the
     * place of its dtype and its number of dimensions. */
    const char *takes, *gives;
    void (*run)(int64_t *, int64_t *);
} Kernel;

extern char _Py_NoneStruct[];
extern Object *PyExc_TypeError;
extern Object *PyCFunction_NewEx(Method *, Object *, Object *);
extern Object *PyComplex_FromDoubles(double, double);
extern Object *PyErr_Format(Object *, const char *, ...);
extern Object *PyErr_Occurred(void);
extern Object *PyFloat_FromDouble(double);
extern Object *PyLong_FromLongLong(long long);
extern Object *PyLong_FromVoidPtr(void *);
extern Object *PyObject_GetAttr(Object *, Object *);
extern Object *PyObject_Type(Object *);
extern Object *PyTuple_GetItem(Object *, Size);
extern Object *PyTuple_New(Size);
extern Object *PyUnicode_InternFromString(const char *);
extern Size PyTuple_Size(Object *);
extern double PyComplex_ImagAsDouble(Object *);
extern double PyComplex_RealAsDouble(Object *);
extern double PyFloat_AsDouble(Object *);
extern int PyTuple_SetItem(Object *, Size, Object *);
extern long long PyLong_AsLongLong(Object *);
extern void *PyEval_SaveThread(void);
extern void *PyLong_AsVoidPtr(Object *);
extern void PyEval_RestoreThread(void *);
extern void Py_DecRef(Object *);
extern void Py_IncRef(Object *);
static Object *call(Object *, Object *const *, Size);

#define KERNEL(name, takes, gives) void phy_##name(int64_t *, int64_t *);
#include "kernels.h"
#undef KERNEL
#define FASTCALL 0x80
#define KERNEL(name, takes, gives) {{#name, call, FASTCALL, 0}, takes, gives, phy_##name},
static Kernel kernels[] = {
#include "kernels.h"
};
enum { N_KERNELS = sizeof kernels / sizeof *kernels, MOST_WORDS = 64, MOST_RESULTS = 8 };
/* NumPy's flags: contiguous, and at an address that suits the type. */
enum { CONTIGUOUS = 0x1, ALIGNED = 0x100, SOUND = CONTIGUOUS | ALIGNED };
static Object *array_type, *address, *dtypes[16];

static int has_type(Object *object, Object *type)
{
    Object *own = PyObject_Type(object);
    Py_DecRef(own);
    return own == type;
}

static Object *refused(const Kernel *kernel, Size i, Object *argument, int dtype, int n)
{
    Object *got = has_type(argument, array_type) ? ((Array *)argument)->dtype : argument;
    return PyErr_Format(
        PyExc_TypeError,
        "%s, argument %zd: got %R; allowed: a contiguous, aligned array of %S, %d dimensions",
        kernel->method.name, i + 1, got, dtypes[dtype], n);
}

static Object *result(const char *gives, const int64_t *left)
{
    const double *figure = (const double *)left;
    if (*gives == 'i')
        return PyLong_FromLongLong(*left);
    if (*gives == 'd')
        return PyFloat_FromDouble(*figure);
    return PyComplex_FromDoubles(figure[0], figure[1]);
}

static Object *call(Object *self, Object *const *arguments, Size n)
{
    const Kernel *kernel = PyLong_AsVoidPtr(self);
    int64_t words[MOST_WORDS], left[MOST_RESULTS], *word = words;
    const char *type = kernel->takes;
    Size i;
    for (i = 0; i < n && *type; i++, type++) {
        Object *argument = arguments[i];
        if (*type == 'i')
            *word++ = PyLong_AsLongLong(argument);
        else if (*type == 'd')
            *(double *)word++ = PyFloat_AsDouble(argument);
        else if (*type == 'c') {
            *(double *)word++ = PyComplex_RealAsDouble(argument);
            *(double *)word++ = PyComplex_ImagAsDouble(argument);
        } else if (*type == 'b') {
            Object *place = PyObject_GetAttr(argument, address);
            if (!place)
                return 0;
            *word++ = PyLong_AsLongLong(place);
            *word++ = 0; /* A block is opened by its type; its size is not needed. */
            Py_DecRef(place);
        } else {
            int dtype = *type++ - 'A', dimensions = *type - '0';
            Array *array = (Array *)argument;
            if (!has_type(argument, array_type) || array->dtype != dtypes[dtype] ||
                array->n_dimensions != dimensions || (array->flags & SOUND) != SOUND)
                return refused(kernel, i, argument, dtype, dimensions);
            *word++ = (int64_t)array->data;
            for (int k = 0; k < dimensions; k++)
                *word++ = array->shape[k];
        }
    }
    if (i < n || *type)
        return PyErr_Format(PyExc_TypeError, "%s: got %zd arguments", kernel->method.name, n);
    /* A conversion has failed. */
    if (PyErr_Occurred())
        return 0;
    void *thread = PyEval_SaveThread();
    kernel->run(words, left);
    PyEval_RestoreThread(thread);
    type = kernel->gives;
    if (!*type) {
        Py_IncRef((Object *)_Py_NoneStruct);
        return (Object *)_Py_NoneStruct;
    }
    if (!type[1])
        return result(type, left);
    Size several = 0;
    while (type[several])
        several++;
    Object *tuple = PyTuple_New(several);
    const int64_t *own = left;
    for (i = 0; tuple && i < several; own += type[i] == 'c' ? 2 : 1, i++)
        PyTuple_SetItem(tuple, i, result(type + i, own));
    return tuple;
}

/* The functions of all kernels in the order of kernels.h, for NumPy's arrays and its dtypes. */
Object *phy_functions(Object *type, Object *known)
{
    Size n = PyTuple_Size(known);
    if (n < 0 || n > (Size)(sizeof dtypes / sizeof *dtypes))
        return PyErr_Format(PyExc_TypeError, "got %zd dtypes", n);
    Py_IncRef(array_type = type);
    address = PyUnicode_InternFromString("address");
    for (Size i = 0; i < n; i++)
        Py_IncRef(dtypes[i] = PyTuple_GetItem(known, i));
    Object *functions = PyTuple_New(N_KERNELS);
    for (Size i = 0; functions && i < N_KERNELS; i++) {
        Object *self = PyLong_FromVoidPtr(&kernels[i]);
        PyTuple_SetItem(functions, i, PyCFunction_NewEx(&kernels[i].method, self, 0));
        Py_DecRef(self);
    }
    return functions;
}

/* Where this library takes the content of an array to be. */
Object *phy_address_of(Object *array) { return PyLong_FromVoidPtr(((Array *)array)->data); }
