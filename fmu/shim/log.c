/* Messages: from the slave and pythonfmu's library, and the shim's own, to the host. */

#include <string.h>

#include "shim.h"

void tell(const Callbacks *host, String name, Status status, String category, String text) {
    char escaped[2 * TEXT], *out = escaped;
    if (!host || !host->logger) return;
    /* A message is a format: a percent sign must be doubled. */
    for (; *text && out < escaped + sizeof escaped - 3; text++) {
        *out++ = *text == '\n' ? ' ' : *text;
        if (*text == '%') *out++ = '%';
    }
    *out = 0;
    host->logger(host->environment, name, status, category, escaped);
}

static Boolean listed(const Instance *c, String category) {
    for (size_t i = 0; i < c->n_categories; i++)
        if (!strcmp(c->categories[i], category) || !strcmp(c->categories[i], "logAll")) return 1;
    return c->n_categories == 0;
}

/* What the slave and pythonfmu's library log. */
void relay(void *environment, String name, Status status, String category, String text, ...) {
    Instance *c = environment;
    (void)name;
    if (status == FATAL) status = ERROR;
    if (!category || !*category) category = status >= ERROR ? "logStatusError" : "logAll";
    if (status >= ERROR) {
        if (c->said) return; /* the library repeats the slave's error */
        c->said = 1;
    } else if (!c->logging || !listed(c, category)) {
        return;
    }
    tell(c->host, c->name, status, category, text);
}
