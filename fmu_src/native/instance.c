/* Instances, for both versions of FMI.

   An illegal call returns Error, as in Reference-FMUs: an unknown value reference, setting an output or
   a fixed parameter, a second initialization, a damaged state, a NULL pointer. A step that a refused
   value prevents returns Discard; it may be made again once that value is corrected. */

/* How far (relative to the step) a step may end beyond a defined stop time. */
#define STOP_TOLERANCE 1e-6

#if FMI_VERSION == 3
#define FMI(name) fmi3##name
typedef fmi3LogMessageCallback Logger;
#else
#define FMI(name) fmi2##name
typedef fmi2CallbackLogger Logger;
#endif

typedef struct {
    Component component;
    Logger logger;
    void *environment; /* of the logger */
    char *name;
    double stop_time; /* s; infinite if it isn't defined */
    int is_refused;   /* whether the last step was */
    int is_stepping;  /* a message is then about a discarded step */
    int is_quiet;     /* the host wants no messages on discarded steps */
    int has_event_mode, may_return_early;
} Instance;

/* MESSAGES */

static void send(Logger logger, void *environment, const char *name, FMI(Status) status,
                 const char *sentence)
{
    const char *category = status == FMI(Discard) ? "logStatusDiscard" : "logStatusError";
    if (!logger) return;
#if FMI_VERSION == 3
    (void)name;
    logger(environment, status, category, sentence);
#else
    /* A host takes it for a format. */
    char format[2 * SENTENCE_SIZE];
    Text t = {format, format + sizeof format - 1};
    for (; *sentence; sentence++) {
        if (*sentence == '%') put_character(&t, '%');
        put_character(&t, *sentence);
    }
    logger(environment, name, status, category, format);
#endif
}

/* Errors are sent whatever the host has switched off, as FMI demands. */
static void send_report(void *context, const char *sentence)
{
    const Instance *i = context;
    FMI(Status) status = i->is_stepping ? FMI(Discard) : FMI(Error);
    if (!i->is_stepping || !i->is_quiet) send(i->logger, i->environment, i->name, status, sentence);
}

/* Send a message on an illegal call; always 0. */
static int is_illegal(const Instance *i, const char *sentence)
{
    send(i->logger, i->environment, i->name, FMI(Error), sentence);
    return 0;
}

/* LIFE */

typedef enum { CO_SIMULATION, MODEL_EXCHANGE, ANOTHER } Kind;

/* An instance of this kind, with this GUID or token; NULL, and a message, if there is none. */
static Instance *new_instance(Kind kind, const char *name, const char *token, Logger logger,
                              void *environment)
{
    char text[SENTENCE_SIZE] = "";
    Text why = {text, text + sizeof text - 1};
    if (!name) name = "";
    if (kind == ANOTHER) {
        put(&why, "this interface is refused: this FMU has co-simulation and Model Exchange");
    } else if (!token || strcmp(token, TOKEN)) {
        put(&why, "GUID or token = ");
        put(&why, token ? token : "NULL");
        put(&why, " is refused: this FMU has " TOKEN);
    }
    Instance *i = *text ? NULL : calloc(1, sizeof *i);
    char *copy = i ? malloc(strlen(name) + 1) : NULL;
    if (!copy) {
        send(logger, environment, name, FMI(Error), *text ? text : "out of memory");
        free(i);
        return NULL;
    }
    i->logger = logger;
    i->environment = environment;
    i->name = strcpy(copy, name);
    i->stop_time = INFINITY;
    i->component.report = send_report;
    i->component.context = i;
    i->component.is.is_solved = kind == MODEL_EXCHANGE;
    component_reset(&i->component);
    return i;
}

/* The experiment; returns whether it may be set up now. */
static int set_up(Instance *i, double start_time, int has_stop_time, double stop_time)
{
    if (!component_set_up(&i->component, start_time)) return 0;
    i->stop_time = has_stop_time && !isnan(stop_time) ? stop_time : INFINITY;
    return 1;
}

/* Whether an instance is of this kind; a function of another interface is refused. */
static int is_of_kind(const Instance *i, Kind kind)
{
    if (!i) return 0;
    if (i->component.is.is_solved == (kind == MODEL_EXCHANGE)) return 1;
    if (kind == MODEL_EXCHANGE)
        return is_illegal(i, "a function of Model Exchange is refused: this instance makes steps");
    return is_illegal(i, "a step is refused: this instance is for Model Exchange");
}

static int is_past_stop(const Instance *i, double point, double size)
{
    return are_times(point, size) && point + size > i->stop_time + STOP_TOLERANCE * size;
}

static const char *const PAST_STOP = "a step past the stop time of the experiment is refused";
