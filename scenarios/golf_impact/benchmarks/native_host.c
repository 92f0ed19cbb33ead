/* A host that isn't Python, for `golf-impact bench --native`.

   usage: native_host COUNT REFERENCES... -- LIBRARY RESOURCES GUID [LIBRARY RESOURCES GUID ...]

   Starts all of the FMUs, steps the first COUNT times, reads its outputs as often, and prints the
   seconds of the first instantiation, of a step and of a read, and the process's size in kB. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fmi2FunctionTypes.h"

#define CALL(library, name) ((name##TYPE *)dlsym(library, #name))

static void logger(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status,
                   fmi2String category, fmi2String message, ...)
{
    (void)environment, (void)instance, (void)status, (void)category;
    fprintf(stderr, "%s\n", message);
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static void check(int fine, const char *what)
{
    if (fine) return;
    fprintf(stderr, "failed: %s\n", what ? what : "");
    exit(1);
}

int main(int argc, char **argv)
{
    static const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};
    fmi2ValueReference references[16];
    size_t outputs = 0;
    double values[16], begin, started = 0.0;
    fmi2Component first = NULL;
    void *of_first = NULL;
    int n = 2;
    check(argc > 2, "usage");
    long count = atol(argv[1]), size = 0;
    for (; n < argc && strcmp(argv[n], "--") && outputs < 16; n++)
        references[outputs++] = (fmi2ValueReference)atol(argv[n]);
    for (n++; n + 2 < argc; n += 3) {
        begin = now();
        void *library = dlopen(argv[n], RTLD_NOW | RTLD_LOCAL);
        check(library != NULL, library ? "" : dlerror());
        fmi2Component c = CALL(library, fmi2Instantiate)("one", fmi2CoSimulation, argv[n + 2],
                                                         argv[n + 1], &callbacks, 0, 1);
        check(c != NULL, "instantiate");
        if (!first) started = now() - begin, first = c, of_first = library;
        check(CALL(library, fmi2SetupExperiment)(c, 0, 0.0, 0.0, 0, 0.0) == fmi2OK, "set up");
        check(CALL(library, fmi2EnterInitializationMode)(c) == fmi2OK, "enter");
        check(CALL(library, fmi2ExitInitializationMode)(c) == fmi2OK, "exit");
    }
    check(first != NULL, "no FMU");
    fmi2DoStepTYPE *step = CALL(of_first, fmi2DoStep);
    fmi2GetRealTYPE *read = CALL(of_first, fmi2GetReal);
    check(read(first, references, outputs, values) == fmi2OK, "read");
    begin = now();
    for (long k = 0; k < count; k++) check(step(first, k * 1e-9, 1e-9, 1) == fmi2OK, "step");
    double stepped = now();
    for (long k = 0; k < count; k++) check(!read(first, references, outputs, values), "read");
    double done = now();
    char line[256];
    FILE *file = fopen("/proc/self/status", "r");
    while (file && fgets(line, sizeof line, file)) sscanf(line, "VmRSS: %ld", &size);
    printf("%.9g %.9g %.9g %ld\n", started, (stepped - begin) / count, (done - stepped) / count, size);
    fflush(stdout);
    /* Without the end of the process: that of a preloaded Python isn't what is measured. */
    _Exit(0);
}
