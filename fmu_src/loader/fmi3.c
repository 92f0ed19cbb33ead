/* The functions of FMI 3.0, for a slave that is a Python class: Co-Simulation and Model Exchange.

   Unlike pythonfmu3 0.3.4's, they tell the slave the start time, and the host when a step has ended
   early at an event. */

#include "loader.h"

#include <stdbool.h>

#include "fmi3FunctionTypes.h"

static void say(Instance *i, int status, const char *category, const char *text)
{
    /* Whatever is said is about values or steps: not for debugging. */
    if (i->logger)
        ((fmi3LogMessageCallback)i->logger)(i->environment, (fmi3Status)status, category, text);
}

/* The body of a function: the statement is true if Python raises nothing. */
#define IN_PYTHON(statement)                                                                       \
    do {                                                                                           \
        Instance *i = c;                                                                           \
        if (!i) return fmi3Error;                                                                  \
        int outer = enter();                                                                       \
        int fine = (statement);                                                                    \
        fine = flush(i, fmi3Fatal) && fine;                                                        \
        leave(outer);                                                                              \
        return fine ? fmi3OK : fmi3Fatal;                                                          \
    } while (0)

const char *fmi3GetVersion(void) { return "3.0"; }

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String location, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
    const fmi3ValueReference intermediate[], size_t intermediate_count,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
    fmi3IntermediateUpdateCallback update)
{
    (void)token, (void)location, (void)visible, (void)intermediate, (void)intermediate_count;
    (void)update;
    Instance *i = new_instance(name, environment, (void *)logger, logging, fmi3Fatal);
    if (i) i->event_mode = event_mode, i->early_return = early_return;
    return i;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String location,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger)
{
    (void)token, (void)location, (void)visible;
    return new_instance(name, environment, (void *)logger, logging, fmi3Fatal);
}

fmi3Instance fmi3InstantiateScheduledExecution(void) { return NULL; }
void fmi3FreeInstance(fmi3Instance c) { free_instance(c); }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t count,
                               const fmi3String categories[])
{
    if (!c) return fmi3Error;
    set_logging(c, on, count, categories);
    return fmi3OK;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    IN_PYTHON(simple(i, "setup_experiment", PyFloat_FromDouble(start)) &&
              simple(i, "enter_initialization_mode", NULL));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    IN_PYTHON(simple(i, "exit_initialization_mode", NULL));
}

fmi3Status fmi3Terminate(fmi3Instance c) { IN_PYTHON(simple(i, "terminate", NULL)); }
fmi3Status fmi3Reset(fmi3Instance c) { IN_PYTHON(new_slave(i)); }

/* Modes that the slave needn't know of. */
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
    int outer = enter(), met = 0;
    Object *done = call(i, i->early_return ? "step_to_event" : "do_step",
                        PyFloat_FromDouble(point), PyFloat_FromDouble(size));
    if (done && i->early_return) PyArg_ParseTuple(done, "ppd", &accepted, &met, &reached);
    else if (done) accepted = PyObject_IsTrue(done);
    Py_DecRef(done);
    int fine = flush(i, fmi3Fatal);
    leave(outer);
    *last = accepted ? reached : point;
    *event = met && i->event_mode;
    *early = accepted && reached < point + size;
    return !fine ? fmi3Fatal : accepted ? fmi3OK : fmi3Discard;
}

static int discrete_states(Instance *i, fmi3Boolean *again, fmi3Boolean *terminate,
                           fmi3Boolean *nominals, fmi3Boolean *jumped, fmi3Boolean *defined,
                           fmi3Float64 *when)
{
    int stop = 0, values = 0, known = 0, more = 0, scale = 0;
    Object *found = call(i, "update_discrete_states", NULL, NULL);
    /* In the order of the slave's tuple. */
    int fine = found && PyArg_ParseTuple(found, "pppdpp", &stop, &values, &known, when, &more,
                                         &scale);
    Py_DecRef(found);
    *again = more, *terminate = stop, *nominals = scale, *jumped = values, *defined = known;
    return fine;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals, fmi3Boolean *jumped,
                                    fmi3Boolean *defined, fmi3Float64 *when)
{
    IN_PYTHON(discrete_states(i, again, terminate, nominals, jumped, defined, when));
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

#define ACCESS(Name, name, type, to_c, to_python)                                                  \
    fmi3Status fmi3Get##Name(fmi3Instance c, const fmi3ValueReference references[], size_t count,  \
                             type values[], size_t value_count)                                    \
    {                                                                                              \
        (void)value_count;                                                                         \
        IN_PYTHON(READ(i, "get_" name, references, count, values, (type)to_c(item)));              \
    }                                                                                              \
    fmi3Status fmi3Set##Name(fmi3Instance c, const fmi3ValueReference references[], size_t count,  \
                             const type values[], size_t value_count)                              \
    {                                                                                              \
        (void)value_count;                                                                         \
        IN_PYTHON(WRITE(i, "set_" name, references, count, to_python(values[n])));                 \
    }
