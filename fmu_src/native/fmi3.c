/* The functions of FMI 3.0: co-simulation with event mode and early return. */

static fmi3Status status_of(int is_legal) { return is_legal ? fmi3OK : fmi3Error; }

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediates[],
    size_t intermediate_count, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
    fmi3IntermediateUpdateCallback update)
{
    (void)path, (void)visible, (void)logging, (void)intermediates, (void)intermediate_count;
    (void)update;
    Instance *i = new_instance(1, name, token, logger, environment);
    if (!i) return NULL;
    i->has_event_mode = event_mode;
    i->may_return_early = early_return;
    return i;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String path,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger)
{
    (void)path, (void)visible, (void)logging;
    return new_instance(0, name, token, logger, environment);
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger, fmi3ClockUpdateCallback update,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    (void)path, (void)visible, (void)logging, (void)update, (void)lock, (void)unlock;
    return new_instance(0, name, token, logger, environment);
}

void fmi3FreeInstance(fmi3Instance c) { free_instance(c); }

/* There are messages on errors alone. */
fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t count,
                               const fmi3String categories[])
{
    (void)on, (void)count, (void)categories;
    return status_of(c != NULL);
}

/* THE RUN */

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start_time,
                                       fmi3Boolean has_stop_time, fmi3Float64 stop_time)
{
    Instance *i = c;
    (void)has_tolerance, (void)tolerance;
    return status_of(i && set_up(i, start_time, has_stop_time, stop_time)
                     && component_enter_initialization(&i->component));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    return status_of(c && component_exit_initialization(&((Instance *)c)->component));
}

fmi3Status fmi3Terminate(fmi3Instance c)
{
    if (c) component_terminate(&((Instance *)c)->component);
    return status_of(c != NULL);
}

fmi3Status fmi3Reset(fmi3Instance c)
{
    if (c) reset_instance(c);
    return status_of(c != NULL);
}

/* Modes that the component doesn't have. */
fmi3Status fmi3EnterEventMode(fmi3Instance c) { return status_of(c != NULL); }
fmi3Status fmi3EnterStepMode(fmi3Instance c) { return status_of(c != NULL); }
fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) { return status_of(c != NULL); }
fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { return status_of(c != NULL); }
fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) { return status_of(c != NULL); }

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 point, fmi3Float64 size, fmi3Boolean no_set_prior,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early,
                      fmi3Float64 *last)
{
    Instance *i = c;
    int is_event = 0, is_accepted;
    (void)no_set_prior;
    if (!i || !event || !terminate || !early || !last) return fmi3Error;
    *event = *terminate = *early = fmi3False;
    *last = point;
    if (is_past_stop(i, point, size)) return status_of(is_illegal(i, PAST_STOP));
    double reached = point + size;
    if (i->has_event_mode || i->may_return_early)
        is_accepted = component_step_to_event(&i->component, point, size, i->may_return_early,
                                              &is_event, &reached);
    else is_accepted = step_from_start(&i->component, point, size);
    if (!is_accepted) return fmi3Discard;
    *last = reached;
    *event = is_event && i->has_event_mode;
    *early = reached < point + size;
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals, fmi3Boolean *jumped,
                                    fmi3Boolean *is_defined, fmi3Float64 *when)
{
    int must_stop, is_known;
    double next = 0.0;
    if (!c || !again || !terminate || !nominals || !jumped || !is_defined || !when) return fmi3Error;
    int is_legal = component_update(&((Instance *)c)->component, &must_stop, &is_known, &next);
    *again = *nominals = *jumped = fmi3False;
    *terminate = must_stop;
    *is_defined = is_known;
    *when = next;
    return status_of(is_legal);
}

/* VALUES */

static int has_arrays(fmi3Instance c, const void *references, const void *values, size_t count,
                      size_t value_count)
{
    return c && count == value_count && (!count || (references && values));
}

