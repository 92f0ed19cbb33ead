/* Calls as fmusim of the Reference-FMUs does, by its simulation loops (FMI 2.0 co-simulation, FMI 3.0
   co-simulation with event mode and early return, FMI 3.0 Model Exchange with its Euler solver):
   every function is looked up at the start, logging is off, start values are set one by one before
   initialization, outputs are sampled at the start, and a state from a file takes the place of the
   initialization.

   usage: fmusim FOLDER TOKEN 2cs|3cs|3me START STOP INTERVAL [STATE_IN|- [STATE_OUT]]

   Prints four outputs and how many communication points or events there were. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

#define FMI2(X)                                                                                    \
    X(GetTypesPlatform) X(GetVersion) X(SetDebugLogging) X(Instantiate) X(FreeInstance)            \
    X(SetupExperiment) X(EnterInitializationMode) X(ExitInitializationMode) X(Terminate) X(Reset)  \
    X(GetReal) X(GetInteger) X(GetBoolean) X(GetString) X(SetReal) X(SetInteger) X(SetBoolean)     \
    X(SetString) X(GetFMUstate) X(SetFMUstate) X(FreeFMUstate) X(SerializedFMUstateSize)           \
    X(SerializeFMUstate) X(DeSerializeFMUstate) X(GetDirectionalDerivative)                        \
    X(SetRealInputDerivatives) X(GetRealOutputDerivatives) X(DoStep) X(CancelStep) X(GetStatus)    \
    X(GetRealStatus) X(GetIntegerStatus) X(GetBooleanStatus) X(GetStringStatus)

#define FMI3(X)                                                                                    \
    X(GetVersion) X(SetDebugLogging) X(InstantiateModelExchange) X(InstantiateCoSimulation)        \
    X(InstantiateScheduledExecution) X(FreeInstance) X(EnterInitializationMode)                    \
    X(ExitInitializationMode) X(EnterEventMode) X(Terminate) X(Reset) X(GetFloat32) X(GetFloat64)  \
    X(GetInt8) X(GetUInt8) X(GetInt16) X(GetUInt16) X(GetInt32) X(GetUInt32) X(GetInt64)           \
    X(GetUInt64) X(GetBoolean) X(GetString) X(GetBinary) X(GetClock) X(SetFloat32) X(SetFloat64)   \
    X(SetInt8) X(SetUInt8) X(SetInt16) X(SetUInt16) X(SetInt32) X(SetUInt32) X(SetInt64)           \
    X(SetUInt64) X(SetBoolean) X(SetString) X(SetBinary) X(SetClock)                               \
    X(GetNumberOfVariableDependencies) X(GetVariableDependencies) X(GetFMUState) X(SetFMUState)    \
    X(FreeFMUState) X(SerializedFMUStateSize) X(SerializeFMUState) X(DeserializeFMUState)          \
    X(GetDirectionalDerivative) X(GetAdjointDerivative) X(EnterConfigurationMode)                  \
    X(ExitConfigurationMode) X(GetIntervalDecimal) X(GetIntervalFraction) X(GetShiftDecimal)       \
    X(GetShiftFraction) X(SetIntervalDecimal) X(SetIntervalFraction) X(EvaluateDiscreteStates)     \
    X(UpdateDiscreteStates) X(EnterContinuousTimeMode) X(CompletedIntegratorStep) X(SetTime)       \
    X(SetContinuousStates) X(GetContinuousStateDerivatives) X(GetEventIndicators)                  \
    X(GetContinuousStates) X(GetNominalsOfContinuousStates) X(GetNumberOfEventIndicators)          \
    X(GetNumberOfContinuousStates) X(EnterStepMode) X(GetOutputDerivatives) X(DoStep)              \
    X(ActivateModelPartition)

#define X(name) fmi2##name##TYPE *name;
static struct { FMI2(X) } two;
#undef X
#define X(name) fmi3##name##TYPE *name;
static struct { FMI3(X) } three;
#undef X

enum { OUTPUTS = 4 };
static const unsigned outputs[OUTPUTS] = {VR_smash_factor, VR_coefficient_of_restitution,
                                          VR_club_velocity, VR_ball_velocity};
static double values[OUTPUTS];
static long points, events;
static double start, stop, interval;
static const char *token, *state_in, *state_out;
static char location[4096];
static int said;

static void fail(const char *what)
{
    fprintf(stderr, "failed: %s\n", what);
    exit(1);
}

#define OK(call)                                                                                   \
    do {                                                                                           \
        if (call) fail(#call);                                                                     \
    } while (0)

static int close_to(double a, double b)
{
    return fabs(a - b) <= 1e-14 * (1.0 + fabs(a) + fabs(b));
}

static char *content(const char *name, size_t *size)
{
    static char bytes[1 << 16];
    FILE *file = fopen(name, "rb");
    if (!file) fail(name);
    *size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    return bytes;
}

static void write_content(const char *name, const char *bytes, size_t size)
{
    FILE *file = fopen(name, "wb");
    if (!file || fwrite(bytes, 1, size, file) != size || fclose(file)) fail(name);
}

/* FMI 2.0 co-simulation */

