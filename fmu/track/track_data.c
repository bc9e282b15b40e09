/* The points of one motion. */
#include "kr16_track.h"

#include "kr16_track_data.h"
