/* A host that isn't Python, for FMI 2.0 or, compiled with -DFMI=3, FMI 3.0: threads that come and go,
   early return.

   usage: host FOLDER BINARY TOKEN LAW TASK NUMBER
     FOLDER    the extracted FMU
     BINARY    the library in it
     TASK      what to do, see main(); results go to stdout as "name value" lines

   Value references come in as macros (VR_ball_velocity, ...), made from modelDescription.xml.
   If LIBPYTHON is set, the host loads that library itself, for all to see, before the FMU. */

#define _GNU_SOURCE
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#define FILE_URI "file:///"
#define RTLD_DEFAULT GetModuleHandleA(NULL)
#define dlsym(library, name) ((void *)(intptr_t)GetProcAddress(library, name))
enum { RTLD_NOW, RTLD_LOCAL = 0, RTLD_GLOBAL = 0 };
static void *dlopen(const char *path, int mode) { return LoadLibraryA(path); }
static const char *dlerror(void) { return "LoadLibrary"; }
#else
#include <dlfcn.h>
#define FILE_URI "file://"
#endif

static void *library;
static const char *folder, *token;
static int law;

static void expect(int truth, const char *what)
{
    if (truth) return;
    fprintf(stderr, "failed: %s\n", what);
    exit(1);
}

static void *load(const char *path, int mode)
{
    void *found = dlopen(path, mode);
    if (!found) expect(0, dlerror());
    return found;
}

static void *symbol(void *from, const char *name)
{
    void *found = dlsym(from, name);
    expect(found != NULL, name);
    return found;
}

#define OK(name, ...) expect(CALL(name)(__VA_ARGS__) == 0, #name)

enum { OUTPUTS = 4 };
static const unsigned REFERENCES[OUTPUTS] = {VR_smash_factor, VR_coefficient_of_restitution,
                                             VR_club_velocity, VR_ball_velocity};

static void print_outputs(const double values[OUTPUTS])
{
    printf("smash_factor %.17g\ncoefficient_of_restitution %.17g\n", values[0], values[1]);
    printf("club_velocity %.17g\nball_velocity %.17g\n", values[2], values[3]);
}

#if FMI == 2
#include "fmi2FunctionTypes.h"
#define CALL(name) ((fmi2##name##TYPE *)symbol(library, "fmi2" #name))
typedef fmi2Component Slave;

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                        fmi2String category, fmi2String message, ...)
{
    fprintf(stderr, "%s\n", message);
}

static Slave begun(void)
{
    static const fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, NULL};
    char resources[4096];
    snprintf(resources, sizeof resources, FILE_URI "%s/resources", folder);
    Slave c = CALL(Instantiate)("one", fmi2CoSimulation, token, resources, &callbacks, 0, 1);
    expect(c != NULL, "instantiate");
    OK(SetupExperiment, c, 0, 0.0, 0.0, 0, 0.0);
    OK(EnterInitializationMode, c);
    OK(SetInteger, c, (unsigned[]){VR_law}, 1, &law);
    OK(ExitInitializationMode, c);
    return c;
}

static void step(Slave c, double point, double size) { OK(DoStep, c, point, size, 1); }

static void read_outputs(Slave c, double values[OUTPUTS])
{
    OK(GetReal, c, REFERENCES, OUTPUTS, values);
}
#else
#include "fmi3FunctionTypes.h"
#define CALL(name) ((fmi3##name##TYPE *)symbol(library, "fmi3" #name))
typedef fmi3Instance Slave;
static bool is_early; /* whether steps return at events */

static Slave begun(void)
{
    Slave c = CALL(InstantiateCoSimulation)("one", token, NULL, 0, 1, is_early, is_early, NULL, 0,
                   NULL, NULL, NULL);
    expect(c != NULL, "instantiate");
    OK(EnterInitializationMode, c, 0, 0.0, 0.0, 0, 0.0);
    OK(SetInt64, c, (unsigned[]){VR_law}, 1, (fmi3Int64[]){law}, 1);
    OK(SetFloat64, c, (unsigned[]){VR_gap}, 1, (double[]){is_early ? 0.0035 : 0.0}, 1);
    OK(ExitInitializationMode, c);
    if (is_early) OK(EnterStepMode, c);
    return c;
}

