/* A kernel without Python: parameters and inputs from stdin, a batch's results and those of its
 * first configuration to stdout. Usage: kernel_host KERNEL COUNT GIVEN, GIVEN having a 1 for each
 * input that is there and a 0 for each that is not. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "batch.h"

static double *numbers(size_t count)
{
    double *room = malloc(count * sizeof *room);
    if (room == NULL || fread(room, sizeof *room, count, stdin) != count)
        exit(3);
    return room;
}

int main(int argc, char **argv)
{
    const kr16_kernel *k = kr16_batch_kernels;
    const double *inputs[3] = {NULL};
    double one[KR16_MAX_RESULTS];
    if (argc != 4)
        return 2;
    while (k->name != NULL && strcmp(k->name, argv[1]) != 0)
        k++;
    if (k->name == NULL)
        return 2;
    const int index = (int)(k - kr16_batch_kernels);
    const size_t n = (size_t)atoi(argv[2]), width = (size_t)k->width;
    const double *p = numbers((size_t)kr16_parameter_count);
    for (int g = 0; g < k->groups; g++)
        if (argv[3][g] == '1')
            inputs[g] = numbers(n * (size_t)k->group[g].count);
    double *out = malloc(n * width * sizeof *out);
    if (out == NULL || kr16_run(index, p, inputs, (ptrdiff_t)n, out, 2) != KR16_FINE ||
        kr16_run_one(index, p, inputs, one) != KR16_FINE)
        return 1;
    fwrite(out, sizeof *out, n * width, stdout);
    fwrite(one, sizeof *one, width, stdout);
    return 0;
}
