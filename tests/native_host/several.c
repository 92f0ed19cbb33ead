/* A host of several FMUs (FMI 2.0), each from a folder of its own.

   usage: several [-r] FOLDER NAME GUID [FOLDER NAME GUID ...]
     Each FMU is loaded, instantiated and stepped in a thread of its own, all at the same time; with
     -r one after the other, and the folder of each is removed when the next is about to start.

   Prints how many steps were made, the size of the process in kB, and how many files named
   golf-python are in it. */

#include "fmu.h"

#include <pthread.h>

enum { MOST = 64, STEPS = 200 };

typedef struct {
    const char *folder, *name, *guid;
    void *library;
    fmi2Component instance;
    long steps;
} Job;

static void steps(Job *job)
{
    for (int n = 0; n < STEPS; n++) {
        fmi2Status status =
            CALL(job->library, fmi2DoStep)(job->instance, job->steps * 1e-4, 1e-4, fmi2True);
        if (status != fmi2OK) fail(job->name);
        job->steps++;
    }
}

static void *run(void *argument)
{
    Job *job = argument;
    job->library = load(job->folder, job->name);
    job->instance = instantiate(job->library, job->folder, job->guid, job->name);
    initialize(job->library, job->instance);
    steps(job);
    return NULL;
}

#ifdef _WIN32
#include <psapi.h>
static void print_results(long made)
{
    HMODULE all[1024];
    char name[4096];
    DWORD size = 0;
    int pythons = 0;
    K32EnumProcessModules(GetCurrentProcess(), all, sizeof all, &size);
    for (size_t n = 0; n < size / sizeof *all; n++) {
        GetModuleFileNameA(all[n], name, sizeof name);
        pythons += strstr(name, "golf-python-") != NULL;
    }
    printf("steps %ld\npythons %d\ndone\n", made, pythons);
}
#else
static void print_results(long made)
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

#endif

int main(int argc, char **argv)
{
    static Job jobs[MOST];
    pthread_t threads[MOST];
    read_arguments(&argc, &argv);
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
    print_results(made);
    return 0;
}
