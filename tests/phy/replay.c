/* Repeats recorded calls of kernels (golden_calls.py) and compares what they leave. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef void (*kernel)(int64_t *, int64_t *);
#define KERNEL(name) void phy_##name(int64_t *, int64_t *);
#include "kernels.h"
#undef KERNEL
#define KERNEL(name) {#name, phy_##name},
static const struct { const char *name; kernel call; } kernels[] = {
#include "kernels.h"
};

enum { EXACT, NEAR_INT16, FLOAT32, FLOAT64, ADDRESSES };
static const int64_t *at;

static int64_t next(void) { return *at++; }

static const void *bytes(int64_t n)
{
    const void *found = at;
    at += (n + 7) / 8;
    return found;
}

static double worst(int kind, const void *got, const void *wanted, int64_t n)
{
    double largest = 1e-30, off = 0;
    if (kind == ADDRESSES || !memcmp(got, wanted, n))
        return 0;
    if (kind == NEAR_INT16) {
        const int16_t *a = got, *b = wanted;
        for (int64_t i = 0; i < n / 2; i++)
            if (abs(a[i] - b[i]) > 1)
                return 1;
        return 0;
    }
    if (kind == EXACT)
        return 1;
    for (int64_t i = 0; i < n / (kind == FLOAT32 ? 4 : 8); i++) {
        double a = kind == FLOAT32 ? ((const float *)got)[i] : ((const double *)got)[i];
        double b = kind == FLOAT32 ? ((const float *)wanted)[i] : ((const double *)wanted)[i];
        if (isfinite(b))
            largest = fmax(largest, fabs(b));
        if (a != b && !(isnan(a) && isnan(b)))
            off = fmax(off, isfinite(a - b) ? fabs(a - b) : INFINITY);
    }
    return off / largest;
}

int main(int argc, char **argv)
{
    FILE *file = argc == 2 ? fopen(argv[1], "rb") : NULL;
    if (!file || fseek(file, 0, SEEK_END))
        return 2;
    long size = ftell(file);
    int64_t *content = malloc(size);
    rewind(file);
    if (!content || fread(content, 1, size, file) != (size_t)size)
        return 2;
    at = content;
    int status = 0;
    for (int64_t calls = next(), call = 0; call < calls; call++) {
        int64_t number = next(), n = next();
        void **own = calloc(n, sizeof *own);
        const void **after = calloc(n, sizeof *after);
        int64_t *kind = calloc(n, 8), *length = calloc(n, 8), *links = calloc(n, 8);
        const int64_t **link = calloc(n, sizeof *link);
        for (int64_t i = 0; i < n; i++) {
            kind[i] = next(), length[i] = next(), links[i] = next();
            link[i] = bytes(16 * links[i]);
            own[i] = aligned_alloc(64, (length[i] + 127) / 64 * 64);
            memcpy(own[i], bytes(length[i]), length[i]);
            after[i] = bytes(length[i]);
        }
        for (int64_t i = 0; i < n; i++)
            for (int64_t k = 0; k < links[i]; k++)
                ((int64_t *)own[i])[link[i][2 * k]] = (int64_t)own[link[i][2 * k + 1]];
        kernels[number].call(own[0], own[1]);
        double off = 0;
        for (int64_t i = 1; i < n; i++)
            off = fmax(off, worst(kind[i], own[i], after[i], length[i]));
        printf("%s %g\n", kernels[number].name, off);
        if (!(off <= 1e-3))
            status = 1;
    }
    return status;
}
