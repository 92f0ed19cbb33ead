/* FMI's functions that both versions have, with the names and types of the one that is compiled. */

#if FMI_VERSION == 3
#define FMI_STATE(verb, more) fmi3##verb##FMUState##more
#define fmi3DeSerializeFMUState fmi3DeserializeFMUState
#define fmi3GetDerivatives fmi3GetContinuousStateDerivatives
#define VALUE_COUNT , size_t value_count
#define ARE_AS_MANY (count == value_count)
#else
#define FMI_STATE(verb, more) fmi2##verb##FMUstate##more
#define VALUE_COUNT
#define ARE_AS_MANY 1
#endif

/* A host passes more than is used here. */
#if defined __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

#define COMPONENT(c) (&((Instance *)(c))->component)
#define REFERENCES const FMI(ValueReference) references[], size_t count

static FMI(Status) status_of(int is_legal) { return is_legal ? FMI(OK) : FMI(Error); }

const char *FMI(GetVersion)(void) { return FMI(Version); }

void FMI(FreeInstance)(void *c)
{
    if (c) free(((Instance *)c)->name);
    free(c);
}

/* Switch messages on discarded steps off where categories are named, but not theirs; else on. */
FMI(Status) FMI(SetDebugLogging)(void *c, FMI(Boolean) on, size_t count,
                                 const FMI(String) categories[])
{
    if (!c || (count && !categories)) return FMI(Error);
    int is_quiet = on && count;
    for (size_t n = 0; n < count; n++) {
        const char *name = categories[n];
        if (name && (!strcmp(name, "logAll") || !strcmp(name, "logStatusDiscard"))) is_quiet = 0;
    }
    ((Instance *)c)->is_quiet = is_quiet;
    return FMI(OK);
}

FMI(Status) FMI(ExitInitializationMode)(void *c)
{
    return status_of(c && component_exit_initialization(COMPONENT(c)));
}

FMI(Status) FMI(Terminate)(void *c)
{
    if (c) component_terminate(COMPONENT(c));
    return status_of(c != NULL);
}

FMI(Status) FMI(EnterEventMode)(void *c) { return status_of(c != NULL); }

FMI(Status) FMI(Reset)(void *c)
{
    if (!c) return FMI(Error);
    component_reset(COMPONENT(c));
    ((Instance *)c)->stop_time = INFINITY;
    return FMI(OK);
}

/* VALUES */

#define HAS_ARRAYS (c && ARE_AS_MANY && (!count || (references && values)))