static void logger2(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status,
                    fmi2String category, fmi2String message, ...)
{
    (void)environment, (void)name, (void)status, (void)category, (void)message;
    said++;
}

static void sample2(fmi2Component c)
{
    const unsigned law = VR_law, flags[] = {VR_touched, VR_in_contact, VR_separated};
    fmi2Integer integer;
    fmi2Boolean booleans[3];
    OK(two.GetReal(c, outputs, OUTPUTS, values));
    OK(two.GetInteger(c, &law, 1, &integer));
    OK(two.GetBoolean(c, flags, 3, booleans));
    points++;
}

static void simulate2cs(void)
{
    static int environment;
    const fmi2CallbackFunctions callbacks = {logger2, calloc, free, NULL, &environment};
    const unsigned references[] = {VR_k, VR_b};
    const double start_values[] = {1e6, 9.0};
    fmi2FMUstate state = NULL;
    size_t size = 0;
    double time = start;
    if (strcmp(two.GetVersion(), "2.0") || strcmp(two.GetTypesPlatform(), "default"))
        fail("version");
    fmi2Component c =
        two.Instantiate("instance1", fmi2CoSimulation, token, location, &callbacks, 0, 0);
    if (!c) fail("instantiate");
    if (state_in) {
        char *bytes = content(state_in, &size);
        OK(two.DeSerializeFMUstate(c, bytes, size, &state));
        OK(two.SetFMUstate(c, state));
        OK(two.FreeFMUstate(c, &state));
    } else {
        for (int n = 0; n < 2; n++) OK(two.SetReal(c, &references[n], 1, &start_values[n]));
        OK(two.SetupExperiment(c, fmi2True, 1e-6, start, fmi2True, stop));
        OK(two.EnterInitializationMode(c));
        OK(two.SetReal(c, &references[1], 1, &start_values[1]));
        OK(two.ExitInitializationMode(c));
    }
    sample2(c);
    for (long n = 0; time < stop && !close_to(time, stop); n++) {
        double next = start + (n + 1) * interval;
        if (next > stop && !close_to(next, stop)) next = stop;
        OK(two.SetReal(c, &references[1], 1, &start_values[1]));
        OK(two.DoStep(c, time, next - time, fmi2True));
        time = next;
        sample2(c);
    }
    if (state_out) {
        static char bytes[1 << 16];
        OK(two.GetFMUstate(c, &state));
        OK(two.SerializedFMUstateSize(c, state, &size));
        if (size > sizeof bytes) fail("size");
        OK(two.SerializeFMUstate(c, state, bytes, size));
        write_content(state_out, bytes, size);
        OK(two.FreeFMUstate(c, &state));
    }
    /* A step that isn't carried out: fmusim asks how far it came, and whether that is the end. */
    fmi2Real reached = -1.0;
    fmi2Boolean ended = 0;
    if (two.DoStep(c, time, -1.0, fmi2True) != fmi2Discard) fail("a step back is discarded");
    OK(two.GetRealStatus(c, fmi2LastSuccessfulTime, &reached));
    OK(two.GetBooleanStatus(c, fmi2Terminated, &ended));
    if (reached != time || !ended) fail("status");
    OK(two.Terminate(c));
    two.FreeInstance(c);
}

/* FMI 3.0 */

static void logger3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                    fmi3String message)
{
    (void)environment, (void)status, (void)category, (void)message;
    said++;
}

static void sample3(fmi3Instance c)
{
    const unsigned law = VR_law, flags[] = {VR_touched, VR_in_contact, VR_separated};
    fmi3Int64 integer;
    fmi3Boolean booleans[3];
    OK(three.GetFloat64(c, outputs, OUTPUTS, values, OUTPUTS));
    OK(three.GetInt64(c, &law, 1, &integer, 1));
    OK(three.GetBoolean(c, flags, 3, booleans, 3));
    points++;
}

static void update3(fmi3Instance c)
{
    fmi3Boolean again, end, nominals, jumped, defined;
    fmi3Float64 when;
    do {
        OK(three.UpdateDiscreteStates(c, &again, &end, &nominals, &jumped, &defined, &when));
        if (end) fail("it wants to end");
    } while (again);
}

static void initialize3(fmi3Instance c)
{
    const unsigned references[] = {VR_k, VR_b};
    const double start_values[] = {1e6, 9.0};
    if (!c) fail("instantiate");
    for (int n = 0; n < 2; n++) OK(three.SetFloat64(c, &references[n], 1, &start_values[n], 1));
    OK(three.EnterInitializationMode(c, true, 1e-6, start, false, 0.0));
    OK(three.SetFloat64(c, &references[1], 1, &start_values[1], 1));
    OK(three.ExitInitializationMode(c));
    update3(c);
}

