/* The functions that FMI 2.0 alone has, for co-simulation and Model Exchange. */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *host, fmi2Boolean visible,
                              fmi2Boolean logging)
{
    Kind kind = type == fmi2CoSimulation    ? CO_SIMULATION
                : type == fmi2ModelExchange ? MODEL_EXCHANGE
                                            : ANOTHER;
    return new_instance(kind, name, guid, host ? host->logger : NULL,
                        host ? host->componentEnvironment : NULL);
}

/* THE RUN */

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start_time, fmi2Boolean has_stop_time, fmi2Real stop_time)
{
    return status_of(c && set_up(c, start_time, has_stop_time, stop_time));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return status_of(c && component_enter_initialization(COMPONENT(c)));
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real point, fmi2Real size, fmi2Boolean no_set_prior)
{
    Instance *i = c;
    if (!is_of_kind(i, CO_SIMULATION)) return fmi2Error;
    if (is_past_stop(i, point, size)) return status_of(is_illegal(i, PAST_STOP));
    i->is_stepping = 1;
    i->is_refused = !component_step(&i->component, point, size);
    i->is_stepping = 0;
    return i->is_refused ? fmi2Discard : fmi2OK;
}

/* After a step that was refused: it is to be made again, or the run ends. */

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    if (!c || !value || kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = COMPONENT(c)->is.point;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    if (!c || !value || kind != fmi2Terminated) return fmi2Discard;
    *value = ((Instance *)c)->is_refused;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    int must_stop;
    if (!is_of_kind(c, MODEL_EXCHANGE) || !info) return fmi2Error;
    int is_legal = update_solution(COMPONENT(c), &must_stop);
    memset(info, 0, sizeof *info);
    info->terminateSimulation = must_stop;
    /* Also where derivatives alone jump: some solvers restart only then. */
    info->valuesOfContinuousStatesChanged = fmi2True;
    return status_of(is_legal);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[],
                                        size_t unknown_count, const fmi2ValueReference knowns[],
                                        size_t known_count, const fmi2Real seeds[],
                                        fmi2Real values[])
{
    return status_of(get_changes(c, unknowns, unknown_count, knowns, known_count, seeds, values));
}

GET_AND_SET(Real, fmi2Real, REAL)
GET_AND_SET(Integer, fmi2Integer, ENUMERATION)

/* FUNCTIONS THAT THIS FMU DOESN'T HAVE */

#define WITHOUT(Name, status, ...)                                                                  \
    fmi2Status fmi2##Name(fmi2Component c, __VA_ARGS__) { return status; }

WITHOUT(GetStatus, fmi2Discard, const fmi2StatusKind kind, fmi2Status *value)
WITHOUT(GetIntegerStatus, fmi2Discard, const fmi2StatusKind kind, fmi2Integer *value)
WITHOUT(GetStringStatus, fmi2Discard, const fmi2StatusKind kind, fmi2String *value)
WITHOUT(SetRealInputDerivatives, fmi2Error, REFERENCES, const fmi2Integer orders[],
        const fmi2Real values[])
WITHOUT(GetRealOutputDerivatives, fmi2Error, REFERENCES, const fmi2Integer orders[],
        fmi2Real values[])
fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
