/* Derivatives by running a function's operations on dual numbers v + d e with e^2 = 0. */
#include "tape.h"

#include <math.h>
#include <string.h>

#include "trig.h"

void kr16_along(const kr16_tape *tape, const double *p, const double *x, const double *dx,
                double *dy)
{
    double v[KR16_TAPE_PLACES], d[KR16_TAPE_PLACES];
    int place = KR16_PARAMETERS, chosen;
    memcpy(v, p, KR16_PARAMETERS * sizeof *v);
    memset(d, 0, sizeof *d * (size_t)(KR16_PARAMETERS + tape->inputs + tape->constant_count));
    memcpy(v + place, x, (size_t)tape->inputs * sizeof *v);
    memcpy(d + place, dx, (size_t)tape->inputs * sizeof *d);
    place += tape->inputs;
    memcpy(v + place, tape->constants, (size_t)tape->constant_count * sizeof *v);
    place += tape->constant_count;
    for (int k = 0; k < tape->length; k++, place++) {
        const uint32_t step = tape->code[k], first = step >> 12 & 0xfffu, second = step & 0xfffu;
        const double a = v[first], da = d[first], b = v[second], db = d[second];
        double value = 0.0, slope = 0.0;
        switch (step >> 24) {
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
        case TAPE_WHERE: /* where (a) b else what the next line names */
            value = b;
            slope = db;
            break;
        default: /* TAPE_ELSE */
            chosen = v[tape->code[k - 1] >> 12 & 0xfffu] != 0.0;
            value = chosen ? v[place - 1] : a;
            slope = chosen ? d[place - 1] : da;
        }
        v[place] = value;
        d[place] = slope;
    }
    for (int k = 0; k < tape->results; k++)
        dy[k] = d[tape->ends[k]];
}