static void simulate3cs(void)
{
    static int environment;
    fmi3FMUState state = NULL;
    size_t size = 0;
    double time = start;
    fmi3Instance c = three.InstantiateCoSimulation("instance1", token, location, false, false, true,
                                                   true, NULL, 0, &environment, logger3, NULL);
    if (state_in) {
        char *bytes = content(state_in, &size);
        OK(three.DeserializeFMUState(c, (fmi3Byte *)bytes, size, &state));
        OK(three.SetFMUState(c, state));
        OK(three.FreeFMUState(c, &state));
    } else {
        initialize3(c);
        OK(three.EnterStepMode(c));
    }
    sample3(c);
    for (long n = 0; time < stop && !close_to(time, stop);) {
        double regular = start + (n + 1) * interval, last;
        fmi3Boolean event, end, early;
        OK(three.DoStep(c, time, regular - time, true, &event, &end, &early, &last));
        if (end) fail("it wants to end");
        time = early && last < regular ? last : regular;
        if (time == regular) n++;
        sample3(c);
        if (event) {
            OK(three.EnterEventMode(c));
            update3(c);
            OK(three.EnterStepMode(c));
            events++;
        }
    }
    if (state_out) {
        static fmi3Byte bytes[1 << 16];
        OK(three.GetFMUState(c, &state));
        OK(three.SerializedFMUStateSize(c, state, &size));
        if (size > sizeof bytes) fail("size");
        OK(three.SerializeFMUState(c, state, bytes, size));
        write_content(state_out, (char *)bytes, size);
        OK(three.FreeFMUState(c, &state));
    }
    OK(three.Terminate(c));
    three.FreeInstance(c);
}

static void simulate3me(void)
{
    enum { STATES = 4, INDICATORS = 2 };
    static int environment;
    double states[STATES], slopes[STATES], nominals[STATES], before[INDICATORS], after[INDICATORS];
    size_t state_count = 0, indicator_count = 0;
    fmi3Boolean event, end;
    fmi3Instance c = three.InstantiateModelExchange("instance1", token, location, false, false,
                                                    &environment, logger3);
    initialize3(c);
    OK(three.EnterContinuousTimeMode(c));
    OK(three.GetNumberOfContinuousStates(c, &state_count));
    OK(three.GetNumberOfEventIndicators(c, &indicator_count));
    if (state_count != STATES || indicator_count != INDICATORS) fail("sizes");
    OK(three.GetNominalsOfContinuousStates(c, nominals, STATES));
    OK(three.GetEventIndicators(c, before, INDICATORS));
    sample3(c);
    long steps = (long)((stop - start) / interval + 0.5);
    for (long n = 0; n < steps; n++) {
        OK(three.GetContinuousStates(c, states, STATES));
        OK(three.GetContinuousStateDerivatives(c, slopes, STATES));
        for (int k = 0; k < STATES; k++) states[k] += interval * slopes[k];
        OK(three.SetTime(c, start + (n + 1) * interval));
        OK(three.SetContinuousStates(c, states, STATES));
        OK(three.GetEventIndicators(c, after, INDICATORS));
        OK(three.CompletedIntegratorStep(c, true, &event, &end));
        for (int k = 0; k < INDICATORS; k++) event |= (before[k] > 0) != (after[k] > 0);
        if (event) {
            OK(three.EnterEventMode(c));
            update3(c);
            OK(three.EnterContinuousTimeMode(c));
            OK(three.GetEventIndicators(c, after, INDICATORS));
            events++;
        }
        memcpy(before, after, sizeof before);
    }
    sample3(c);
    OK(three.Terminate(c));
    three.FreeInstance(c);
}

int main(int argc, char **argv)
{
    static char file[4200];
    if (argc < 7) fail("usage: fmusim FOLDER TOKEN 2cs|3cs|3me START STOP INTERVAL [IN [OUT]]");
    const char *kind = argv[3];
    token = argv[2];
    start = atof(argv[4]), stop = atof(argv[5]), interval = atof(argv[6]);
    if (argc > 7 && strcmp(argv[7], "-")) state_in = argv[7];
    if (argc > 8) state_out = argv[8];
    int second = kind[0] == '2';
    snprintf(location, sizeof location, "%s%s/resources/", second ? "file://" : "", argv[1]);
    const char *platform = second ? "linux64" : "x86_64-linux";
    snprintf(file, sizeof file, "%s/binaries/%s/ClubBallImpact.so", argv[1], platform);
    void *library = dlopen(file, RTLD_LAZY);
    if (!library) fail(dlerror());
#define X(name)                                                                                    \
    if (!(*(void **)&two.name = dlsym(library, "fmi2" #name)) && second) fail(#name);
    FMI2(X)
#undef X
#define X(name)                                                                                    \
    if (!(*(void **)&three.name = dlsym(library, "fmi3" #name)) && !second) fail(#name);
    FMI3(X)
#undef X
    if (second) simulate2cs();
    else if (!strcmp(kind, "3cs")) simulate3cs();
    else simulate3me();
    if (said) fail("something was said, though logging is off");
    printf("smash_factor %.17g\ncoefficient_of_restitution %.17g\n", values[0], values[1]);
    printf("club_velocity %.17g\nball_velocity %.17g\n", values[2], values[3]);
    printf("points %ld\nevents %ld\ndone\n", points, events);
    return 0;
}
