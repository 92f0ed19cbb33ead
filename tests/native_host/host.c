/* A host that isn't Python, for what test_hosts.py's real ones don't do: threads that come and go, a
   fork, signals, a Python of its own, the end of the process while others step.

   usage: host FOLDER GUID TASK [ARGUMENT]
     FOLDER    the extracted FMU
     TASK      what to do, see main(); results go to stdout as "name value" lines

   Value references come in as macros (VR_ball_velocity, ...), made from modelDescription.xml.
   If LIBPYTHON is set, the host loads that library itself, for all to see, before the FMU. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "fmi2FunctionTypes.h"

#define DURATION 0.005 /* s: longer than the contact */

typedef struct {
    void *library;
    fmi2InstantiateTYPE *instantiate;
    fmi2SetupExperimentTYPE *setup_experiment;
    fmi2EnterInitializationModeTYPE *enter_initialization_mode;
    fmi2ExitInitializationModeTYPE *exit_initialization_mode;
    fmi2GetRealTYPE *get_real;
    fmi2DoStepTYPE *do_step;
    fmi2TerminateTYPE *terminate;
    fmi2FreeInstanceTYPE *free_instance;
} Fmu;

static char resources[4096];
static const char *guid;
static const char *library_file;

static void logger(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status,
                   fmi2String category, fmi2String message, ...)
{
    va_list arguments;
    (void)environment, (void)instance, (void)status, (void)category;
    va_start(arguments, message);
    vfprintf(stderr, message, arguments);
    fputc('\n', stderr);
    va_end(arguments);
}

static const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};

static void fail(const char *what)
{
    fprintf(stderr, "failed: %s\n", what);
    exit(1);
}

static void expect(int truth, const char *what)
{
    if (!truth) fail(what);
}

static void *symbol(void *library, const char *name)
{
    void *found = dlsym(library, name);
    if (!found) fail(name);
    return found;
}

static Fmu load(void)
{
    Fmu f;
    f.library = dlopen(library_file, RTLD_NOW | RTLD_LOCAL);
    if (!f.library) fail(dlerror());
    f.instantiate = symbol(f.library, "fmi2Instantiate");
    f.setup_experiment = symbol(f.library, "fmi2SetupExperiment");
    f.enter_initialization_mode = symbol(f.library, "fmi2EnterInitializationMode");
    f.exit_initialization_mode = symbol(f.library, "fmi2ExitInitializationMode");
    f.get_real = symbol(f.library, "fmi2GetReal");
    f.do_step = symbol(f.library, "fmi2DoStep");
    f.terminate = symbol(f.library, "fmi2Terminate");
    f.free_instance = symbol(f.library, "fmi2FreeInstance");
    return f;
}

static fmi2Component created(const Fmu *f)
{
    fmi2Component c = f->instantiate("impact", fmi2CoSimulation, guid, resources, &callbacks,
                                     fmi2False, fmi2True);
    expect(c != NULL, "instantiate");
    return c;
}

static fmi2Component initialized(const Fmu *f)
{
    fmi2Component c = created(f);
    expect(f->setup_experiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) == fmi2OK, "set up");
    expect(f->enter_initialization_mode(c) == fmi2OK, "enter initialization");
    expect(f->exit_initialization_mode(c) == fmi2OK, "exit initialization");
    return c;
}

static void discard(const Fmu *f, fmi2Component c)
{
    expect(f->terminate(c) == fmi2OK, "terminate");
    f->free_instance(c);
}

static void advance(const Fmu *f, fmi2Component c, long from, long to, double step)
{
    for (long n = from; n < to; n++)
        expect(f->do_step(c, n * step, step, fmi2True) == fmi2OK, "step");
}

enum { OUTPUTS = 4 };

static void read_outputs(const Fmu *f, fmi2Component c, double values[OUTPUTS])
{
    static const fmi2ValueReference references[OUTPUTS] = {
        VR_smash_factor, VR_coefficient_of_restitution, VR_club_velocity, VR_ball_velocity};
    expect(f->get_real(c, references, OUTPUTS, values) == fmi2OK, "read");
}

