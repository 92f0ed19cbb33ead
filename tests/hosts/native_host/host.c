/* A host that isn't Python, for what test_hosts.py's real ones don't do: threads that come and go, a
   fork.

   usage: host FOLDER GUID TASK [ARGUMENT]
     FOLDER    the extracted FMU
     TASK      what to do, see main(); results go to stdout as "name value" lines

   Value references come in as macros (VR_ball_velocity, ...), made from modelDescription.xml.
   If LIBPYTHON is set, the host loads that library itself, for all to see, before the FMU. */

#include "fmu.h"

#include <pthread.h>
#include <unistd.h>
#ifndef _WIN32
#include <sys/wait.h>
#endif

#define DURATION 0.005 /* s: longer than the contact */

static void *library;
static const char *folder, *guid;

static void expect(int truth, const char *what)
{
    if (!truth) fail(what);
}

static fmi2Component initialized(void)
{
    fmi2Component c = instantiate(library, folder, guid, "impact");
    initialize(library, c);
    return c;
}

static void discard(fmi2Component c)
{
    expect(CALL(library, fmi2Terminate)(c) == fmi2OK, "terminate");
    CALL(library, fmi2FreeInstance)(c);
}

static void advance(fmi2Component c, long from, long to, double step)
{
    for (long n = from; n < to; n++)
        expect(CALL(library, fmi2DoStep)(c, n * step, step, fmi2True) == fmi2OK, "step");
}

enum { OUTPUTS = 4 };

static void read_outputs(fmi2Component c, double values[OUTPUTS])
{
    static const fmi2ValueReference references[OUTPUTS] = {
        VR_smash_factor, VR_coefficient_of_restitution, VR_club_velocity, VR_ball_velocity};
    expect(CALL(library, fmi2GetReal)(c, references, OUTPUTS, values) == fmi2OK, "read");
}

static void print_outputs(const double values[OUTPUTS])
{
    printf("smash_factor %.17g\ncoefficient_of_restitution %.17g\n", values[0], values[1]);
    printf("club_velocity %.17g\nball_velocity %.17g\n", values[2], values[3]);
}

static void impact(double step, double values[OUTPUTS])
{
    fmi2Component c = initialized();
    advance(c, 0, (long)(DURATION / step + 0.5), step);
    read_outputs(c, values);
    discard(c);
}

/* TASKS */

static void task_impact(double step)
{
    double values[OUTPUTS];
    impact(step, values);
    print_outputs(values);
}

/* An instance made in one thread, stepped in a second, freed in a third. */
static void *step_through(void *c)
{
    advance(c, 0, 5000, 1e-6);
    return NULL;
}

static void *free_it(void *c)
{
    discard(c);
    return NULL;
}

static void task_migrate(void)
{
    double values[OUTPUTS];
    fmi2Component c = initialized();
    pthread_t thread;
    pthread_create(&thread, NULL, step_through, c);
    pthread_join(thread, NULL);
    read_outputs(c, values);
    print_outputs(values);
    pthread_create(&thread, NULL, free_it, c);
    pthread_join(thread, NULL);
    impact(1e-6, values);
}

static void *make_and_leave(void *unused)
{
    (void)unused;
    return initialized();
}

/* N instances, each made in a thread that has ended when the instance is used. */
static void task_gone(long count)
{
    double values[OUTPUTS];
    fmi2Component c, keep = instantiate(library, folder, guid, "keep");
    for (long n = 0; n < count; n++) {
        pthread_t thread;
        pthread_create(&thread, NULL, make_and_leave, NULL);
        pthread_join(thread, &c);
        advance(c, 0, 5, 1e-3);
        read_outputs(c, values);
        discard(c);
    }
    CALL(library, fmi2FreeInstance)(keep);
    print_outputs(values);
}

#ifdef _WIN32
#define RTLD_DEFAULT GetModuleHandleA(NULL)
#endif

/* A thread that Python didn't start has a thread state only while something holds it: without that
   each call makes one and drops it. Counts the calls after which this thread's isn't what it was. */
static void task_state(long count)
{
    typedef void *Current(void);
    Current *current = (Current *)symbol(RTLD_DEFAULT, "PyGILState_GetThisThreadState");
    double values[OUTPUTS];
    expect(current() == NULL, "no thread state before an instance is made");
    fmi2Component c = initialized();
    advance(c, 0, 1, 1e-9);
    void *state = current();
    long steps = 0, reads = 0;
    for (long n = 1; n <= count; n++) {
        advance(c, n, n + 1, 1e-9);
        steps += !state || current() != state;
        read_outputs(c, values);
        reads += !state || current() != state;
    }
    printf("states_made_by_steps %ld\nstates_made_by_reads %ld\n", steps, reads);
    discard(c);
    printf("state_at_the_end %d\n", current() != NULL);
}

#ifndef _WIN32
/* A host that forks while nothing else runs: child and parent each go on. */
static void task_fork(void)
{
    double values[OUTPUTS], received[OUTPUTS];
    int status = 0;
    fmi2Component c = initialized();
    advance(c, 0, 100, 1e-6);
    int ends[2];
    expect(pipe(ends) == 0, "a pipe");
    pid_t child = fork();
    if (child == 0) {
        advance(c, 100, 5000, 1e-6);
        read_outputs(c, received);
        _exit(write(ends[1], received, sizeof received) != sizeof received);
    }
    waitpid(child, &status, 0);
    expect(status == 0, "the child ended well");
    advance(c, 100, 5000, 1e-6);
    read_outputs(c, values);
    expect(read(ends[0], received, sizeof received) == sizeof received, "the child's outputs");
    expect(!memcmp(values, received, sizeof values), "child and parent have the same outputs");
    print_outputs(values);
    discard(c);
}
#else
static void task_fork(void) { fail("not on Windows"); }
#endif

int main(int argc, char **argv)
{
    read_arguments(&argc, &argv);
    if (argc < 4) fail("usage: host FOLDER GUID TASK [ARGUMENT]");
    double argument = argc > 4 ? atof(argv[4]) : 1e-6;
    const char *task = argv[3], *libpython = getenv("LIBPYTHON");
    folder = argv[1], guid = argv[2];
    if (libpython && !dlopen(libpython, RTLD_NOW | RTLD_GLOBAL)) fail(dlerror());
    library = load(folder, "ClubBallImpact");
    if (!strcmp(task, "impact")) task_impact(argument);
    else if (!strcmp(task, "migrate")) task_migrate();
    else if (!strcmp(task, "gone")) task_gone((long)argument);
    else if (!strcmp(task, "fork")) task_fork();
    else if (!strcmp(task, "state")) task_state((long)argument);
    else fail("unknown task");
    puts("done");
    return 0;
}