#define GET_AND_SET(Name, of)                                                                       \
    fmi3Status fmi3Get##Name(fmi3Instance c, const fmi3ValueReference references[], size_t count,   \
                             fmi3##Name values[], size_t value_count)                               \
    {                                                                                               \
        int is_legal = 1;                                                                           \
        double value;                                                                               \
        if (!has_arrays(c, references, values, count, value_count)) return fmi3Error;               \
        Host host = hold(&((Instance *)c)->component);                                              \
        for (size_t n = 0; n < count; n++) {                                                        \
            is_legal &= component_get(&((Instance *)c)->component, references[n], of, &value);      \
            values[n] = (fmi3##Name)value;                                                          \
        }                                                                                           \
        release(&host);                                                                             \
        int is_failed = has_read_failed(&((Instance *)c)->component);                               \
        for (size_t n = 0; is_failed && n < count; n++) values[n] = (fmi3##Name)(of == REAL ? NAN : 0.0);\
        return status_of(is_legal);                                                                 \
    }                                                                                               \
                                                                                                    \
    fmi3Status fmi3Set##Name(fmi3Instance c, const fmi3ValueReference references[], size_t count,   \
                             const fmi3##Name values[], size_t value_count)                         \
    {                                                                                               \
        int is_legal = 1;                                                                           \
        if (!has_arrays(c, references, values, count, value_count)) return fmi3Error;               \
        for (size_t n = 0; n < count; n++)                                                          \
            is_legal &= component_set(&((Instance *)c)->component, references[n],                   \
                                      (double)values[n], of);                                       \
        return status_of(is_legal);                                                                 \
    }

GET_AND_SET(Float64, REAL)
GET_AND_SET(Int64, ENUMERATION)
GET_AND_SET(Boolean, BOOLEAN)

/* Of these there are no variables: each is refused. */
GET_AND_SET(Float32, FLOAT32)
GET_AND_SET(Int8, INT8)
GET_AND_SET(UInt8, UINT8)
GET_AND_SET(Int16, INT16)
GET_AND_SET(UInt16, UINT16)
GET_AND_SET(Int32, INT32)
GET_AND_SET(UInt32, UINT32)
GET_AND_SET(UInt64, UINT64)

fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference references[], size_t count,
                         fmi3String values[], size_t value_count)
{
    double value;
    if (!has_arrays(c, references, values, count, value_count)) return fmi3Error;
    for (size_t n = 0; n < count; n++) {
        component_get(&((Instance *)c)->component, references[n], STRING, &value);
        values[n] = "0";
    }
    return status_of(!count);
}

fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference references[], size_t count,
                         const fmi3String values[], size_t value_count)
{
    if (!has_arrays(c, references, values, count, value_count)) return fmi3Error;
    for (size_t n = 0; n < count; n++)
        component_set(&((Instance *)c)->component, references[n], 0.0, STRING);
    return status_of(!count);
}

/* STATES */

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    return status_of(c && save(c, state));
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state)
{
    return status_of(c && restore(c, state));
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    return status_of(c && drop(c, state));
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    return status_of(c && serialized_size(c, state, size));
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    return status_of(c && serialize(c, state, bytes, size));
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState *state)
{
    return status_of(c && deserialize(c, bytes, size, state));
}

/* FUNCTIONS THAT THIS FMU DOESN'T HAVE */

#if defined __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

#define WITHOUT(Name, ...)                                                                          \
    fmi3Status fmi3##Name(fmi3Instance c, __VA_ARGS__) { return fmi3Error; }
#define REFERENCES const fmi3ValueReference references[], size_t count
#define DERIVATIVE                                                                                  \
    const fmi3ValueReference unknowns[], size_t unknown_count, const fmi3ValueReference knowns[],   \
        size_t known_count, const fmi3Float64 seeds[], size_t seed_count, fmi3Float64 values[],     \
        size_t value_count

WITHOUT(GetBinary, REFERENCES, size_t sizes[], fmi3Binary values[], size_t value_count)
WITHOUT(SetBinary, REFERENCES, const size_t sizes[], const fmi3Binary values[], size_t value_count)
WITHOUT(GetClock, REFERENCES, fmi3Clock values[])
WITHOUT(SetClock, REFERENCES, const fmi3Clock values[])
WITHOUT(GetIntervalDecimal, REFERENCES, fmi3Float64 values[], fmi3IntervalQualifier qualifiers[])
WITHOUT(GetIntervalFraction, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
        fmi3IntervalQualifier qualifiers[])
WITHOUT(GetShiftDecimal, REFERENCES, fmi3Float64 values[])
WITHOUT(GetShiftFraction, REFERENCES, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
WITHOUT(SetIntervalDecimal, REFERENCES, const fmi3Float64 values[])
WITHOUT(SetIntervalFraction, REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
WITHOUT(SetShiftDecimal, REFERENCES, const fmi3Float64 values[])
WITHOUT(SetShiftFraction, REFERENCES, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
WITHOUT(GetNumberOfVariableDependencies, fmi3ValueReference reference, size_t *count)
WITHOUT(GetVariableDependencies, fmi3ValueReference dependent, size_t elements[],
        fmi3ValueReference independents[], size_t independent_elements[],
        fmi3DependencyKind kinds[], size_t count)
WITHOUT(GetDirectionalDerivative, DERIVATIVE)
WITHOUT(GetAdjointDerivative, DERIVATIVE)
WITHOUT(GetOutputDerivatives, REFERENCES, const fmi3Int32 orders[], fmi3Float64 values[],
        size_t value_count)
WITHOUT(ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 time)
WITHOUT(CompletedIntegratorStep, fmi3Boolean no_set_prior, fmi3Boolean *event,
        fmi3Boolean *terminate)
WITHOUT(SetTime, fmi3Float64 time)
WITHOUT(SetContinuousStates, const fmi3Float64 values[], size_t count)
WITHOUT(GetContinuousStates, fmi3Float64 values[], size_t count)
WITHOUT(GetContinuousStateDerivatives, fmi3Float64 values[], size_t count)
WITHOUT(GetNominalsOfContinuousStates, fmi3Float64 values[], size_t count)
WITHOUT(GetEventIndicators, fmi3Float64 values[], size_t count)
WITHOUT(GetNumberOfEventIndicators, size_t *count)
WITHOUT(GetNumberOfContinuousStates, size_t *count)
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { return fmi3Error; }