static void print_outputs(const double values[OUTPUTS])
{
    printf("smash_factor %.17g\ncoefficient_of_restitution %.17g\n", values[0], values[1]);
    printf("club_velocity %.17g\nball_velocity %.17g\n", values[2], values[3]);
}

static void impact(const Fmu *f, double step, double values[OUTPUTS])
{
    fmi2Component c = initialized(f);
    advance(f, c, 0, (long)(DURATION / step + 0.5), step);
    read_outputs(f, c, values);
    discard(f, c);
}

/* TASKS */

static void task_impact(double step)
{
    Fmu f = load();
    double values[OUTPUTS];
    impact(&f, step, values);
    print_outputs(values);
}

/* An instance made in one thread, stepped in a second, freed in a third. */
static void *step_through(void *job)
{
    void **parts = job;
    advance(parts[0], parts[1], 0, 5000, 1e-6);
    return NULL;
}

static void *free_it(void *job)
{
    void **parts = job;
    discard(parts[0], parts[1]);
    return NULL;
}

static void task_migrate(void)
{
    Fmu f = load();
    double values[OUTPUTS];
    fmi2Component c = initialized(&f);
    void *parts[2] = {&f, c};
    pthread_t thread;
    pthread_create(&thread, NULL, step_through, parts);
    pthread_join(thread, NULL);
    read_outputs(&f, c, values);
    print_outputs(values);
    pthread_create(&thread, NULL, free_it, parts);
    pthread_join(thread, NULL);
    impact(&f, 1e-6, values);
}

static void *make_and_leave(void *job)
{
    void **parts = job;
    parts[1] = initialized(parts[0]);
    return NULL;
}

/* N instances, each made in a thread that has ended when the instance is used. */
static void task_gone(long count)
{
    Fmu f = load();
    double values[OUTPUTS];
    fmi2Component keep = created(&f);
    for (long n = 0; n < count; n++) {
        void *parts[2] = {&f, NULL};
        pthread_t thread;
        pthread_create(&thread, NULL, make_and_leave, parts);
        pthread_join(thread, NULL);
        advance(&f, parts[1], 0, 5, 1e-3);
        read_outputs(&f, parts[1], values);
        discard(&f, parts[1]);
    }
    f.free_instance(keep);
    print_outputs(values);
}

/* The handlers of the host's signals are what they were. */
static void task_signals(void)
{
    struct sigaction before[NSIG], after;
    double values[OUTPUTS];
    for (int n = 1; n < NSIG; n++) sigaction(n, NULL, &before[n]);
    Fmu f = load();
    impact(&f, 1e-4, values);
    for (int n = 1; n < NSIG; n++)
        if (sigaction(n, NULL, &after) == 0)
            expect(after.sa_handler == before[n].sa_handler, "a signal's handler is the host's");
    print_outputs(values);
}

/* A host that starts a Python of its own while the FMU is in use: the library that is named. */
static void task_later(const char *file)
{
    Fmu f = load();
    double values[OUTPUTS];
    fmi2Component c = initialized(&f);
    advance(&f, c, 0, 100, 1e-6);
    void *library = dlopen(file, RTLD_NOW | RTLD_GLOBAL);
    if (!library) fail(dlerror());
    void (*start)(int) = symbol(library, "Py_InitializeEx");
    int (*run)(const char *) = symbol(library, "PyRun_SimpleString");
    void *(*save)(void) = symbol(library, "PyEval_SaveThread");
    start(0);
    expect(run("import math, json; assert json.loads('[1.5]') == [1.5]") == 0, "the host's Python");
    void *state = save();
    advance(&f, c, 100, 5000, 1e-6);
    read_outputs(&f, c, values);
    void (*restore)(void *) = symbol(library, "PyEval_RestoreThread");
    restore(state);
    expect(run("import decimal") == 0, "the host's Python goes on");
    int (*finalize)(void) = symbol(library, "Py_FinalizeEx");
    expect(finalize() == 0, "the host's Python ends");
    print_outputs(values);
    discard(&f, c);
}