ACCESS(Float64, "float64", fmi3Float64, PyFloat_AsDouble, PyFloat_FromDouble)
ACCESS(Int32, "int32", fmi3Int32, PyLong_AsLongLong, PyLong_FromLongLong)
ACCESS(Int64, "int64", fmi3Int64, PyLong_AsLongLong, PyLong_FromLongLong)
ACCESS(UInt64, "uint64", fmi3UInt64, from_ctypes, PyLong_FromLongLong)
ACCESS(Boolean, "boolean", fmi3Boolean, PyObject_IsTrue, PyBool_FromLong)

fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference references[], size_t count,
                         fmi3String values[], size_t value_count)
{
    (void)value_count;
    IN_PYTHON(read_strings(i, references, count, values));
}

fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference references[], size_t count,
                         const fmi3String values[], size_t value_count)
{
    (void)value_count;
    IN_PYTHON(WRITE(i, "set_string", references, count, PyUnicode_FromString(values[n])));
}

/* Model Exchange */

static Object *float_list(const double values[], size_t count)
{
    Object *list = PyList_New((intptr_t)count);
    for (size_t n = 0; n < count; n++)
        PyList_SetItem(list, (intptr_t)n, PyFloat_FromDouble(values[n]));
    return list;
}

static int read_floats(Instance *i, const char *method, Object *argument, double values[],
                       size_t count)
{
    Object *found = call(i, method, argument, NULL);
    for (size_t n = 0; found && n < count; n++) {
        Object *item = PyList_GetItem(found, (intptr_t)n);
        if (!item) break;
        values[n] = PyFloat_AsDouble(item);
    }
    Py_DecRef(found);
    return found != NULL;
}

static int read_count(Instance *i, const char *method, size_t *count)
{
    Object *found = call(i, method, NULL, NULL);
    if (found) *count = (size_t)PyLong_AsLongLong(found);
    Py_DecRef(found);
    return found != NULL;
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time)
{
    IN_PYTHON(simple(i, "set_time", PyFloat_FromDouble(time)));
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 states[], size_t count)
{
    IN_PYTHON(simple(i, "set_continuous_states", float_list(states, count)));
}

#define FLOATS(name, method)                                                                       \
    fmi3Status name(fmi3Instance c, fmi3Float64 values[], size_t count)                            \
    {                                                                                              \
        IN_PYTHON(read_floats(i, method, NULL, values, count));                                    \
    }
FLOATS(fmi3GetContinuousStates, "get_continuous_states")
FLOATS(fmi3GetContinuousStateDerivatives, "get_continuous_state_derivatives")
FLOATS(fmi3GetEventIndicators, "get_event_indicators")

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 values[], size_t count)
{
    IN_PYTHON(read_floats(i, "get_nominals_of_continuous_states",
                          PyLong_FromLongLong((long long)count), values, count));
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *count)
{
    IN_PYTHON(read_count(i, "get_number_of_continuous_states", count));
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *count)
{
    IN_PYTHON(read_count(i, "get_number_of_event_indicators", count));
}

/* State */

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) { IN_PYTHON(get_state(i, state)); }
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) { IN_PYTHON(set_state(i, state)); }
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *s) { IN_PYTHON((free_state(s), 1)); }

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    IN_PYTHON(state_size(i, state, size));
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte data[], size_t size)
{
    IN_PYTHON(serialize(i, state, (char *)data, size));
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte data[], size_t size,
                                   fmi3FMUState *state)
{
    IN_PYTHON(deserialize(i, (const char *)data, size, state));
}

/* What the slave hasn't got. Which arguments doesn't matter. */

#define UNSUPPORTED(name)                                                                          \
    fmi3Status name(fmi3Instance c)                                                                \
    {                                                                                              \
        if (c) say(c, fmi3Error, "logStatusError", #name " isn't supported");                      \
        return fmi3Error;                                                                          \
    }
#define UNSUPPORTED_TYPE(name) UNSUPPORTED(fmi3Get##name) UNSUPPORTED(fmi3Set##name)
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
UNSUPPORTED(fmi3GetDirectionalDerivative)
UNSUPPORTED(fmi3GetAdjointDerivative)
UNSUPPORTED(fmi3GetOutputDerivatives)
UNSUPPORTED(fmi3GetNumberOfVariableDependencies)
UNSUPPORTED(fmi3GetVariableDependencies)
UNSUPPORTED(fmi3ActivateModelPartition)
