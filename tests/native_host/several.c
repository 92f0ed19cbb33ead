/* A host of several FMUs (FMI 2.0), each from a folder of its own.

   usage: several [-r] FOLDER NAME GUID [FOLDER NAME GUID ...]
     Each FMU is loaded, instantiated and stepped in a thread of its own, all at the same time; with
     -r one after the other, and the folder of each is removed when the next is about to start.

   Prints how many steps were made, the size of the process in kB, and how many files named
   golf-python are in it. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"

enum { MOST = 64, STEPS = 200 };

typedef struct {
    const char *folder, *name, *guid;
    fmi2Component instance;
    fmi2DoStepTYPE *step;
    long steps;
} Job;

static void logger(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status,
                   fmi2String category, fmi2String message, ...)
{
    (void)environment, (void)instance, (void)status, (void)category;
    fprintf(stderr, "%s\n", message);
}

static const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};

static void fail(const char *what)
{
    fprintf(stderr, "failed: %s\n", what ? what : "");
    exit(1);
}

static void steps(Job *job)
{
    for (int n = 0; n < STEPS; n++) {
        if (job->step(job->instance, job->steps * 1e-4, 1e-4, fmi2True) != fmi2OK) fail(job->name);
        job->steps++;
    }
}

static void *run(void *argument)
{
    Job *job = argument;
    static char files[2][MOST][4096];
    static int used;
    int n = __atomic_fetch_add(&used, 1, __ATOMIC_RELAXED);
    char *file = files[0][n], *resources = files[1][n];
    snprintf(file, 4096, "%s/binaries/linux64/%s.so", job->folder, job->name);
    snprintf(resources, 4096, "file://%s/resources", job->folder);
    void *library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
    if (!library) fail(dlerror());
    fmi2InstantiateTYPE *instantiate = (fmi2InstantiateTYPE *)dlsym(library, "fmi2Instantiate");
    fmi2SetupExperimentTYPE *set_up = (fmi2SetupExperimentTYPE *)dlsym(library, "fmi2SetupExperiment");
    fmi2EnterInitializationModeTYPE *enter =
        (fmi2EnterInitializationModeTYPE *)dlsym(library, "fmi2EnterInitializationMode");
    fmi2ExitInitializationModeTYPE *leave =
        (fmi2ExitInitializationModeTYPE *)dlsym(library, "fmi2ExitInitializationMode");
    job->step = (fmi2DoStepTYPE *)dlsym(library, "fmi2DoStep");
    fmi2Component c = instantiate(job->name, fmi2CoSimulation, job->guid, resources, &callbacks,
                                  fmi2False, fmi2True);
    if (!c || set_up(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) || enter(c) || leave(c))
        fail(job->name);
    job->instance = c;
    steps(job);
    return NULL;
}

static void tell(long made)
{
    char line[4096], found[MOST][256];
    long size = 0;
    int pythons = 0;
    FILE *file = fopen("/proc/self/status", "r");
    while (file && fgets(line, sizeof line, file)) sscanf(line, "VmRSS: %ld", &size);
    if (file) fclose(file);
    file = fopen("/proc/self/maps", "r");
    while (file && fgets(line, sizeof line, file)) {
        char *inode = strchr(line, ':'), *python = strstr(line, "/golf-python-");
        if (!python || !inode) continue;
        char key[256];
        long number = 0;
        sscanf(inode + 3, "%ld", &number);
        snprintf(key, sizeof key, "%ld", number);
        int n = 0;
        while (n < pythons && strcmp(found[n], key)) n++;
        if (n == pythons && pythons < MOST) strcpy(found[pythons++], key);
    }
    if (file) fclose(file);
    printf("steps %ld\nkilobytes %ld\npythons %d\ndone\n", made, size, pythons);
}

int main(int argc, char **argv)
{
    static Job jobs[MOST];
    pthread_t threads[MOST];
    int removing = argc > 1 && !strcmp(argv[1], "-r"), count = 0;
    long made = 0;
    for (int n = 1 + removing; n + 2 < argc && count < MOST; n += 3)
        jobs[count++] = (Job){argv[n], argv[n + 1], argv[n + 2], NULL, NULL, 0};
    for (int n = 0; n < count; n++) {
        if (!removing) {
            if (pthread_create(&threads[n], NULL, run, &jobs[n])) fail("thread");
            continue;
        }
        run(&jobs[n]);
        char command[8192];
        snprintf(command, sizeof command, "rm -r '%s'", jobs[n].folder);
        if (system(command)) fail(command);
    }
    for (int n = 0; n < count && !removing; n++) pthread_join(threads[n], NULL);
    for (int n = 0; n < count; n++) {
        steps(&jobs[n]);
        made += jobs[n].steps;
    }
    tell(made);
    return 0;
}