static void *step_for_ever(void *fmu)
{
    const Fmu *f = fmu;
    fmi2Component c = initialized(f);
    for (long n = 0;; n++) f->do_step(c, n * 1e-9, 1e-9, fmi2True);
    return NULL;
}

/* A host that ends while others of its threads step. */
static void task_exit(long count)
{
    static Fmu f;
    double values[OUTPUTS];
    pthread_t thread;
    f = load();
    impact(&f, 1e-3, values);
    for (long n = 0; n < count; n++) pthread_create(&thread, NULL, step_for_ever, &f);
    usleep(20000);
    print_outputs(values);
}

/* A host that forks while nothing else runs: child and parent go on, each by itself. */
static void task_fork(void)
{
    Fmu f = load();
    double values[OUTPUTS], childs[OUTPUTS];
    int status = 0;
    fmi2Component c = initialized(&f);
    advance(&f, c, 0, 100, 1e-6);
    int ends[2];
    expect(pipe(ends) == 0, "a pipe");
    pid_t child = fork();
    if (child == 0) {
        advance(&f, c, 100, 5000, 1e-6);
        read_outputs(&f, c, childs);
        _exit(write(ends[1], childs, sizeof childs) != sizeof childs);
    }
    waitpid(child, &status, 0);
    expect(status == 0, "the child ended well");
    advance(&f, c, 100, 5000, 1e-6);
    read_outputs(&f, c, values);
    expect(read(ends[0], childs, sizeof childs) == sizeof childs, "the child's answer");
    expect(!memcmp(values, childs, sizeof values), "child and parent have the same answer");
    print_outputs(values);
    discard(&f, c);
}

/* A thread that Python didn't start has a thread state only while something holds it: without that
   each call makes one and drops it. Counts the calls after which this thread's isn't what it was. */
static void task_state(long count)
{
    typedef void *Current(void);
    Fmu f = load();
    Current *current = (Current *)symbol(RTLD_DEFAULT, "PyGILState_GetThisThreadState");
    double values[OUTPUTS];
    expect(current() == NULL, "no thread state before an instance is made");
    fmi2Component c = initialized(&f);
    advance(&f, c, 0, 1, 1e-9);
    void *state = current();
    long steps = 0, reads = 0;
    for (long n = 1; n <= count; n++) {
        advance(&f, c, n, n + 1, 1e-9);
        steps += !state || current() != state;
        read_outputs(&f, c, values);
        reads += !state || current() != state;
    }
    printf("states_made_by_steps %ld\nstates_made_by_reads %ld\n", steps, reads);
    discard(&f, c);
    printf("state_at_the_end %d\n", current() != NULL);
}

int main(int argc, char **argv)
{
    if (argc < 4) fail("usage: host FOLDER GUID TASK [ARGUMENT]");
    static char file[4096];
    double argument = argc > 4 ? atof(argv[4]) : 1e-6;
    const char *task = argv[3], *libpython = getenv("LIBPYTHON");
    snprintf(file, sizeof file, "%s/binaries/linux64/ClubBallImpact.so", argv[1]);
    snprintf(resources, sizeof resources, "file://%s/resources", argv[1]);
    library_file = file;
    guid = argv[2];
    if (libpython && !dlopen(libpython, RTLD_NOW | RTLD_GLOBAL)) fail(dlerror());
    if (!strcmp(task, "impact")) task_impact(argument);
    else if (!strcmp(task, "migrate")) task_migrate();
    else if (!strcmp(task, "gone")) task_gone((long)argument);
    else if (!strcmp(task, "fork")) task_fork();
    else if (!strcmp(task, "signals")) task_signals();
    else if (!strcmp(task, "later")) task_later(argc > 4 ? argv[4] : "");
    else if (!strcmp(task, "exit")) task_exit((long)argument);
    else if (!strcmp(task, "state")) task_state((long)argument);
    else fail("unknown task");
    puts("done");
    return 0;
}
