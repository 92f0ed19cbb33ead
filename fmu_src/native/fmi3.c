/* The functions that FMI 3.0 alone has: co-simulation with event mode and early return, and Model
   Exchange. */

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediates[],
    size_t intermediate_count, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
    fmi3IntermediateUpdateCallback update)
{
    Instance *i = new_instance(CO_SIMULATION, name, token, logger, environment);
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
    return new_instance(MODEL_EXCHANGE, name, token, logger, environment);
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger, fmi3ClockUpdateCallback update,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    return new_instance(ANOTHER, name, token, logger, environment);
}

/* THE RUN */

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start_time,
                                       fmi3Boolean has_stop_time, fmi3Float64 stop_time)
{
    Instance *i = c;
    return status_of(i && set_up(i, start_time, has_stop_time, stop_time)
                     && component_enter_initialization(&i->component));
}

/* Modes that the component doesn't have. */
fmi3Status fmi3EnterStepMode(fmi3Instance c) { return status_of(is_of_kind(c, CO_SIMULATION)); }
fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) { return status_of(c != NULL); }
fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { return status_of(c != NULL); }
fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) { return status_of(c != NULL); }

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 point, fmi3Float64 size, fmi3Boolean no_set_prior,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early,
                      fmi3Float64 *last)
{
    Instance *i = c;
    int is_event = 0, is_accepted;
    if (!is_of_kind(i, CO_SIMULATION) || !event || !terminate || !early || !last) return fmi3Error;
    *event = *terminate = *early = fmi3False;
    *last = point;
    if (is_past_stop(i, point, size)) return status_of(is_illegal(i, PAST_STOP));
    int has_events = i->has_event_mode || i->may_return_early;
    double reached = point;
    i->is_stepping = 1;
    if (has_events)
        is_accepted = component_step_to_event(&i->component, point, size, i->may_return_early,
                                              &is_event, &reached);
    else is_accepted = component_step(&i->component, point, size);
    i->is_stepping = 0;
    if (!is_accepted) return fmi3Discard;
    *last = has_events ? reached : point + size;
    *event = is_event && i->has_event_mode;
    *early = *last < point + size;
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals, fmi3Boolean *jumped,
                                    fmi3Boolean *is_defined, fmi3Float64 *when)
{
    int is_legal = 1, must_stop = 0;
    Events events;
    if (!c || !again || !terminate || !nominals || !jumped || !is_defined || !when) return fmi3Error;
    Component *self = COMPONENT(c);
    *again = *nominals = *is_defined = fmi3False;
    *when = 0.0;
    if (self->is.is_solved || self->is.mode != STEPPING) is_legal = update_solution(self, &must_stop);
    /* Also those of start values that have been corrected. */
    if (!self->is.is_solved && self->is.mode == STEPPING) {
        begin_events(self, self->is.point, &events);
        *is_defined = next_event(self, &events, when);
    }
    /* Also where derivatives alone jump: some solvers restart only then. */
    *jumped = self->is.is_solved;
    *terminate = must_stop;
    return status_of(is_legal);
}

#define GET_NUMBER(Name, number)                                                                    \
    fmi3Status fmi3GetNumberOf##Name(fmi3Instance c, size_t *count)                                 \
    {                                                                                               \
        if (!is_of_kind(c, MODEL_EXCHANGE) || !count) return fmi3Error;                             \
        *count = number;                                                                            \
        return fmi3OK;                                                                              \
    }

GET_NUMBER(ContinuousStates, STATES)
GET_NUMBER(EventIndicators, INDICATORS)

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[],
                                        size_t unknown_count, const fmi3ValueReference knowns[],
                                        size_t known_count, const fmi3Float64 seeds[],
                                        size_t seed_count, fmi3Float64 values[], size_t value_count)
{
    return status_of(seed_count == known_count && value_count == unknown_count
                     && get_changes(c, unknowns, unknown_count, knowns, known_count, seeds, values));
}

GET_AND_SET(Float64, fmi3Float64, REAL)
GET_AND_SET(Int64, fmi3Int64, ENUMERATION)

/* Of these there are no variables: each is refused. */
GET_AND_SET(Float32, fmi3Float32, FLOAT32)
GET_AND_SET(Int8, fmi3Int8, INT8)
GET_AND_SET(UInt8, fmi3UInt8, UINT8)
GET_AND_SET(Int16, fmi3Int16, INT16)
GET_AND_SET(UInt16, fmi3UInt16, UINT16)
GET_AND_SET(Int32, fmi3Int32, INT32)
GET_AND_SET(UInt32, fmi3UInt32, UINT32)
GET_AND_SET(UInt64, fmi3UInt64, UINT64)

/* FUNCTIONS THAT THIS FMU DOESN'T HAVE */

#define WITHOUT(Name, ...)                                                                          \
    fmi3Status fmi3##Name(fmi3Instance c, __VA_ARGS__) { return fmi3Error; }

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
WITHOUT(GetAdjointDerivative, const fmi3ValueReference unknowns[], size_t unknown_count,
        const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seeds[],
        size_t seed_count, fmi3Float64 values[], size_t value_count)
WITHOUT(GetOutputDerivatives, REFERENCES, const fmi3Int32 orders[], fmi3Float64 values[],
        size_t value_count)
WITHOUT(ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 time)
