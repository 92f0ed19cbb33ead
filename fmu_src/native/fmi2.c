/* The functions of FMI 2.0 for co-simulation, around one component. The build defines TOKEN, the GUID.

   An illegal call returns Error, as Reference-FMUs do: an unknown value reference, setting an output
   or a fixed parameter, a second initialization, a damaged state. A step that a refused value
   prevents returns Discard; it may be made again once that value is corrected. */

#include "fmi2Functions.h"

/* How far (relative to the step) a step may end beyond a defined stop time. */
#define STOP_TOLERANCE 1e-6

typedef struct {
    Component component;
    fmi2CallbackFunctions host;
    char *name;
    double stop_time; /* s; infinite if it isn't defined */
    double reached;   /* where the last accepted step ended, s */
    int is_refused;   /* whether the last step was */
} Instance;

/* A pointer to another thing, or to a state that was freed, doesn't point to itself. */
typedef struct saved {
    struct saved *itself;
    Snapshot is;
} Saved;

/* MESSAGES */

static void send(const fmi2CallbackFunctions *host, const char *name, const char *sentence)
{
    /* A host takes it for a format. */
    char format[2 * SENTENCE_SIZE];
    Text t = {format, format + sizeof format - 1};
    if (!host->logger) return;
    for (; *sentence; sentence++) {
        if (*sentence == '%') put_character(&t, '%');
        put_character(&t, *sentence);
    }
    host->logger(host->componentEnvironment, name, fmi2Error, "logStatusError", format);
}

static void send_report(void *context, const char *sentence)
{
    Instance *i = context;
    send(&i->host, i->name, sentence);
}

static fmi2Status error(Instance *i, const char *sentence)
{
    send(&i->host, i->name, sentence);
    return fmi2Error;
}

static fmi2Status status_of(int is_legal) { return is_legal ? fmi2OK : fmi2Error; }

/* CREATION */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

/* Why no instance is made; empty if it is. */
static void refuse_instance(Text *t, fmi2Type type, const char *guid)
{
    const char *words[] = {guid ? guid : "NULL", TOKEN};
    *t->end = 0;
    if (type != fmi2CoSimulation)
        put(t, "fmi2ModelExchange is refused: this FMU has co-simulation only");
    else if (!guid || strcmp(guid, TOKEN))
        put_sentence(t, "GUID or token = %s is refused: this FMU has %s", words);
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *host, fmi2Boolean visible,
                              fmi2Boolean logging)
{
    static const fmi2CallbackFunctions none = {NULL, NULL, NULL, NULL, NULL};
    char text[SENTENCE_SIZE];
    Text why = {text, text + sizeof text - 1};
    (void)location, (void)visible, (void)logging;
    if (!host) host = &none;
    if (!name) name = "";
    refuse_instance(&why, type, guid);
    Instance *i = *text ? NULL : calloc(1, sizeof *i);
    char *copy = i ? malloc(strlen(name) + 1) : NULL;
    if (!copy) {
        send(host, name, *text ? text : "out of memory");
        free(i);
        return NULL;
    }
    i->host = *host;
    i->name = strcpy(copy, name);
    i->stop_time = INFINITY;
    i->component.report = send_report;
    i->component.context = i;
    component_reset(&i->component);
    return i;
}

void fmi2FreeInstance(fmi2Component c)
{
    Instance *i = c;
    if (!i) return;
    free(i->name);
    free(i);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count,
                               const fmi2String categories[])
{
    /* There are messages on errors alone. */
    (void)on, (void)count, (void)categories;
    return status_of(c != NULL);
}

/* THE RUN */

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start_time, fmi2Boolean has_stop_time, fmi2Real stop_time)
{
    Instance *i = c;
    (void)has_tolerance, (void)tolerance;
    if (!i) return fmi2Error;
    i->stop_time = has_stop_time && !isnan(stop_time) ? stop_time : INFINITY;
    return status_of(component_set_up(&i->component, start_time));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return status_of(c && component_enter_initialization(&((Instance *)c)->component));
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    return status_of(c && component_exit_initialization(&((Instance *)c)->component));
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    if (c) component_terminate(&((Instance *)c)->component);
    return status_of(c != NULL);
}

fmi2Status fmi2Reset(fmi2Component c)
{
    Instance *i = c;
    if (!i) return fmi2Error;
    component_reset(&i->component);
    i->stop_time = INFINITY;
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real point, fmi2Real size, fmi2Boolean no_set_prior)
{
    Instance *i = c;
    (void)no_set_prior;
    if (!i) return fmi2Error;
    if (isfinite(point) && isfinite(size) && point + size > i->stop_time + STOP_TOLERANCE * size)
        return error(i, "a step past the stop time is refused");
    i->is_refused = !component_step(&i->component, point, size);
    i->reached = i->is_refused ? point : point + size;
    return i->is_refused ? fmi2Discard : fmi2OK;
}

/* After a step that was refused: it is to be made again, or the run ends. */
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    if (!c || !value || kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = ((Instance *)c)->reached;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    if (!c || !value || kind != fmi2Terminated) return fmi2Discard;
    *value = ((Instance *)c)->is_refused;
    return fmi2OK;
}

/* VALUES */

