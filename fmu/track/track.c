/* The motion between points: polynomials of degree 5 through q, qd and qdd of both ends. */
#include "kr16_track.h"

#include <string.h>

static void rest(const double *at, double *row)
{
    memcpy(row, at, 6 * sizeof *row);
    memset(row + 6, 0, 12 * sizeof *row);
}

void kr16_play(double t, double *row)
{
    int low = 0, high = kr16_track.points - 1;
    if (t < kr16_track.time[0] || t >= kr16_track.time[high]) {
        rest(kr16_track.row[t < kr16_track.time[0] ? 0 : high], row);
        return;
    }
    while (high - low > 1) { /* time[low] <= t < time[high] */
        const int middle = (low + high) / 2;
        if (kr16_track.time[middle] <= t)
            low = middle;
        else
            high = middle;
    }
    const double *a = kr16_track.row[low], *b = kr16_track.row[high];
    const double h = kr16_track.time[high] - kr16_track.time[low];
    const double u = (t - kr16_track.time[low]) / h;
    for (int i = 0; i < 6; i++) {
        const double d = b[i] - a[i], v0 = h * a[6 + i], v1 = h * b[6 + i];
        const double w0 = h * h * a[12 + i], w1 = h * h * b[12 + i];
        const double c3 = 10.0 * d - 6.0 * v0 - 4.0 * v1 - 1.5 * w0 + 0.5 * w1;
        const double c4 = -15.0 * d + 8.0 * v0 + 7.0 * v1 + 1.5 * w0 - w1;
        const double c5 = 6.0 * d - 3.0 * (v0 + v1) - 0.5 * (w0 - w1);
        row[i] = a[i] + u * (v0 + u * (0.5 * w0 + u * (c3 + u * (c4 + u * c5))));
        row[6 + i] = (v0 + u * (w0 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / h;
        row[12 + i] = (w0 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))) / (h * h);
    }
}
