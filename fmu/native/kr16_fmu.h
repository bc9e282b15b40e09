/* A robot behind an FMU: what the parts of the library know of each other.
 *
 * All functions are pure in their arguments: no global state, no files, and memory is taken only
 * when an instance or a saved state is made. SI units; angles in rad.
 */
#ifndef KR16_FMU_H
#define KR16_FMU_H

#include <stddef.h>
#include <stdint.h>

#include "kr16_model.h"

/* What stands in the description: one entry for each value reference, the first for 1. */
enum { INPUT, PARAMETER, OUTPUT, LOCAL, INDEPENDENT };
enum { FIXED, TUNABLE, DISCRETE, CONTINUOUS };
enum { REAL, INTEGER, BOOLEAN };
enum { ROBOT, CONTROLLER };

#define KR16_ENTRIES 192

typedef struct {
    uint8_t slot, count, causality, variability;
} kr16_entry;

/* The numbers of one robot. The builder writes them: as C, or into a compiled library, which it
 * finds by the mark. */
typedef struct {
    char mark[16];
    char sources[80];    /* hash of the C that this is compiled with */
    double geometry[6];  /* d1 a1 a2 a3 d4 d6 */
    double links[60];    /* m, h, J about the joint frame's origin, of six links */
    double lower[6], upper[6], speed[6], torque[6]; /* limits; infinite where there is none */
    double start[SLOTS];
    char token[64];
    char joints[6][16];
    int32_t part, entries;
    kr16_entry entry[KR16_ENTRIES];
} kr16_robot_table;

extern const kr16_robot_table kr16_robot;

typedef struct {
    double low, high; /* what may be set */
    char unit[12];
} kr16_range;

typedef struct {
    uint8_t kind, group, range, stem; /* the stem of its name; six of one stem are [1] to [6] */
} kr16_slot;

typedef struct {
    char text[28];
} kr16_name;

extern const kr16_slot kr16_slots[SLOTS];
extern const kr16_range kr16_ranges[];
kr16_name kr16_name_of(int slot);

/* The equations of motion with all that parameters decide. */
enum { TORQUE_MODE = 1, GRAVITY_MODE, PD_MODE, COMPUTED_TORQUE_MODE, TASK_SPACE_MODE };
enum { AUTO = 1, RK4, SEMI_IMPLICIT_EULER, ROSENBROCK, DORMAND_PRINCE };
enum { INPUTS = 30, STATES = 12 };
enum { TAU, Q_REF = 6, QD_REF = 12, QDD_REF = 18, WRENCH = 24 }; /* inputs by place */

/* Inputs of kr16_task by place. */
enum { TASK_Q, TASK_QD = 12, TASK_MOTION = 18, TASK_TARGET = 72, TASK_KP = 96, TASK_KD = 102,
       TASK_INPUTS = 108 };

typedef struct {
    double p[KR16_PARAMETERS + KR16_KEPT];
    double torque[6], speed[6];  /* what the drives are held to; infinite where nothing */
    double stiffness[6];         /* of the stops, N m/rad */
    double kp[6], kd[6];
    double step, tolerance;
    int bound, stops, drives, mode, method;
    int sparse;                  /* the short forward dynamics will do */
    double u[INPUTS], rise[INPUTS], since; /* inputs are u + rise (t - since) */
    double target[24];           /* the flange's, of u */
    int moving, pushed;          /* an input rises; there is a wrench */
    double pitch;                /* of the orientation error where it was too large, else 0 */
    double qdd[6];               /* accelerations where the next step begins, */
    int known;                   /* if they are known */
} kr16_plant;

void kr16_trig(const double *angles, double *cs);
void kr16_plant_inputs(kr16_plant *plant, double t, double *u);
int kr16_asked(kr16_plant *plant, double t, const double *x, const double *cs, double *tau);
void kr16_applied(const kr16_plant *plant, const double *qd, double *tau);
void kr16_contact(const kr16_plant *plant, const double *q, const double *qd, double *tau);
int kr16_plant_rates(void *plant, double t, const double *x, double *dx);
int kr16_plant_rates_at(kr16_plant *plant, double t, const double *x, const double *cs, double *dx);
int kr16_control(kr16_plant *plant, const double *u, const double *x, const double *cs, double *tau);
void kr16_retarget(kr16_plant *plant, const double *u, double *target);

enum { FINE, FOLDED, NOT_FINITE, STEP_VANISHED };

/* One step of the plant's method from t to t + h, in place; x stays as it was where it fails.
 * `hint` is kept from call to call. */
int kr16_advance(kr16_plant *plant, double t, double h, double *x, double *hint);

/* An instance. What a saved state holds is the core: no pointers. */
enum { INSTANTIATED, INITIALIZING, EVENT, CONTINUOUS_TIME, STEPPING, TERMINATED, FAILED };