#define GET_AND_SET(Name, type, of)                                                                 \
    FMI(Status) FMI(Get##Name)(void *c, REFERENCES, type values[] VALUE_COUNT)                      \
    {                                                                                               \
        int is_legal = 1;                                                                           \
        double value;                                                                               \
        if (!HAS_ARRAYS) return FMI(Error);                                                         \
        for (size_t n = 0; n < count; n++) {                                                        \
            is_legal &= component_get(COMPONENT(c), references[n], of, &value);                     \
            values[n] = (type)value;                                                                \
        }                                                                                           \
        int is_failed = has_read_failed(COMPONENT(c));                                              \
        for (size_t n = 0; is_failed && n < count; n++) values[n] = (type)(of == REAL ? NAN : 0.0); \
        return status_of(is_legal);                                                                 \
    }                                                                                               \
                                                                                                    \
    FMI(Status) FMI(Set##Name)(void *c, REFERENCES, const type values[] VALUE_COUNT)                \
    {                                                                                               \
        int is_legal = 1;                                                                           \
        if (!HAS_ARRAYS) return FMI(Error);                                                         \
        for (size_t n = 0; n < count; n++)                                                          \
            is_legal &= component_set(COMPONENT(c), references[n], (double)values[n], of);          \
        return status_of(is_legal);                                                                 \
    }

GET_AND_SET(Boolean, FMI(Boolean), BOOLEAN)

/* There are no strings: each is refused. */

FMI(Status) FMI(GetString)(void *c, REFERENCES, FMI(String) values[] VALUE_COUNT)
{
    double value;
    if (!HAS_ARRAYS) return FMI(Error);
    for (size_t n = 0; n < count; n++) {
        component_get(COMPONENT(c), references[n], STRING, &value);
        values[n] = "0";
    }
    return status_of(!count);
}

FMI(Status) FMI(SetString)(void *c, REFERENCES, const FMI(String) values[] VALUE_COUNT)
{
    if (!HAS_ARRAYS) return FMI(Error);
    for (size_t n = 0; n < count; n++) component_set(COMPONENT(c), references[n], 0.0, STRING);
    return status_of(!count);
}

/* STATES */

/* A pointer to another thing, or to a state that was freed, doesn't point to itself. */
typedef struct saved {
    struct saved *itself;
    Snapshot is;
} Saved;

static int is_saved(const Saved *s) { return s && s->itself == s; }

/* Refuse a state unless it is of this component. */
static int accepts(Instance *i, int is_own)
{
    return is_own || refuse_call(&i->component, refusal(FOREIGN_STATE, 0.0, 0.0));
}

/* Memory for a state; NULL, and a message, if there is none. */
static Saved *new_state(const Instance *i)
{
    Saved *s = malloc(sizeof *s);
    if (s) s->itself = s;
    else is_illegal(i, "out of memory");
    return s;
}

FMI(Status) FMI_STATE(Get, )(void *c, void **state)
{
    if (!c || !state || (*state && !accepts(c, is_saved(*state)))) return FMI(Error);
    Saved *s = *state ? *state : new_state(c);
    if (!s) return FMI(Error);
    snapshot_copy(&s->is, &COMPONENT(c)->is);
    *state = s;
    return FMI(OK);
}

FMI(Status) FMI_STATE(Set, )(void *c, void *state)
{
    const Saved *s = state;
    if (!c || !accepts(c, is_saved(s) && s->is.is_solved == COMPONENT(c)->is.is_solved)) return FMI(Error);
    component_restore(COMPONENT(c), &s->is);
    return FMI(OK);
}

FMI(Status) FMI_STATE(Free, )(void *c, void **state)
{
    if (!c) return FMI(Error);
    if (!state || !*state) return FMI(OK);
    if (!accepts(c, is_saved(*state))) return FMI(Error);
    /* fmusim passes the state in place of its address: that is what a state begins with. */
    Saved *s = *state;
    *state = NULL;
    s->itself = NULL;
    free(s);
    return FMI(OK);
}

FMI(Status) FMI_STATE(Serialized, Size)(void *c, void *state, size_t *size)
{
    if (!c || !size || !accepts(c, is_saved(state))) return FMI(Error);
    *size = PACKED_SIZE;
    return FMI(OK);
}

FMI(Status) FMI_STATE(Serialize, )(void *c, void *state, FMI(Byte) bytes[], size_t size)
{
    if (!c || !bytes || !accepts(c, is_saved(state))) return FMI(Error);
    if (size != PACKED_SIZE)
        return status_of(is_illegal(c, "another number of bytes than a serialized state has is refused"));
    packed(&((Saved *)state)->is, (unsigned char *)bytes);
    return FMI(OK);
}

FMI(Status) FMI_STATE(DeSerialize, )(void *c, const FMI(Byte) bytes[], size_t size, void **state)
{
    Saved *s = c && bytes && state ? new_state(c) : NULL;
    if (!s) return FMI(Error);
    if (!accepts(c, unpacked(&s->is, (const unsigned char *)bytes, size))) {
        free(s);
        return FMI(Error);
    }
    *state = s;
    return FMI(OK);
}

/* MODEL EXCHANGE */

#define CAN_SOLVE(size) (is_of_kind(c, MODEL_EXCHANGE) && values && count == (size))

/* A solver sets numbers of an instance, after initialization alone. */
static FMI(Status) set_numbers(Instance *i, double to[], const double values[], size_t count)
{
    if (i->component.is.mode != STEPPING)
        return status_of(is_illegal(i, "time and states are refused before initialization has succeeded and "
                                       "after the end"));
    memcpy(to, values, count * sizeof *values);
    i->component.has_state = 0;
    return FMI(OK);
}

FMI(Status) FMI(SetTime)(void *c, double time)
{
    if (!is_of_kind(c, MODEL_EXCHANGE)) return FMI(Error);
    return set_numbers(c, &COMPONENT(c)->is.time, &time, 1);
}

FMI(Status) FMI(SetContinuousStates)(void *c, const double values[], size_t count)
{
    if (!CAN_SOLVE(STATES)) return FMI(Error);
    return set_numbers(c, COMPONENT(c)->is.states, values, STATES);
}

#define GET_VECTOR(Name, size, call)                                                                \
    FMI(Status) FMI(Get##Name)(void *c, double values[], size_t count)                              \
    {                                                                                               \
        return status_of(CAN_SOLVE(size) && (call, 1));                                             \
    }

GET_VECTOR(ContinuousStates, STATES, get_states(COMPONENT(c), values))
GET_VECTOR(NominalsOfContinuousStates, STATES, memcpy(values, NOMINALS, sizeof NOMINALS))
GET_VECTOR(EventIndicators, INDICATORS, get_indicators(COMPONENT(c), values))

FMI(Status) FMI(GetDerivatives)(void *c, double values[], size_t count)
{
    return status_of(CAN_SOLVE(STATES) && get_derivatives(COMPONENT(c), values));
}

FMI(Status) FMI(CompletedIntegratorStep)(void *c, FMI(Boolean) no_set_prior, FMI(Boolean) *event,
                                         FMI(Boolean) *terminate)
{
    if (!is_of_kind(c, MODEL_EXCHANGE) || !event || !terminate) return FMI(Error);
    *event = *terminate = 0;
    return FMI(OK);
}

/* Events and states of an instance have no modes of their own: calls are right in any order. */
FMI(Status) FMI(EnterContinuousTimeMode)(void *c) { return status_of(is_of_kind(c, MODEL_EXCHANGE)); }

/* Changes of unknowns for those of the known variables; both by value reference. */
static int get_changes(Instance *i, const unsigned unknowns[], size_t unknown_count,
                       const unsigned knowns[], size_t known_count, const double seeds[],
                       double values[])
{
    Change change = {0};
    if (!is_of_kind(i, MODEL_EXCHANGE) || (unknown_count && !(unknowns && values))
        || (known_count && !(knowns && seeds)))
        return 0;
    for (size_t n = 0; n < known_count; n++) {
        double *known = known_change(&change, knowns[n]);
        if (!known)
            return is_illegal(i, "a directional derivative with respect to another variable than an "
                                 "input or a continuous state is refused");
        *known += seeds[n];
    }
    for (size_t n = 0; n < unknown_count; n++) {
        if (!is_unknown(unknowns[n]))
            return is_illegal(i, "a directional derivative of another variable than an output, a "
                                 "derivative or an event indicator is refused");
        values[n] = unknown_change(&i->component, unknowns[n], &change);
    }
    return 1;
}
