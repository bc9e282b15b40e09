/* What the parts of the shim share: FMI 2.0's types, an instance, pythonfmu's functions. */
#ifndef KR16_SHIM_H
#define KR16_SHIM_H

#include <stddef.h>

#define EXPORT __attribute__((visibility("default")))
#define TEXT 4096

/* FMI 2.0's types, as its headers have them on every 64-bit platform. */
typedef void *Component;
typedef void *State;
typedef unsigned int Reference;
typedef double Real;
typedef int Integer;
typedef int Boolean;
typedef const char *String;
typedef char Byte;
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING } Status;
typedef void (*Logger)(void *, String, Status, String, String, ...);
typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, Status);
    void *environment;
} Callbacks;

typedef struct {
    Component inner;
    Callbacks own;
    const Callbacks *host;
    char *name;
    Boolean logging;
    size_t n_categories;
    char **categories;
    Boolean said; /* the slave has told the reason of the error */
} Instance;

typedef struct {
    void *zero;
    State inner;
} Saved;

/* FMI's functions of pythonfmu's library, by name. */
#define FUNCTIONS(X)                                                                               \
    X(Instantiate) X(FreeInstance) X(SetupExperiment) X(EnterInitializationMode)                   \
    X(ExitInitializationMode) X(Terminate) X(Reset) X(GetReal) X(GetInteger) X(GetBoolean)         \
    X(GetString) X(SetReal) X(SetInteger) X(SetBoolean) X(SetString) X(GetFMUstate)                \
    X(SetFMUstate) X(FreeFMUstate) X(SerializedFMUstateSize) X(SerializeFMUstate)                  \
    X(DeSerializeFMUstate) X(DoStep) X(GetRealStatus) X(GetBooleanStatus)
#define DECLARE(name) void *name;
typedef struct { FUNCTIONS(DECLARE) } Api;

/* load.c */

/* pythonfmu's functions; there once `refusal` has found nothing to refuse. */
extern Api api;

/* Why an instance cannot be made of these arguments, or NULL; may be written to text (TEXT). */
const char *refusal(int type, String guid, const char *folder, char *text);

/* resources.c */

/* The folder of this library, ending in a slash; 0 if it cannot tell. */
int own_folder(char *folder);

/* The folder meant by a resource location: a file URI, a path, or nothing. 0 if too long. */
int folder_of(String location, char *folder);

/* Whether a file of a folder can be read. */
int readable(const char *folder, const char *name);

/* The first line of a file of the resources; empty if there is none. */
void first_line(const char *folder, const char *name, char *line, int size);

/* log.c */

/* A message of the shim's own to the host. */
void tell(const Callbacks *host, String name, Status status, String category, String text);

/* The logger that the slave and pythonfmu's library get; the environment is the instance. */
void relay(void *environment, String name, Status status, String category, String text, ...);

#endif
