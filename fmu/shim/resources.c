/* Where the FMU's resources lie, and what is in them. */

#define _GNU_SOURCE
#include <ctype.h>
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "shim.h"

int own_folder(char *folder) {
    Dl_info info;
    if (!dladdr((void *)own_folder, &info) || !realpath(info.dli_fname, folder)) return 0;
    strrchr(folder, '/')[1] = 0;
    return 1;
}

int readable(const char *folder, const char *name) {
    char path[2 * TEXT];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return access(path, R_OK) == 0;
}

static int hex(char c) { return isdigit((unsigned char)c) ? c - '0' : (c | 32) - 'a' + 10; }

int folder_of(String location, char *folder) {
    if (!location || !*location) {
        if (!own_folder(folder) || strlen(folder) + 32 > TEXT) return 0;
        strcat(folder, "../../resources");
        return 1;
    }
    int uri = !strncmp(location, "file:", 5);
    if (uri) {
        location += 5;
        if (!strncmp(location, "//", 2)) {
            const char *path = strchr(location + 2, '/');
            location = path ? path : location + 2;
        }
    }
    char *out = folder;
    while (*location) {
        if (out >= folder + TEXT - 1) return 0;
        if (uri && *location == '%' && isxdigit((unsigned char)location[1]) &&
            isxdigit((unsigned char)location[2])) {
            *out++ = (char)(16 * hex(location[1]) + hex(location[2]));
            location += 3;
        } else {
            *out++ = *location++;
        }
    }
    while (out > folder + 1 && out[-1] == '/') out--;
    *out = 0;
    return 1;
}

void first_line(const char *folder, const char *name, char *line, int size) {
    char path[2 * TEXT];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    line[0] = 0;
    FILE *file = fopen(path, "r");
    if (!file) return;
    if (!fgets(line, size, file)) line[0] = 0;
    fclose(file);
    line[strcspn(line, "\r\n")] = 0;
}
