/* The document's impact in sub-steps as an FMU 2.0 for co-simulation, in C, with the variables of
   `stepped_impact.py`: by explicit Euler, the same scheme; compiled with ORDER 4, by the classical Runge-Kutta
   method, whose last sub-step ends where the force is 0. SI units. */

#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

static const double CLUB_SPEED = 35.0, M_CLUB = 0.210, M_BALL = 0.04593, B = 9.0;

/* The variables by reference. */
enum { K, DT, LAW, SMASH_FACTOR, RESTITUTION, EFFICIENCY, VARIABLES };
static const double starts[VARIABLES] = {1e6, 0.5e-6, 1};

typedef struct { double d, v_club, v_ball; } State; /* or its rates */
typedef struct { double k, damper, drag; } Contact;

static inline double force(Contact c, State y) { return c.k * y.d + c.damper * (y.v_club - y.v_ball); }

static inline State rates(Contact c, State y)
{
    double push = force(c, y);
    /* By reciprocals, which are constants: faster than divisions. */
    State rate = {y.v_club - y.v_ball, -(push + c.drag * y.v_club) * (1.0 / M_CLUB), (push - c.drag * y.v_ball) * (1.0 / M_BALL)};
    return rate;
}

static inline State moved(State y, double h, State rate)
{
    State after = {y.d + h * rate.d, y.v_club + h * rate.v_club, y.v_ball + h * rate.v_ball};
    return after;
}

#if ORDER == 4
static inline State stepped(Contact c, State y, double h)
{
    State p = rates(c, y), q = rates(c, moved(y, h / 2, p)), r = rates(c, moved(y, h / 2, q)), s = rates(c, moved(y, h, r));
    return moved(moved(moved(moved(y, h / 6, p), h / 3, q), h / 3, r), h / 6, s);
}
#else
static inline State stepped(Contact c, State y, double h) { return moved(y, h, rates(c, y)); }
#endif

static State after_contact(const double v[], long steps)
{
    Contact c = {v[K], v[LAW] == 2 ? B : 0.0, v[LAW] == 1 ? B : 0.0};
    State y = {0.0, CLUB_SPEED, 0.0}, before = y;
    while (steps-- && force(c, y = stepped(c, y, v[DT])) >= 0.0) before = y;
#if ORDER == 4
    double h = v[DT];
    for (int n = 0; steps >= 0 && n < 5; n++) { /* Newton's method; the force is linear in the state */
        h -= force(c, y) / force(c, rates(c, y));
        y = stepped(c, before, h);
    }
#endif
    return y;
}

fmi2Status fmi2DoStep(fmi2Component component, fmi2Real point, fmi2Real size, fmi2Boolean no_set_before)
{
    double *v = component, u = CLUB_SPEED;
    State y = after_contact(v, (long)(size / v[DT] + 0.5));
    (void)point, (void)no_set_before;
    v[SMASH_FACTOR] = y.v_ball / u;
    v[RESTITUTION] = (y.v_ball - y.v_club) / u;
    v[EFFICIENCY] = (M_CLUB * y.v_club * y.v_club + M_BALL * y.v_ball * y.v_ball) / (M_CLUB * u * u);
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) { return memcpy(c, starts, sizeof starts), fmi2OK; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    fmi2Component c = malloc(sizeof starts);
    (void)name, (void)type, (void)guid, (void)resources, (void)functions, (void)visible, (void)logging;
    if (c) fmi2Reset(c);
    return c;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, const fmi2Real values[])
{
    while (n--)
        if (at[n] < LAW) ((double *)c)[at[n]] = values[n]; else return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference at[], size_t n, const fmi2Integer values[])
{
    while (n--)
        if (at[n] == LAW) ((double *)c)[at[n]] = values[n]; else return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, fmi2Real values[])
{
    while (n--)
        if (at[n] < VARIABLES) values[n] = ((double *)c)[at[n]]; else return fmi2Error;
    return fmi2OK;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

/* Functions that need do nothing, or whose capability the model description denies. */
#define FUNCTION(status, name, ...) \
    fmi2Status fmi2##name(fmi2Component c, ##__VA_ARGS__) { return (void)c, status; }
FUNCTION(fmi2OK, SetupExperiment, fmi2Boolean a, fmi2Real tolerance, fmi2Real begin, fmi2Boolean b, fmi2Real end)
FUNCTION(fmi2OK, EnterInitializationMode)
FUNCTION(fmi2OK, ExitInitializationMode)
FUNCTION(fmi2OK, Terminate)
FUNCTION(fmi2OK, SetDebugLogging, fmi2Boolean on, size_t n, const fmi2String categories[])
FUNCTION(fmi2Error, CancelStep)
FUNCTION(fmi2Error, GetInteger, const fmi2ValueReference at[], size_t n, fmi2Integer values[])
FUNCTION(fmi2Error, GetBoolean, const fmi2ValueReference at[], size_t n, fmi2Boolean values[])
FUNCTION(fmi2Error, GetString, const fmi2ValueReference at[], size_t n, fmi2String values[])
FUNCTION(fmi2Error, SetBoolean, const fmi2ValueReference at[], size_t n, const fmi2Boolean values[])
FUNCTION(fmi2Error, SetString, const fmi2ValueReference at[], size_t n, const fmi2String values[])
FUNCTION(fmi2Error, GetFMUstate, fmi2FMUstate *state)
FUNCTION(fmi2Error, SetFMUstate, fmi2FMUstate state)
FUNCTION(fmi2Error, FreeFMUstate, fmi2FMUstate *state)
FUNCTION(fmi2Error, SerializedFMUstateSize, fmi2FMUstate state, size_t *size)
FUNCTION(fmi2Error, SerializeFMUstate, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
FUNCTION(fmi2Error, DeSerializeFMUstate, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
FUNCTION(fmi2Error, GetDirectionalDerivative, const fmi2ValueReference unknown[], size_t n,
         const fmi2ValueReference known[], size_t m, const fmi2Real seed[], fmi2Real product[])
FUNCTION(fmi2Error, SetRealInputDerivatives, const fmi2ValueReference at[], size_t n, const fmi2Integer order[], const fmi2Real values[])
FUNCTION(fmi2Error, GetRealOutputDerivatives, const fmi2ValueReference at[], size_t n, const fmi2Integer order[], fmi2Real values[])
FUNCTION(fmi2Discard, GetStatus, const fmi2StatusKind kind, fmi2Status *value)
FUNCTION(fmi2Discard, GetRealStatus, const fmi2StatusKind kind, fmi2Real *value)
FUNCTION(fmi2Discard, GetIntegerStatus, const fmi2StatusKind kind, fmi2Integer *value)
FUNCTION(fmi2Discard, GetBooleanStatus, const fmi2StatusKind kind, fmi2Boolean *value)
FUNCTION(fmi2Discard, GetStringStatus, const fmi2StatusKind kind, fmi2String *value)