typedef struct {
    double value[SLOTS]; /* the state is value[SLOT_Q] and what follows */
    double rise[INPUTS];
    kr16_plant plant;
    double stop, tolerance, hint; /* stop: infinite where none was told */
    double cs[12];       /* cosines and sines of the angles, if the group of none is up to date */
    uint32_t fresh;      /* groups that are up to date */
    uint32_t beyond;     /* joints that are beyond their limits */
    int32_t phase, ready, current; /* the plant has the parameters; and the inputs */
} kr16_core;

typedef struct kr16_instance kr16_instance;
typedef void kr16_teller(kr16_instance *instance, int status, const char *category,
                         const char *text);
/* Asked after each internal step of a communication step: whether to return, and the time. */
typedef int kr16_between(kr16_instance *instance, double time, double *until);

struct kr16_instance {
    kr16_core core;
    int model_exchange, event_mode, early_return, version; /* 2 or 3 */
    int logging;
    uint32_t categories;
    kr16_teller *tell;
    kr16_between *between;
    void *environment;
    void (*callback)(void); /* the host's logger, of its own type */
    void (*update)(void);
    char *name;
};

enum { OK, WARNING, DISCARD, ERROR, FATAL };
enum { LOG_WARNINGS = 1, LOG_ERRORS = 2, LOG_ALL = 3 };

kr16_instance *kr16_new(const char *name, int version, int model_exchange);
void kr16_free(kr16_instance *instance);
int kr16_fail(kr16_instance *instance, const char *format, ...)
#ifdef __GNUC__
    __attribute__((format(printf, 2, 3)))
#endif
    ;
void kr16_say(kr16_instance *instance, int status, uint32_t category, const char *format, ...)
#ifdef __GNUC__
    __attribute__((format(printf, 4, 5)))
#endif
    ;
int kr16_log_categories(kr16_instance *instance, int on, size_t count, const char *const *names);
const char *kr16_phase(const kr16_instance *instance);

/* Phases. */
int kr16_must_be(kr16_instance *instance, const char *call, unsigned phases);
int kr16_setup(kr16_instance *instance, int has_tolerance, double tolerance, double start,
               int has_stop, double stop);
int kr16_leave_initialization(kr16_instance *instance);
int kr16_reset(kr16_instance *instance);
void kr16_hold_flags(kr16_instance *instance);
void kr16_stale(kr16_instance *instance);

/* Values. `want` is the bits of the kinds that the call takes. */
enum { WANT_REAL = 1, WANT_INTEGER = 2, WANT_BOOLEAN = 4 };
enum { AS_DOUBLE, AS_INT, AS_BOOL };
int kr16_take(kr16_instance *instance, const char *call, const unsigned *references, size_t n,
              unsigned want, int type, void *values, size_t count);
int kr16_put(kr16_instance *instance, const char *call, const unsigned *references, size_t n,
             unsigned want, int type, const void *values, size_t count);
int kr16_ready(kr16_instance *instance);
int kr16_compute(kr16_instance *instance, int group);
void kr16_margins(const double *value, const double *x, const double *tau, double *margin);

/* Steps of co-simulation. */
typedef struct {
    double reached;
    int event, early;
} kr16_step_result;
int kr16_do_step(kr16_instance *instance, double time, double size, kr16_step_result *result);
int kr16_input_rises(kr16_instance *instance, const unsigned *references, size_t n,
                     const int *orders, const double *values);
void kr16_watch(kr16_instance *instance);

/* Model exchange. */
int kr16_states(void);
int kr16_indicators(void);
int kr16_set_states(kr16_instance *instance, const double *x, size_t n);
int kr16_derivatives(kr16_instance *instance, double *dx, size_t n);

/* Derivatives of unknowns by knowns. What slots of the groups change by goes to `change`. */
int kr16_outputs_along(kr16_instance *instance, uint32_t groups, const double *dx, const double *du,
                       double *change);
typedef struct {
    const char *call;
    const unsigned *unknowns;
    size_t unknown_count;
    const unsigned *knowns;
    size_t known_count;
    const double *seeds;
    size_t seed_count;
    double *results;
    size_t result_count;
} kr16_request;
int kr16_directional(kr16_instance *instance, const kr16_request *request);
int kr16_adjoint(kr16_instance *instance, const kr16_request *request);
int kr16_output_rises(kr16_instance *instance, const unsigned *references, size_t n,
                      const int *orders, double *values, size_t count);

/* Saved states. */
int kr16_save(kr16_instance *instance, void **state);
int kr16_restore(kr16_instance *instance, const void *state);
int kr16_forget(kr16_instance *instance, void **state);
size_t kr16_state_size(void);
int kr16_write_state(kr16_instance *instance, const void *state, void *bytes, size_t size);
int kr16_read_state(kr16_instance *instance, const void *bytes, size_t size, void **state);

#endif
