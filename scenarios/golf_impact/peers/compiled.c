/* The impact stepped by compiled code, as an FMU 2.0 for co-simulation. SI units.

   ORDER 1: explicit Euler as in the source document, nothing interpolated. ORDER 4: the classical
   Runge-Kutta method; the last step and the one to the largest force are as long as they must be.
   Equations as in problem.py, variables as in compiled.xml. */

#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

#define GUID "{golf-impact-compiled-peer}"

enum { K, B, M_CLUB, M_BALL, CLUB_SPEED, BALL_SPEED, DT, X_CLUB, X_BALL, V_CLUB, V_BALL, TIME, MAX_FORCE, S, COR, E, REALS };

typedef struct {
    double v[REALS]; /* by reference */
    int law, begun, parted;
} Model;

typedef struct { double x_club, x_ball, v_club, v_ball; } State; /* or its rates */

typedef struct { double k, damper, drag, m_club, m_ball; } Law;

static inline double force(Law a, State y)
{
    return a.k * (y.x_club - y.x_ball) + a.damper * (y.v_club - y.v_ball);
}

static inline State rates(Law a, State y)
{
    double f = force(a, y);
    State rate = {y.v_club, y.v_ball, -(f + a.drag * y.v_club) / a.m_club, (f - a.drag * y.v_ball) / a.m_ball};
    return rate;
}

static inline State moved(State y, double h, State rate)
{
    State after = {y.x_club + h * rate.x_club, y.x_ball + h * rate.x_ball,
                   y.v_club + h * rate.v_club, y.v_ball + h * rate.v_ball};
    return after;
}

static inline State step(Law a, State y, double h)
{
    State p = rates(a, y);
    if (ORDER == 1) return moved(y, h, p);
    State q = rates(a, moved(y, h / 2, p)), r = rates(a, moved(y, h / 2, q)), s = rates(a, moved(y, h, r));
    return moved(moved(moved(moved(y, h / 6, p), h / 3, q), h / 3, r), h / 6, s);
}

static inline double rise(Law a, State y) { return force(a, rates(a, y)); }

/* The part of a step h in which a function of the state falls through zero: Illinois method. */
static double crossing(Law a, State y, double h, double (*of)(Law, State))
{
    double low = 0.0, f = of(a, y), high = h, g = of(a, step(a, y, h));
    for (int n = 0; n < 60 && high - low > 1e-15 * h && g < 0.0; n++) {
        double at = f > 0.0 ? high - g * (high - low) / (g - f) : high / 2, value = of(a, step(a, y, at));
        if (value > 0.0) low = at, f = value, g = n % 2 ? g / 2 : g;
        else high = at, g = value, f = n % 2 ? f / 2 : f;
    }
    return high;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real point, fmi2Real size, fmi2Boolean no_set_before)
{
    Model *m = c;
    double *v = m->v, u = v[CLUB_SPEED], w = v[BALL_SPEED], h = v[DT], largest = v[MAX_FORCE], time = v[TIME], f;
    Law a = {v[K], m->law == 2 ? v[B] : 0.0, m->law == 1 ? v[B] : 0.0, v[M_CLUB], v[M_BALL]};
    State y = {v[X_CLUB], v[X_BALL], m->begun ? v[V_CLUB] : u, m->begun ? v[V_BALL] : w}, next;
    (void)point, (void)no_set_before;
    if (!(h > 0.0)) return fmi2Discard;
    if ((f = force(a, y)) > largest) largest = f;
    for (long n = (long)(size / h + 0.5); n > 0 && !m->parted; n--, y = next, time += h) {
        next = step(a, y, h);
        if (ORDER > 1 && rise(a, next) <= 0.0 && rise(a, y) > 0.0) {
            f = force(a, step(a, y, crossing(a, y, h, rise)));
            if (f > largest) largest = f;
        }
        f = force(a, next);
        if (f > largest) largest = f;
        if (f >= 0.0) continue;
        m->parted = 1;
        if (ORDER > 1) next = step(a, y, h = crossing(a, y, h, force));
    }
    m->begun = 1, v[TIME] = time, v[MAX_FORCE] = largest;
    v[X_CLUB] = y.x_club, v[X_BALL] = y.x_ball, v[V_CLUB] = y.v_club, v[V_BALL] = y.v_ball;
    v[S] = y.v_ball / u, v[COR] = (y.v_ball - y.v_club) / (u - w);
    v[E] = (a.m_club * y.v_club * y.v_club + a.m_ball * y.v_ball * y.v_ball) / (a.m_club * u * u + a.m_ball * w * w);
    return fmi2OK;
}

