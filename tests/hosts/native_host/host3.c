/* A host of one FMU (FMI 3.0) on any platform.

   usage: host3 FOLDER TOKEN
   Prints "name value" lines: the results of co-simulation by law, with early return, after a state is
   restored, and in other threads. */

#include "fmu.h"
#include "fmi3FunctionTypes.h"

#include <pthread.h>

static void *library;
static const char *folder, *token;
static int errors;

#define FMU(name, ...) (CALL(library, name)(__VA_ARGS__))
#define EXPECT(name, ...)                                                                          \
    do {                                                                                           \
        if (FMU(name, __VA_ARGS__) != fmi3OK) fail(#name);                                         \
    } while (0)

static void count_errors(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                         fmi3String message)
{
    (void)environment, (void)category;
    errors += status == fmi3Error && strstr(message, "k = -1 N/m is refused");
}

static void set(fmi3Instance c, unsigned reference, double value)
{
    EXPECT(fmi3SetFloat64, c, &reference, 1, &value, 1);
}

static double get(fmi3Instance c, unsigned reference)
{
    double value;
    EXPECT(fmi3GetFloat64, c, &reference, 1, &value, 1);
    return value;
}

static void print_results(const char *name, fmi3Instance c)
{
    printf("%s_S %.17g\n%s_COR %.17g\n", name, get(c, VR_smash_factor), name,
           get(c, VR_coefficient_of_restitution));
}

static fmi3Instance make(int early, fmi3Int64 law, double gap)
{
    unsigned reference = VR_law;
    fmi3Instance c = FMU(fmi3InstantiateCoSimulation, "cs", token, NULL, 0, 1, early, early, NULL,
                         0, NULL, count_errors, NULL);
    if (!c) fail("instantiate");
    EXPECT(fmi3EnterInitializationMode, c, 0, 0.0, 0.0, 0, 0.0);
    EXPECT(fmi3SetInt64, c, &reference, 1, &law, 1);
    set(c, VR_gap, gap);
    return c;
}

static fmi3Instance begun(int early, fmi3Int64 law, double gap)
{
    fmi3Instance c = make(early, law, gap);
    EXPECT(fmi3ExitInitializationMode, c);
    if (early) EXPECT(fmi3EnterStepMode, c);
    return c;
}

static void advance(fmi3Instance c, long from, long to, double step)
{
    bool event, terminate, early;
    double last;
    for (long n = from; n < to; n++)
        EXPECT(fmi3DoStep, c, n * step, step, 1, &event, &terminate, &early, &last);
}

/* Until three events or the end: prints when they were. */
static void early_return(void)
{
    fmi3Instance c = begun(1, 2, 0.0035);
    bool event, terminate, early, again, nominals, values, defined;
    double now = 0.0, next;
    int count = 0;
    while (now < 1e-3) {
        EXPECT(fmi3DoStep, c, now, 1e-3 - now, 1, &event, &terminate, &early, &now);
        if (!event) continue;
        printf("event_%d %.17g\n", ++count, now);
        EXPECT(fmi3EnterEventMode, c);
        EXPECT(fmi3UpdateDiscreteStates, c, &again, &terminate, &nominals, &values, &defined, &next);
        EXPECT(fmi3EnterStepMode, c);
    }
    print_results("early", c);
    FMU(fmi3FreeInstance, c);
}

static void *in_thread(void *result)
{
    fmi3Instance c = begun(0, 2, 0.0);
    advance(c, 0, 1000, 1e-6);
    *(double *)result = get(c, VR_smash_factor);
    FMU(fmi3FreeInstance, c);
    return NULL;
}

int main(int argc, char **argv)
{
    double results[3];
    pthread_t threads[3];
    fmi3FMUState state = NULL;
    read_arguments(&argc, &argv);
    if (argc != 3) fail("usage: host3 FOLDER TOKEN");
    folder = argv[1], token = argv[2];
    library = load_binary(folder, BINARY_3, "ClubBallImpact");
    for (int n = 0; n < 3; n++) pthread_create(&threads[n], NULL, in_thread, &results[n]);
    for (int n = 0; n < 3; n++) {
        pthread_join(threads[n], NULL);
        printf("thread_%d %.17g\n", n, results[n]);
    }
    for (fmi3Int64 law = 1; law <= 2; law++) {
        char name[] = {'l', 'a', 'w', (char)('0' + law), 0};
        fmi3Instance c = begun(0, law, 0.0);
        advance(c, 0, 300, 1e-6);
        EXPECT(fmi3GetFMUState, c, &state);
        for (int n = 0; n < 2; n++) {
            advance(c, 300, 1000, 1e-6);
            print_results(n ? "restored" : name, c);
            EXPECT(fmi3SetFMUState, c, state);
        }
        EXPECT(fmi3FreeFMUState, c, &state);
        FMU(fmi3FreeInstance, c);
    }
    early_return();
    fmi3Instance refused = make(0, 1, 0.0);
    FMU(fmi3SetFloat64, refused, (unsigned[]){VR_k}, 1, (double[]){-1.0}, 1);
    printf("refused %d\n", FMU(fmi3ExitInitializationMode, refused) == fmi3Error && errors > 0);
    FMU(fmi3FreeInstance, refused);
    puts("done");
    return 0;
}
