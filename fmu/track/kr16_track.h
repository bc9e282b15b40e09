/* A wanted motion of six joints as the library holds it: points to play between. */
#ifndef KR16_TRACK_H
#define KR16_TRACK_H

#include <stdint.h>

#define KR16_POINTS 512

/* The builder writes it: as C, or into a compiled library, which it finds by the mark. */
typedef struct {
    char mark[16];
    char sources[80]; /* hash of the C that this is compiled with */
    char token[64];
    int32_t points, unused;
    double time[KR16_POINTS];    /* s, rising; twice the same where accelerations jump */
    double row[KR16_POINTS][18]; /* q (rad), qd (rad/s), qdd (rad/s2) */
} kr16_track_table;

extern const kr16_track_table kr16_track;

/* q, qd, qdd at time t; at rest before the first point and from the last one on. */
void kr16_play(double t, double *row);

#endif
