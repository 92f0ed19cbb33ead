/* Ordinary values, the ends of their ranges and refused ones in a host that traps floating-point
   exceptions, without a logger, and NULL for everything.
   usage: traps COUNT SEED; compiled with the FMU's sources, FMI 2.0. */
#define _GNU_SOURCE
#include <fenv.h>
#include <stdio.h>

#include "all.c"

static const double VALUES[] = {
    NAN, INFINITY, -INFINITY, 0.0, -0.0, 1e300, -1e300, 1.7e308, 1.0, 1.5, 12.0,
    35.0, -5.0, 500.0, 1e4, 1e6, 1e10, 0.86, 0.003, 1e-2, 1e-4, 1e-5,
};
static const double SIZES[] = {1e-6, 1e-5, 1e-4, 1e-3, 1.0, 1e10, NAN, -1.0, 1e308};

#define ANY(array) array[rand() % (sizeof array / sizeof *array)]

static void set(fmi2Component c, fmi2ValueReference reference)
{
    int place = place_of(reference), end = rand() % 4;
    double value = ANY(VALUES);
    if (place >= 0 && place < SETTABLE && end < 2) value = end ? TABLE[place].high : TABLE[place].low;
    fmi2SetReal(c, &reference, 1, &value);
}

static void make_step(fmi2Component c, double *point)
{
    double size = ANY(SIZES);
    if (fmi2DoStep(c, rand() % 9 ? *point : ANY(VALUES), size, 1) == fmi2OK) *point += size;
}

/* Of Euler's method. */
static void solve_on(fmi2Component c, double *time)
{
    double size = ANY(SIZES), states[STATES] = {0.0}, slopes[STATES] = {0.0}, values[INDICATORS];
    fmi2EventInfo info;
    fmi2Boolean is_event, is_end;
    fmi2NewDiscreteStates(c, &info);
    fmi2EnterContinuousTimeMode(c);
    fmi2GetContinuousStates(c, states, STATES);
    fmi2GetDerivatives(c, slopes, STATES);
    double size_of_step = isless(0.0, size) && isless(size, 1e6) ? size : 0.0;
    *time += size_of_step;
    fmi2SetTime(c, *time);
    for (int n = 0; n < STATES; n++) {
        double moved_to = states[n] + size_of_step * smaller(1e30, larger(-1e30, slopes[n]));
        if (fabs(moved_to) < 1e6) states[n] = moved_to;
    }
    fmi2SetContinuousStates(c, states, STATES);
    fmi2CompletedIntegratorStep(c, 1, &is_event, &is_end);
    fmi2GetEventIndicators(c, values, INDICATORS);
    fmi2EnterEventMode(c);
}

static void run(void)
{
    int is_solved = rand() % 3 == 0;
    fmi2Type kind = is_solved ? fmi2ModelExchange : fmi2CoSimulation;
    fmi2Component c = fmi2Instantiate(NULL, kind, TOKEN, NULL, NULL, 0, 0);
    fmi2ValueReference law = 8;
    int number = 1 + rand() % 2;
    double point = 0.0, value;
    fmi2SetupExperiment(c, 0, 0.0, 0.0, rand() % 2, ANY(VALUES));
    fmi2EnterInitializationMode(c);
    fmi2SetInteger(c, &law, 1, &number);
    for (int n = rand() % 6; n > 0; n--) set(c, (fmi2ValueReference)(rand() % 41));
    fmi2ExitInitializationMode(c);
    for (int n = 0; n < 20; n++) {
        if (is_solved) solve_on(c, &point);
        else make_step(c, &point);
        if (rand() % 3 == 0) set(c, rand() % 4 ? (fmi2ValueReference)(rand() % 3) : 40);
        for (fmi2ValueReference reference = 13; rand() % 2 && reference < 35; reference++)
            fmi2GetReal(c, &reference, 1, &value);
    }
    fmi2FreeInstance(c);
}

static void call_with_null(fmi2Component c)
{
    fmi2GetReal(c, NULL, 1, NULL);
    fmi2SetReal(c, NULL, 1, NULL);
    fmi2GetString(c, NULL, 1, NULL);
    fmi2GetFMUstate(c, NULL);
    fmi2SetFMUstate(c, NULL);
    fmi2FreeFMUstate(c, NULL);
    fmi2SerializeFMUstate(c, NULL, NULL, 0);
    fmi2DeSerializeFMUstate(c, NULL, 0, NULL);
    fmi2GetRealStatus(c, fmi2LastSuccessfulTime, NULL);
    fmi2DoStep(c, 0.0, 1.0, 1);
    fmi2Reset(c);
}

int main(int count, char **arguments)
{
    (void)count;
    srand((unsigned)atoi(arguments[2]));
    int trapped = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW;
    feenableexcept(trapped);
    for (int n = atoi(arguments[1]); n > 0; n--) run();
    if (fegetexcept() != trapped) return 1;
    fmi2Component c = fmi2Instantiate(NULL, fmi2CoSimulation, TOKEN, NULL, NULL, 0, 0);
    call_with_null(NULL);
    call_with_null(c);
    fmi2FreeInstance(c);
    fmi2FreeInstance(NULL);
    puts("done");
    return 0;
}
