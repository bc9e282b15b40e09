/* Turning rows of configurations into columns of a tile (structure of arrays), and back.
 *
 * Blocks of 8 x 8 numbers are transposed in vector registers. Inline, so that the functions that
 * use it are compiled per instruction set with it.
 */
#ifndef KR16_TURN_H
#define KR16_TURN_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "kr16_tile.h"

#define KR16_BLOCK 8
#define KR16_LINE 8 /* numbers of a cache line */
#define INLINED static inline __attribute__((always_inline))

typedef double kr16_lanes8 __attribute__((vector_size(64)));
typedef long long kr16_pick8 __attribute__((vector_size(64)));

#ifdef __clang__
#define PICKED(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
#define PICKED(a, b, ...) __builtin_shuffle(a, b, (kr16_pick8){__VA_ARGS__})
#endif

/* to[j] = column j of the 8 rows at `from`, which are `row` numbers apart. */
INLINED void kr16_block(const double *from, ptrdiff_t row, kr16_lanes8 to[8])
{
    kr16_lanes8 r[8], pairs[8], fours[8];
    for (int i = 0; i < 8; i++)
        memcpy(&r[i], from + i * row, sizeof r[i]);
    for (int i = 0; i < 8; i += 2) {
        pairs[i] = PICKED(r[i], r[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
        pairs[i + 1] = PICKED(r[i], r[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
    }
    for (int i = 0; i < 8; i += 4) {
        for (int k = i; k < i + 2; k++) {
            fours[k] = PICKED(pairs[k], pairs[k + 2], 0, 1, 8, 9, 4, 5, 12, 13);
            fours[k + 2] = PICKED(pairs[k], pairs[k + 2], 2, 3, 10, 11, 6, 7, 14, 15);
        }
    }
    for (int k = 0; k < 4; k++) {
        to[k] = PICKED(fours[k], fours[k + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        to[k + 4] = PICKED(fours[k], fours[k + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
}

/* columns[j * KR16_LANES + i] = rows[i * count + j] for a whole tile. Up to 7 numbers beyond
 * the last row are read, and dropped. */
INLINED void kr16_to_columns(const double *rows, int count, double *columns)
{
    for (int i = 0; i < KR16_LANES; i += KR16_BLOCK) {
        for (int j = 0; j < count; j += KR16_BLOCK) {
            kr16_lanes8 block[KR16_BLOCK];
            kr16_block(rows + i * count + j, count, block);
            for (int k = 0; k < KR16_BLOCK; k++)
                if (j + k < count)
                    memcpy(columns + (j + k) * KR16_LANES + i, &block[k], sizeof block[k]);
        }
    }
}

/* Row i of 8 configurations gets `width` numbers, the columns from `columns` on. */
INLINED void kr16_some_rows(const double *columns, int width, double *rows, ptrdiff_t row)
{
    kr16_lanes8 block[KR16_BLOCK];
    kr16_block(columns, KR16_LANES, block);
    for (int i = 0; i < KR16_BLOCK; i++)
        memcpy(rows + i * row, &block[i], (size_t)width * sizeof *rows);
}

/* rows[i * width + j] = columns[j * KR16_LANES + i] for 8 configurations; `columns` are readable
 * up to a whole block. */
INLINED void kr16_to_rows(const double *columns, int width, double *rows)
{
    int j = 0;
    for (; j + KR16_BLOCK <= width; j += KR16_BLOCK)
        kr16_some_rows(columns + j * KR16_LANES, KR16_BLOCK, rows + j, width);
    columns += j * KR16_LANES;
    rows += j;
    switch (width - j) { /* a constant size each, so that the copies are plain moves */
    case 1: kr16_some_rows(columns, 1, rows, width); break;
    case 2: kr16_some_rows(columns, 2, rows, width); break;
    case 3: kr16_some_rows(columns, 3, rows, width); break;
    case 4: kr16_some_rows(columns, 4, rows, width); break;
    case 5: kr16_some_rows(columns, 5, rows, width); break;
    case 6: kr16_some_rows(columns, 6, rows, width); break;
    case 7: kr16_some_rows(columns, 7, rows, width); break;
    default: break;
    }
}

/* Copy whole lines past the caches: large results are not read again soon, and lines that are
 * written whole need not be fetched first. `to` is aligned to a line, `count` a multiple of 8. */
INLINED void kr16_stream(const double *from, ptrdiff_t count, double *to)
{
#ifdef __SSE2__
    for (ptrdiff_t i = 0; i < count; i += 2)
        _mm_stream_pd(to + i, _mm_loadu_pd(from + i));
#else
    memcpy(to, from, (size_t)count * sizeof *to);
#endif
}

/* Streamed numbers are there for every thread from here on. */
INLINED void kr16_stream_end(void)
{
#ifdef __SSE2__
    _mm_sfence();
#endif
}

#endif
