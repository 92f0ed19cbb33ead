/* The functions of FMI 3.0, for a slave that is a Python class: Co-Simulation and Model Exchange.

   Unlike pythonfmu3 0.3.4's, they pass the start time to the slave, and report to the host when a
   step has ended early at an event. */

#include "loader.h"

#include <stdbool.h>

#include "fmi3FunctionTypes.h"

#define FMI(name) fmi3##name
#define COUNT , __attribute__((unused)) size_t value_count
#include "functions.h"

static void log_message(Instance *i, int status, const char *category, const char *text)
{
    if (wanted(i, status, category, text))
        ((fmi3LogMessageCallback)i->logger)(i->environment, (fmi3Status)status, category, text);
}

const char *fmi3GetVersion(void) { return "3.0"; }

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String given, fmi3String location, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
    const fmi3ValueReference intermediate[], size_t intermediate_count,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
    fmi3IntermediateUpdateCallback update)
{
    (void)location, (void)visible, (void)intermediate, (void)intermediate_count, (void)update;
    Instance *i = new_instance(name, given, NULL, environment, (void *)logger, logging);
    if (i) i->event_mode = event_mode, i->early_return = early_return;
    return i;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String given, fmi3String location,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger)
{
    (void)location, (void)visible;
    return new_instance(name, given, NULL, environment, (void *)logger, logging);
}

fmi3Instance fmi3InstantiateScheduledExecution(void) { return NULL; }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    IN_PYTHON(simple(i, "setup_experiment", PyFloat_FromDouble(start), NULL) &&
              simple(i, "enter_initialization_mode", NULL, NULL));
}

/* Modes that don't concern the slave. */
#define MODE(name)                                                                                 \
    fmi3Status name(fmi3Instance c) { return c ? fmi3OK : fmi3Error; }
MODE(fmi3EnterEventMode)
MODE(fmi3EnterStepMode)
MODE(fmi3EnterContinuousTimeMode)
MODE(fmi3EnterConfigurationMode)
MODE(fmi3ExitConfigurationMode)
MODE(fmi3EvaluateDiscreteStates)

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 point, fmi3Float64 size,
                      fmi3Boolean no_set_prior, fmi3Boolean *event, fmi3Boolean *terminate,
                      fmi3Boolean *early, fmi3Float64 *last)
{
    Instance *i = c;
    double reached = point + size;
    int accepted = 0;
    (void)no_set_prior;
    if (!i) return fmi3Error;
    *terminate = fmi3False;
    Entry entry = enter();
    int met = 0;
    Object *done;
    if (i->early_return || i->event_mode) {
        done = PyObject_CallMethod(i->slave, "step_to_event", "ddi", point, size, i->early_return);
        if (done) PyArg_ParseTuple(done, "ppd", &accepted, &met, &reached);
    } else {
        done = call(i, "do_step", PyFloat_FromDouble(point), PyFloat_FromDouble(size));
        if (done) accepted = PyObject_IsTrue(done);
    }
    Py_DecRef(done);
    int raised = flush(i);
    leave(entry);
    *last = accepted ? reached : point;
    *event = met && i->event_mode;
    *early = accepted && reached < point + size;
    return raised ? (fmi3Status)raised : accepted ? fmi3OK : fmi3Discard;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals, fmi3Boolean *jumped,
                                    fmi3Boolean *defined, fmi3Float64 *when)
{
    int stop = 0, values = 0, known = 0, more = 0, scale = 0, read = 0;
    /* In the order of the slave's tuple. */
    IN_PYTHON(TAKE(call(i, "update_discrete_states", NULL, NULL),
                   read = PyArg_ParseTuple(found, "pppdpp", &stop, &values, &known, when, &more,
                                           &scale)),
              *again = more, *terminate = stop, *nominals = scale, *jumped = values,
              *defined = known, read);
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set_prior,
                                       fmi3Boolean *event_mode, fmi3Boolean *terminate)
{
    (void)no_set_prior;
    *event_mode = *terminate = fmi3False;
    return c ? fmi3OK : fmi3Error;
}

/* Values */

/* pythonfmu3 wants these as objects of ctypes. */
static long long from_ctypes(Object *wrapped)
{
    Object *value = PyObject_GetAttrString(wrapped, "value");
    long long number = value ? PyLong_AsLongLong(value) : 0;
    Py_DecRef(value);
    return number;
}

ACCESS(Float64, "float64", PyFloat_AsDouble, PyFloat_FromDouble)
ACCESS(Int32, "int32", PyLong_AsLongLong, PyLong_FromLongLong)
ACCESS(Int64, "int64", PyLong_AsLongLong, PyLong_FromLongLong)
ACCESS(UInt64, "uint64", from_ctypes, PyLong_FromLongLong)

/* Model Exchange */

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time)
{
    IN_PYTHON(simple(i, "set_time", PyFloat_FromDouble(time), NULL));
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 states[], size_t count)
{
    IN_PYTHON(simple(i, "set_continuous_states", LIST(count, PyFloat_FromDouble(states[n])), NULL));
}

#define FLOATS(name, method, argument)                                                             \
    fmi3Status fmi3Get##name(fmi3Instance c, fmi3Float64 values[], size_t count)                   \
    {                                                                                              \
        IN_PYTHON(READ(call(i, method, argument, NULL), count, values, PyFloat_AsDouble(item)));   \
    }
FLOATS(ContinuousStates, "get_continuous_states", NULL)
FLOATS(ContinuousStateDerivatives, "get_continuous_state_derivatives", NULL)
FLOATS(EventIndicators, "get_event_indicators", NULL)
FLOATS(NominalsOfContinuousStates, "get_nominals_of_continuous_states",
       PyLong_FromLongLong((long long)count))

#define NUMBER(name, method)                                                                       \
    fmi3Status fmi3GetNumberOf##name(fmi3Instance c, size_t *count)                                \
    {                                                                                              \
        IN_PYTHON(TAKE(call(i, method, NULL, NULL), *count = (size_t)PyLong_AsLongLong(found)));   \
    }
NUMBER(ContinuousStates, "get_number_of_continuous_states")
NUMBER(EventIndicators, "get_number_of_event_indicators")

/* Functions that the slave doesn't have */

#define UNSUPPORTED_TYPE(name) UNSUPPORTED(Get##name) UNSUPPORTED(Set##name)
UNSUPPORTED_TYPE(Float32)
UNSUPPORTED_TYPE(Int8)
UNSUPPORTED_TYPE(UInt8)
UNSUPPORTED_TYPE(Int16)
UNSUPPORTED_TYPE(UInt16)
UNSUPPORTED_TYPE(UInt32)
UNSUPPORTED_TYPE(Binary)
UNSUPPORTED_TYPE(Clock)
UNSUPPORTED_TYPE(IntervalDecimal)
UNSUPPORTED_TYPE(IntervalFraction)
UNSUPPORTED_TYPE(ShiftDecimal)
UNSUPPORTED_TYPE(ShiftFraction)
UNSUPPORTED(GetDirectionalDerivative)
UNSUPPORTED(GetAdjointDerivative)
UNSUPPORTED(GetOutputDerivatives)
UNSUPPORTED(GetNumberOfVariableDependencies)
UNSUPPORTED(GetVariableDependencies)
UNSUPPORTED(ActivateModelPartition)
