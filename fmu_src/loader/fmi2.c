/* The functions of FMI 2.0, for a slave that is a Python class. */

#include "loader.h"

#include "fmi2FunctionTypes.h"

static int wanted(const Instance *i, const char *category)
{
    if (!i->logging) return 0;
    for (size_t n = 0; n < i->category_count; n++)
        if (!strcmp(i->categories[n], category)) return 1;
    return !i->category_count;
}

/* The text is a format to C hosts; others, fmpy among them, show it as it is and take no arguments.
   So it has no directives. */
static void say(Instance *i, int status, const char *category, const char *text)
{
    char format[2048];
    size_t n = 0;
    if (!i->logger || (status != fmi2Fatal && !wanted(i, category))) return;
    for (; *text && n < sizeof format - 2; text++) {
        format[n++] = *text;
        if (*text == '%') format[n++] = '%';
    }
    format[n] = 0;
    ((fmi2CallbackLogger)i->logger)(i->environment, i->name, (fmi2Status)status, category, format);
}

/* The body of a function: the statement is true if Python raises nothing. */
#define IN_PYTHON(statement)                                                                       \
    do {                                                                                           \
        Instance *i = c;                                                                           \
        if (!i) return fmi2Error;                                                                  \
        int outer = enter();                                                                       \
        int fine = (statement);                                                                    \
        fine = flush(i, fmi2Fatal) && fine;                                                        \
        leave(outer);                                                                              \
        return fine ? fmi2OK : fmi2Fatal;                                                          \
    } while (0)

static fmi2Status unsupported(Instance *i, const char *name)
{
    char text[100];
    snprintf(text, sizeof text, "%s isn't supported", name);
    if (i) say(i, fmi2Error, "logStatusError", text);
    return fmi2Error;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *host, fmi2Boolean visible,
                              fmi2Boolean logging)
{
    (void)type, (void)guid, (void)location, (void)visible;
    return new_instance(name, host ? host->componentEnvironment : NULL,
                        host ? (void *)host->logger : NULL, logging, fmi2Fatal);
}

void fmi2FreeInstance(fmi2Component c) { free_instance(c); }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count,
                               const fmi2String categories[])
{
    if (!c) return fmi2Error;
    set_logging(c, on, count, categories);
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    IN_PYTHON(simple(i, "setup_experiment", PyFloat_FromDouble(start)));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    IN_PYTHON(simple(i, "enter_initialization_mode", NULL));
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    IN_PYTHON(simple(i, "exit_initialization_mode", NULL));
}

fmi2Status fmi2Terminate(fmi2Component c) { IN_PYTHON(simple(i, "terminate", NULL)); }
fmi2Status fmi2Reset(fmi2Component c) { IN_PYTHON(new_slave(i)); }

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real point, fmi2Real size, fmi2Boolean no_set_prior)
{
    Instance *i = c;
    (void)no_set_prior;
    if (!i) return fmi2Error;
    int outer = enter();
    Object *done = call(i, "do_step", PyFloat_FromDouble(point), PyFloat_FromDouble(size));
    int accepted = done ? PyObject_IsTrue(done) : 0;
    Py_DecRef(done);
    int fine = flush(i, fmi2Fatal);
    leave(outer);
    i->refused = !accepted;
    i->reached = accepted ? point + size : point;
    return !fine ? fmi2Fatal : accepted ? fmi2OK : fmi2Discard;
}

/* Values */

#define ACCESS(Name, name, type, to_c, to_python)                                                  \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference references[], size_t count, \
                             type values[])                                                        \
    {                                                                                              \
        IN_PYTHON(READ(i, "get_" name, references, count, values, (type)to_c(item)));              \
    }                                                                                              \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference references[], size_t count, \
                             const type values[])                                                  \
    {                                                                                              \
        IN_PYTHON(WRITE(i, "set_" name, references, count, to_python(values[n])));                 \
    }
ACCESS(Real, "real", fmi2Real, PyFloat_AsDouble, PyFloat_FromDouble)
ACCESS(Integer, "integer", fmi2Integer, PyLong_AsLongLong, PyLong_FromLongLong)
ACCESS(Boolean, "boolean", fmi2Boolean, PyObject_IsTrue, PyBool_FromLong)

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference references[], size_t count,
                         fmi2String values[])
{
    IN_PYTHON(read_strings(i, references, count, values));
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference references[], size_t count,
                         const fmi2String values[])
{
    IN_PYTHON(WRITE(i, "set_string", references, count, PyUnicode_FromString(values[n])));
}

/* State */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) { IN_PYTHON(get_state(i, state)); }
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { IN_PYTHON(set_state(i, state)); }
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) { IN_PYTHON((free_state(s), 1)); }

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    IN_PYTHON(state_size(i, state, size));
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte data[], size_t size)
{
    IN_PYTHON(serialize(i, state, data, size));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte data[], size_t size,
                                   fmi2FMUstate *state)
{
    IN_PYTHON(deserialize(i, data, size, state));
}

/* What the slave hasn't got. Which arguments doesn't matter. */

#define UNSUPPORTED(name)                                                                          \
    fmi2Status name(fmi2Component c) { return unsupported(c, #name); }
UNSUPPORTED(fmi2SetRealInputDerivatives)
UNSUPPORTED(fmi2GetRealOutputDerivatives)
UNSUPPORTED(fmi2GetDirectionalDerivative)
UNSUPPORTED(fmi2CancelStep)
UNSUPPORTED(fmi2GetStatus)

/* About the last step only: there are no pending ones. */
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    if (!c || kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = ((Instance *)c)->reached;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    if (!c || kind != fmi2Terminated) return fmi2Discard;
    *value = ((Instance *)c)->refused;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(void) { return fmi2Discard; }
fmi2Status fmi2GetStringStatus(void) { return fmi2Discard; }
