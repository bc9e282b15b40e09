/* The calls that FMI 2.0 and 3.0 have in common. Their instance may be NULL; statuses are the same
 * numbers in both versions. */
#ifndef KR16_CALLS_H
#define KR16_CALLS_H

#include "kr16_fmu.h"

#define AT(phase) (1u << (phase))
#define ANY (AT(FAILED + 1) - 1u)

/* Refuses a missing instance, and calls in other phases than those allowed. */
int kr16_enter(kr16_instance *self, const char *call, unsigned allowed);
int kr16_missing(kr16_instance *self, const char *call);

int kr16_known(kr16_instance *self, const char *token);
int kr16_call_log(kr16_instance *self, int on, size_t n, const char *const *names);
int kr16_call_leave_initialization(kr16_instance *self);
int kr16_call_terminate(kr16_instance *self);
int kr16_call_reset(kr16_instance *self);

int kr16_call_get(kr16_instance *self, const char *call, const unsigned *references, size_t n,
                  unsigned want, int type, void *values, size_t count);
int kr16_call_set(kr16_instance *self, const char *call, const unsigned *references, size_t n,
                  unsigned want, int type, const void *values, size_t count);

int kr16_call_save(kr16_instance *self, void **state);
int kr16_call_restore(kr16_instance *self, const void *state);
int kr16_call_forget(kr16_instance *self, void **state);
int kr16_call_state_size(kr16_instance *self, const void *state, size_t *size);
int kr16_call_write_state(kr16_instance *self, const void *state, void *bytes, size_t size);
int kr16_call_read_state(kr16_instance *self, const void *bytes, size_t size, void **state);

int kr16_call_derivatives(kr16_instance *self, const kr16_request *request, int adjoint);
int kr16_call_output_rises(kr16_instance *self, const unsigned *references, size_t n,
                           const int *orders, double *values, size_t count);

int kr16_call_event_mode(kr16_instance *self);
int kr16_call_after_event(kr16_instance *self, const char *call, int phase);
int kr16_call_completed_step(kr16_instance *self, int complete);
int kr16_call_set_time(kr16_instance *self, double time);
int kr16_call_set_states(kr16_instance *self, const double *x, size_t n);
int kr16_call_get_states(kr16_instance *self, double *x, size_t n);
int kr16_call_nominals(kr16_instance *self, double *x, size_t n);
int kr16_call_rates(kr16_instance *self, const char *call, double *dx, size_t n);
int kr16_call_indicators(kr16_instance *self, double *z, size_t n);

#endif