#define GET_AND_SET(Name, type, of)                                                                 \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference references[], size_t count,  \
                             type values[])                                                         \
    {                                                                                               \
        int is_legal = 1;                                                                           \
        double value;                                                                               \
        if (!c || (count && (!references || !values))) return fmi2Error;                            \
        for (size_t n = 0; n < count; n++) {                                                        \
            is_legal &= component_get(&((Instance *)c)->component, references[n], of, &value);      \
            values[n] = (type)value;                                                                \
        }                                                                                           \
        return status_of(is_legal);                                                                 \
    }                                                                                               \
                                                                                                    \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference references[], size_t count,  \
                             const type values[])                                                   \
    {                                                                                               \
        int is_legal = 1;                                                                           \
        if (!c || (count && (!references || !values))) return fmi2Error;                            \
        for (size_t n = 0; n < count; n++)                                                          \
            is_legal &= component_set(&((Instance *)c)->component, references[n], values[n], of);   \
        return status_of(is_legal);                                                                 \
    }

GET_AND_SET(Real, fmi2Real, REAL)
GET_AND_SET(Integer, fmi2Integer, ENUMERATION)
GET_AND_SET(Boolean, fmi2Boolean, BOOLEAN)

/* There are no strings: each is refused. */

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference references[], size_t count,
                         fmi2String values[])
{
    double value;
    if (!c || (count && (!references || !values))) return fmi2Error;
    for (size_t n = 0; n < count; n++) {
        component_get(&((Instance *)c)->component, references[n], STRING, &value);
        values[n] = "0";
    }
    return status_of(!count);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference references[], size_t count,
                         const fmi2String values[])
{
    if (!c || (count && (!references || !values))) return fmi2Error;
    for (size_t n = 0; n < count; n++)
        component_set(&((Instance *)c)->component, references[n], 0.0, STRING);
    return status_of(!count);
}

/* STATES */

static const char *const NO_STATE = "a state that isn't one of this FMU is refused";

/* A state that this FMU made; else an error is sent. */
static Saved *saved(Instance *i, fmi2FMUstate state)
{
    Saved *s = state;
    if (!i) return NULL;
    if (s && s->itself == s) return s;
    error(i, NO_STATE);
    return NULL;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    Instance *i = c;
    if (!i || !state) return fmi2Error;
    if (*state && !saved(i, *state)) return fmi2Error;
    Saved *s = *state ? *state : malloc(sizeof *s);
    if (!s) return error(i, "out of memory");
    s->itself = s;
    snapshot_copy(&s->is, &i->component.is);
    *state = s;
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    Instance *i = c;
    Saved *s = state;
    if (!i) return fmi2Error;
    if (!s || s->itself != s) {
        refuse_call(&i->component, refusal(FOREIGN_STATE, 0.0, 0.0));
        return fmi2Error;
    }
    component_restore(&i->component, &s->is);
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    Instance *i = c;
    if (!i) return fmi2Error;
    if (!state || !*state) return fmi2OK;
    Saved *s = saved(i, *state);
    if (!s) return fmi2Error;
    s->itself = NULL;
    free(s);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    Saved *s = saved(c, state);
    if (!s || !size) return fmi2Error;
    *size = packed(&s->is, NULL);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    Saved *s = saved(c, state);
    if (!s || !bytes) return fmi2Error;
    if (size != packed(&s->is, NULL)) return error(c, "bytes of another size than a state's are refused");
    packed(&s->is, (unsigned char *)bytes);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state)
{
    Instance *i = c;
    if (!i || !bytes || !state) return fmi2Error;
    Saved *s = malloc(sizeof *s);
    if (!s) return error(i, "out of memory");
    s->itself = s;
    if (!unpacked(&s->is, (const unsigned char *)bytes, size)) {
        free(s);
        return error(i, SENTENCES[FOREIGN_STATE]);
    }
    *state = s;
    return fmi2OK;
}

/* FUNCTIONS THAT THIS FMU DOESN'T HAVE */

fmi2Status fmi2CancelStep(fmi2Component c) { return (void)c, fmi2Error; }

#define WITHOUT_STATUS(Name, type)                                                                  \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2StatusKind kind, type *value)               \
    {                                                                                               \
        (void)c, (void)kind, (void)value;                                                           \
        return fmi2Discard;                                                                         \
    }

WITHOUT_STATUS(Status, fmi2Status)
WITHOUT_STATUS(IntegerStatus, fmi2Integer)
WITHOUT_STATUS(StringStatus, fmi2String)

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference references[],
                                       size_t count, const fmi2Integer orders[],
                                       const fmi2Real values[])
{
    (void)c, (void)references, (void)count, (void)orders, (void)values;
    return fmi2Error;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference references[],
                                        size_t count, const fmi2Integer orders[], fmi2Real values[])
{
    (void)c, (void)references, (void)count, (void)orders, (void)values;
    return fmi2Error;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[],
                                        size_t unknown_count, const fmi2ValueReference knowns[],
                                        size_t known_count, const fmi2Real seeds[],
                                        fmi2Real values[])
{
    (void)c, (void)unknowns, (void)unknown_count, (void)knowns, (void)known_count;
    (void)seeds, (void)values;
    return fmi2Error;
}
