/* Derivatives by running a function's operations on dual numbers v + d e with e^2 = 0. */
#include "tape.h"

#include <math.h>
#include <string.h>

#include "trig.h"

/* The place of an argument of the operation at `place`. */
static int argument(const uint8_t **code, int far, int place)
{
    const uint8_t *c = *code;
    *code += far ? 2 : 1;
    return far ? c[0] | c[1] << 8 : place - c[0];
}

void kr16_along(const kr16_tape *tape, const double *p, const double *x, const double *dx,
                double *y, double *dy)
{
    double v[KR16_TAPE_PLACES], d[KR16_TAPE_PLACES];
    const uint8_t *code = tape->code;
    int place = KR16_PARAMETERS, condition = 0;
    memcpy(v, p, KR16_PARAMETERS * sizeof *v);
    memset(d, 0, sizeof *d * (size_t)(KR16_PARAMETERS + tape->inputs + tape->constant_count));
    memcpy(v + place, x, (size_t)tape->inputs * sizeof *v);
    memcpy(d + place, dx, (size_t)tape->inputs * sizeof *d);
    place += tape->inputs;
    memcpy(v + place, tape->constants, (size_t)tape->constant_count * sizeof *v);
    place += tape->constant_count;
    for (int k = 0; k < tape->length; k++, place++) {
        const int byte = *code++, operation = byte & 15;
        const int first = argument(&code, byte & 16, place);
        const int second = operation < TAPE_ALONE ? argument(&code, byte & 32, place) : first;
        const double a = v[first], da = d[first], b = v[second], db = d[second];
        double value = 0.0, slope = 0.0;
        switch (operation) {
        case TAPE_ADD:
            value = a + b;
            slope = da + db;
            break;
        case TAPE_SUB:
            value = a - b;
            slope = da - db;
            break;
        case TAPE_MUL:
            value = a * b;
            slope = da * b + a * db;
            break;
        case TAPE_DIV:
            value = a / b;
            slope = (da - value * db) / b;
            break;
        case TAPE_NEG:
            value = -a;
            slope = -da;
            break;
        case TAPE_SQRT:
            value = sqrt(a);
            slope = 0.5 * da / value;
            break;
        case TAPE_SIN:
            value = kr16_sin(a);
            slope = kr16_cos(a) * da;
            break;
        case TAPE_COS:
            value = kr16_cos(a);
            slope = -kr16_sin(a) * da;
            break;
        case TAPE_ATAN2:
            value = kr16_angle(a, b);
            slope = (b * da - a * db) / (a * a + b * b);
            break;
        case TAPE_LT:
            value = a < b;
            break;
        case TAPE_LE:
            value = a <= b;
            break;
        case TAPE_WHERE: /* where (a) b else what the next operation names */
            condition = a != 0.0;
            value = b;
            slope = db;
            break;
        default: /* TAPE_ELSE */
            value = condition ? v[place - 1] : a;
            slope = condition ? d[place - 1] : da;
        }
        v[place] = value;
        d[place] = slope;
    }
    for (int k = 0; k < tape->results; k++) {
        if (y)
            y[k] = v[tape->ends[k]];
        if (dy)
            dy[k] = d[tape->ends[k]];
    }
}
