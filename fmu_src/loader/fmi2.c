/* The functions of FMI 2.0, for a slave that is a Python class. */

#include "loader.h"

#include "fmi2FunctionTypes.h"

#define FMI(name) fmi2##name
#define COUNT

/* As FMI 3.0 writes them. */
#define fmi2GetFMUState fmi2GetFMUstate
#define fmi2SetFMUState fmi2SetFMUstate
#define fmi2FreeFMUState fmi2FreeFMUstate
#define fmi2SerializedFMUStateSize fmi2SerializedFMUstateSize
#define fmi2SerializeFMUState fmi2SerializeFMUstate
#define fmi2DeserializeFMUState fmi2DeSerializeFMUstate
#include "functions.h"

/* The text is a format to C hosts; others, fmpy among them, show it as it is and take no arguments.
   So it has no directives. */
static void log_message(Instance *i, int status, const char *category, const char *text)
{
    char format[2048];
    size_t n = 0;
    if (!wanted(i, status, category, text)) return;
    for (; *text && n < sizeof format - 2; text++) {
        format[n++] = *text;
        if (*text == '%') format[n++] = '%';
    }
    format[n] = 0;
    ((fmi2CallbackLogger)i->logger)(i->environment, i->name, (fmi2Status)status, category, format);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *host, fmi2Boolean visible,
                              fmi2Boolean logging)
{
    (void)location, (void)visible;
    return new_instance(name, guid,
                        type == fmi2CoSimulation
                            ? NULL
                            : "fmi2ModelExchange is refused: this FMU is for co-simulation only",
                        host ? host->componentEnvironment : NULL,
                        host ? (void *)host->logger : NULL, logging);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    IN_PYTHON(simple(i, "setup_experiment", PyFloat_FromDouble(start), NULL));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    IN_PYTHON(simple(i, "enter_initialization_mode", NULL, NULL));
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real point, fmi2Real size, fmi2Boolean no_set_prior)
{
    Instance *i = c;
    (void)no_set_prior;
    if (!i) return fmi2Error;
    Entry entry = enter();
    Object *done = call(i, "do_step", PyFloat_FromDouble(point), PyFloat_FromDouble(size));
    int accepted = done ? PyObject_IsTrue(done) : 0;
    Py_DecRef(done);
    int raised = flush(i);
    leave(entry);
    i->refused = !accepted;
    i->reached = accepted ? point + size : point;
    return raised ? (fmi2Status)raised : accepted ? fmi2OK : fmi2Discard;
}

ACCESS(Real, "real", PyFloat_AsDouble, PyFloat_FromDouble)
ACCESS(Integer, "integer", PyLong_AsLongLong, PyLong_FromLongLong)
UNSUPPORTED(SetRealInputDerivatives)
UNSUPPORTED(GetRealOutputDerivatives)
UNSUPPORTED(GetDirectionalDerivative)
UNSUPPORTED(CancelStep)
UNSUPPORTED(GetStatus)

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
