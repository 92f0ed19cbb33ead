/* The functions of FMI 2.0 for co-simulation. */

static fmi2Status status_of(int is_legal) { return is_legal ? fmi2OK : fmi2Error; }

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *host, fmi2Boolean visible,
                              fmi2Boolean logging)
{
    (void)location, (void)visible, (void)logging;
    return new_instance(type == fmi2CoSimulation, name, guid, host ? host->logger : NULL,
                        host ? host->componentEnvironment : NULL);
}

void fmi2FreeInstance(fmi2Component c) { free_instance(c); }

/* There are messages on errors alone. */
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count,
                               const fmi2String categories[])
{
    (void)on, (void)count, (void)categories;
    return status_of(c != NULL);
}

/* THE RUN */

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start_time, fmi2Boolean has_stop_time, fmi2Real stop_time)
{
    (void)has_tolerance, (void)tolerance;
    return status_of(c && set_up(c, start_time, has_stop_time, stop_time));
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
    if (c) reset_instance(c);
    return status_of(c != NULL);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real point, fmi2Real size, fmi2Boolean no_set_prior)
{
    Instance *i = c;
    (void)no_set_prior;
    if (!i) return fmi2Error;
    if (is_past_stop(i, point, size)) return status_of(is_illegal(i, PAST_STOP));
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

static int has_arrays(fmi2Component c, const void *references, const void *values, size_t count)
{
    return c && (!count || (references && values));
}

#define GET_AND_SET(Name, type, of)                                                                 \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference references[], size_t count,  \
                             type values[])                                                         \
    {                                                                                               \
        int is_legal = 1;                                                                           \
        double value;                                                                               \
        if (!has_arrays(c, references, values, count)) return fmi2Error;                            \
        Host host = hold(&((Instance *)c)->component);                                              \
        for (size_t n = 0; n < count; n++) {                                                        \
            is_legal &= component_get(&((Instance *)c)->component, references[n], of, &value);      \
            values[n] = (type)value;                                                                \
        }                                                                                           \
        release(&host);                                                                             \
        int is_failed = has_read_failed(&((Instance *)c)->component);                               \
        for (size_t n = 0; is_failed && n < count; n++) values[n] = (type)(of == REAL ? NAN : 0.0); \
        return status_of(is_legal);                                                                 \
    }                                                                                               \
                                                                                                    \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference references[], size_t count,  \
                             const type values[])                                                   \
    {                                                                                               \
        int is_legal = 1;                                                                           \
        if (!has_arrays(c, references, values, count)) return fmi2Error;                            \
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
    if (!has_arrays(c, references, values, count)) return fmi2Error;
    for (size_t n = 0; n < count; n++) {
        component_get(&((Instance *)c)->component, references[n], STRING, &value);
        values[n] = "0";
    }
    return status_of(!count);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference references[], size_t count,
                         const fmi2String values[])
{
    if (!has_arrays(c, references, values, count)) return fmi2Error;
    for (size_t n = 0; n < count; n++)
        component_set(&((Instance *)c)->component, references[n], 0.0, STRING);
    return status_of(!count);
}

/* STATES */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return status_of(c && save(c, state));
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    return status_of(c && restore(c, state));
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return status_of(c && drop(c, state));
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    return status_of(c && serialized_size(c, state, size));
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    return status_of(c && serialize(c, state, (unsigned char *)bytes, size));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state)
{
    return status_of(c && deserialize(c, (const unsigned char *)bytes, size, state));
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