/* Whether it ends with an event; the time becomes that of its end. */
static bool step_to_event(Slave c, double *time, double size)
{
    bool event, terminate, early;
    OK(DoStep, c, *time, size, 1, &event, &terminate, &early, time);
    return event;
}

static void step(Slave c, double point, double size) { step_to_event(c, &point, size); }

static void read_outputs(Slave c, double values[OUTPUTS])
{
    OK(GetFloat64, c, REFERENCES, OUTPUTS, values, OUTPUTS);
}
#endif

static void discard(Slave c)
{
    OK(Terminate, c);
    CALL(FreeInstance)(c);
}

/* TASKS */

static void advance(Slave c, long count, double size)
{
    for (long n = 0; n < count; n++) step(c, n * size, size);
}

static void task_impact(double size)
{
    double values[OUTPUTS];
    Slave c = begun();
    advance(c, (long)(0.005 / size + 0.5), size);
    read_outputs(c, values);
    discard(c);
    print_outputs(values);
}

static void *make(void *unused) { return begun(); }

static void *step_through(void *c)
{
    advance(c, 5, 1e-3);
    return c;
}

static void *discard_it(void *c)
{
    discard(c);
    return NULL;
}

/* What a function returns in a thread of its own, which has ended. */
static void *in_thread(void *function(void *), void *c)
{
    pthread_t thread;
    pthread_create(&thread, NULL, function, c);
    pthread_join(thread, &c);
    return c;
}

/* Instances that are made, stepped and freed in three threads, beside one that stays. */
static void task_threads(long count)
{
    double values[OUTPUTS];
    Slave keep = begun();
    for (long n = 0; n < count; n++) {
        Slave c = in_thread(step_through, in_thread(make, NULL));
        read_outputs(c, values);
        in_thread(discard_it, c);
    }
    discard(keep);
    print_outputs(values);
}

/* A thread that Python didn't start has a thread state only while something holds it: without that
   each call makes one and drops it. Counts the calls after which this thread's isn't what it was. */
static void task_state(long count)
{
    typedef void *Current(void);
    Current *current = (Current *)symbol(RTLD_DEFAULT, "PyGILState_GetThisThreadState");
    double values[OUTPUTS];
    long made = current() != NULL;
    Slave c = begun();
    step(c, 0.0, 1e-9);
    void *state = current();
    for (long n = 1; n <= count; n++) {
        step(c, n * 1e-9, 1e-9);
        made += !state || current() != state;
        read_outputs(c, values);
        made += !state || current() != state;
    }
    discard(c);
    printf("states_made %ld\nstates_left %d\n", made, current() != NULL);
}

#if FMI == 3
/* Until the end: when the events were, s. */
static void task_early(void)
{
    bool again, terminate, nominals, states, defined;
    double time = 0.0, next, values[OUTPUTS];
    int count = 0;
    is_early = true;
    Slave c = begun();
    while (time < 1e-3) {
        if (!step_to_event(c, &time, 1e-3 - time)) continue;
        printf("event_%d %.17g\n", ++count, time);
        OK(EnterEventMode, c);
        OK(UpdateDiscreteStates, c, &again, &terminate, &nominals, &states, &defined, &next);
        OK(EnterStepMode, c);
    }
    read_outputs(c, values);
    discard(c);
    print_outputs(values);
}
#else
static void task_early(void) { expect(0, "early return in FMI 2.0"); }
#endif

int main(int argc, char **argv)
{
    char path[4096];
    const char *libpython = getenv("LIBPYTHON");
    expect(argc == 7, "usage: host FOLDER BINARY TOKEN LAW TASK NUMBER");
    folder = argv[1], token = argv[3], law = atoi(argv[4]);
    const char *task = argv[5];
    double number = atof(argv[6]);
    if (libpython) load(libpython, RTLD_NOW | RTLD_GLOBAL);
    snprintf(path, sizeof path, "%s/%s", folder, argv[2]);
    library = load(path, RTLD_NOW | RTLD_LOCAL);
    if (!strcmp(task, "impact")) task_impact(number);
    else if (!strcmp(task, "threads")) task_threads((long)number);
    else if (!strcmp(task, "state")) task_state((long)number);
    else if (!strcmp(task, "early")) task_early();
    else expect(0, "a task");
    puts("done");
    return 0;
}