static void start(Model *m)
{
    static const Model fresh = {{1e6, 9.0, 0.210, 0.04593, 35.0, 0.0, 5e-7}, 1, 0, 0};
    *m = fresh;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging)
{
    Model *m = type == fmi2CoSimulation && !strcmp(guid, GUID) ? malloc(sizeof *m) : NULL;
    (void)name, (void)resources, (void)functions, (void)visible, (void)logging;
    if (m) start(m);
    return m;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2Reset(fmi2Component c) { return start(c), fmi2OK; }

/* What varies by reference: Reals as in the enumeration, and `law` after them. */
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, const fmi2Real values[])
{
    while (n--)
        if (at[n] < X_CLUB) ((Model *)c)->v[at[n]] = values[n]; else return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, fmi2Real values[])
{
    while (n--)
        if (at[n] < REALS) values[n] = ((Model *)c)->v[at[n]]; else return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference at[], size_t n, const fmi2Integer values[])
{
    while (n--)
        if (at[n] == REALS) ((Model *)c)->law = values[n]; else return fmi2Error;
    return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!*state && !(*state = malloc(sizeof(Model)))) return fmi2Error;
    return *(Model *)*state = *(Model *)c, fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { return *(Model *)c = *(Model *)state, fmi2OK; }
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) { return (void)c, free(*state), *state = NULL, fmi2OK; }

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

/* Functions of FMI that an impact doesn't need. */
#define ALWAYS(status, name, ...) \
    fmi2Status fmi2##name(fmi2Component c, ##__VA_ARGS__) { return (void)c, status; }
ALWAYS(fmi2OK, SetDebugLogging, fmi2Boolean on, size_t n, const fmi2String categories[])
ALWAYS(fmi2OK, SetupExperiment, fmi2Boolean a, fmi2Real tolerance, fmi2Real begin, fmi2Boolean b, fmi2Real end)
ALWAYS(fmi2OK, EnterInitializationMode)
ALWAYS(fmi2OK, ExitInitializationMode)
ALWAYS(fmi2OK, Terminate)
ALWAYS(fmi2Error, CancelStep)
ALWAYS(fmi2Error, GetInteger, const fmi2ValueReference at[], size_t n, fmi2Integer values[])
ALWAYS(fmi2Error, GetBoolean, const fmi2ValueReference at[], size_t n, fmi2Boolean values[])
ALWAYS(fmi2Error, GetString, const fmi2ValueReference at[], size_t n, fmi2String values[])
ALWAYS(fmi2Error, SetBoolean, const fmi2ValueReference at[], size_t n, const fmi2Boolean values[])
ALWAYS(fmi2Error, SetString, const fmi2ValueReference at[], size_t n, const fmi2String values[])
ALWAYS(fmi2Error, SerializedFMUstateSize, fmi2FMUstate state, size_t *size)
ALWAYS(fmi2Error, SerializeFMUstate, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
ALWAYS(fmi2Error, DeSerializeFMUstate, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
ALWAYS(fmi2Error, GetDirectionalDerivative, const fmi2ValueReference unknown[], size_t n,
       const fmi2ValueReference known[], size_t m, const fmi2Real seed[], fmi2Real product[])
ALWAYS(fmi2Error, SetRealInputDerivatives, const fmi2ValueReference at[], size_t n, const fmi2Integer order[], const fmi2Real values[])
ALWAYS(fmi2Error, GetRealOutputDerivatives, const fmi2ValueReference at[], size_t n, const fmi2Integer order[], fmi2Real values[])
ALWAYS(fmi2Discard, GetStatus, const fmi2StatusKind kind, fmi2Status *value)
ALWAYS(fmi2Discard, GetRealStatus, const fmi2StatusKind kind, fmi2Real *value)
ALWAYS(fmi2Discard, GetIntegerStatus, const fmi2StatusKind kind, fmi2Integer *value)
ALWAYS(fmi2Discard, GetBooleanStatus, const fmi2StatusKind kind, fmi2Boolean *value)
ALWAYS(fmi2Discard, GetStringStatus, const fmi2StatusKind kind, fmi2String *value)
