/* Loads an FMU (FMI 2.0) and calls it, for the hosts in this folder. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"

/* A function of a library by its name in the standard. */
#define CALL(library, name) ((name##TYPE *)symbol(library, #name))

/* Where messages go, if not to stderr. */
static FILE *messages;

static inline void fail(const char *what)
{
    fprintf(stderr, "failed: %s\n", what ? what : "");
    exit(1);
}

static inline void *symbol(void *library, const char *name)
{
    void *found = dlsym(library, name);
    if (!found) fail(name);
    return found;
}

static inline void *load(const char *folder, const char *name)
{
    char file[4096];
    snprintf(file, sizeof file, "%s/binaries/linux64/%s.so", folder, name);
    void *library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
    if (!library) fail(dlerror());
    return library;
}

static inline void log_message(fmi2ComponentEnvironment environment, fmi2String instance,
                               fmi2Status status, fmi2String category, fmi2String message, ...)
{
    FILE *file = messages ? messages : stderr;
    va_list arguments;
    (void)environment, (void)instance, (void)status, (void)category;
    va_start(arguments, message);
    vfprintf(file, message, arguments);
    fputc('\n', file);
    va_end(arguments);
}

static const fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, NULL};

static inline fmi2Component instantiate(void *library, const char *folder, const char *guid,
                                        const char *name)
{
    char resources[4096];
    snprintf(resources, sizeof resources, "file://%s/resources", folder);
    fmi2Component c = CALL(library, fmi2Instantiate)(name, fmi2CoSimulation, guid, resources,
                                                     &callbacks, fmi2False, fmi2True);
    if (!c) fail("instantiate");
    return c;
}

static inline void initialize(void *library, fmi2Component c)
{
    if (CALL(library, fmi2SetupExperiment)(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) != fmi2OK)
        fail("set up");
    if (CALL(library, fmi2EnterInitializationMode)(c) != fmi2OK) fail("enter initialization");
    if (CALL(library, fmi2ExitInitializationMode)(c) != fmi2OK) fail("exit initialization");
}
