/* component/component.py and modes.py: one instance.

   A communication step only advances the clock; outputs are evaluated when they are read. A refused
   call changes nothing: its effects are computed first, and take place only as a whole. */

enum { MOST_ILLEGAL = 8, MOST_REFUSALS = SETTABLE + 1 + MOST_ILLEGAL, SENTENCE_SIZE = 4096 };

/* Modes of an instance, in the order in which a host passes through them. Where initialization has
   ended on start values that are refused, parameters may still be set. */
typedef enum { INSTANTIATED, INITIALIZATION, START_REFUSED, STEPPING, TERMINATED } Mode;

/* Everything that a state of the instance has. */
typedef struct {
    double values[SETTABLE]; /* as the host sees them */
    Mode mode;
    /* Why steps are refused until it is corrected, by variable; and why the next step alone is:
       illegal calls, which nothing can correct. */
    int refused_count, illegal_count;
    Refusal refused[SETTABLE + 1], illegal[MOST_ILLEGAL];
    /* The host's time at the start of the run, and when the clock stood at 0, s. */
    double start_time, origin;
    double point;     /* where the host's next step is expected to begin, s */
    /* Steps of one size (s; 0: none yet) from an instant on, under the same inputs, and how many of
       them were accepted. */
    Instant begin;
    double last_step, count;
    Inputs inputs;
    /* Before stepping the impact is that of the present values, on demand. */
    int has_impact;
    /* In Model Exchange: the host's time, s, and its solver's states; whether a drag has acted. */
    int is_solved, is_dragged;
    double time, states[4];
    Parameters parameters;
    Impact impact;
} Snapshot;

typedef void (*Report)(void *context, const char *sentence);

typedef struct {
    Report report;
    void *context;
    double size; /* the last step size, s, if such a step needs only its point checked; or NaN */
    int point_is_free; /* whether the next step may begin anywhere: after a restored state */
    int has_failed; /* whether a read can't be computed */
    int has_state;  /* whether the state at this communication point has been read */
    State state, solver; /* as outputs and, in Model Exchange, the solver have it */
    Snapshot is;
} Component;

/* Of model_exchange.c. */
static void begin_solution(Component *c);
static void evaluate_solution(Component *c);

/* REFUSALS */

/* Report refusals together; with a reason, in its sentence about them. */
static void report(const Component *c, const Refusal refusals[], int count, Reason about)
{
    char listed[SENTENCE_SIZE] = "", whole[SENTENCE_SIZE] = "";
    Text list = {listed, listed + sizeof listed - 1}, text = {whole, whole + sizeof whole - 1};
    for (int n = 0; n < count; n++) {
        if (n) put(&list, "; ");
        put_refusal(&list, &refusals[n]);
    }
    put_sentence(&text, about ? SENTENCES[about] : "%s", NULL, NULL, listed);
    c->report(c->context, whole);
}

static void report_one(const Component *c, Refusal refusal) { report(c, &refusal, 1, FINE); }

static int place_of_refusal(const Component *c, int place)
{
    int n = 0;
    while (n < c->is.refused_count && c->is.refused[n].place != place) n++;
    return n;
}

/* Refuse steps until this variable is corrected. */
static void refuse(Component *c, Refusal refusal)
{
    int n = place_of_refusal(c, refusal.place);
    if (n == c->is.refused_count) c->is.refused_count++;
    c->is.refused[n] = refusal;
    c->size = NAN;
    report_one(c, refusal);
}

static void correct(Component *c, int place)
{
    int n = place_of_refusal(c, place);
    if (n == c->is.refused_count) return;
    Refusal *from = &c->is.refused[n];
    memmove(from, from + 1, (size_t)(--c->is.refused_count - n) * sizeof *from);
}

/* Refuse the next step, for an illegal call; always 0. */
static int refuse_call(Component *c, Refusal refusal)
{
    Snapshot *is = &c->is;
    if (is->illegal_count == MOST_ILLEGAL)
        memmove(is->illegal, is->illegal + 1, (size_t)--is->illegal_count * sizeof refusal);
    is->illegal[is->illegal_count++] = refusal;
    c->size = NAN;
    report_one(c, refusal);
    return 0;
}

static Inputs inputs_of(const double values[])
{
    return (Inputs){values[0], values[1], values[2], values[3]};
}

static Parameters parameters_of(const double values[])
{
    Parameters p;
    memcpy(&p, values + INPUTS, sizeof p);
    return p;
}

/* INITIALIZATION */

/* Steps of this size from an instant on. */
static void begin_steps(Component *c, Instant begin, double size)
{
    c->is.begin = begin;
    c->is.last_step = size;
    c->is.count = 0.0;
    c->has_state = 0;
}

/* The impact of the present values from the start: the ball lies at 0, the club face at -gap. Or why
   they are rejected together: then that of bodies that never meet. */
static Refusal begin_run(Component *c)
{
    const Instant start = {0.0, 0.0};
    Snapshot *is = &c->is;
    Parameters *p = &is->parameters;
    is->inputs = inputs_of(is->values);
    *p = parameters_of(is->values);
    Refusal why = conflict(p, is->inputs);
    if (why.reason) is->inputs = (Inputs){1.0, 0.0, p->ball_speed, 0.0};
    begin_approach(&is->impact, p, is->inputs.club_speed, start, 0.0, (Instant){-p->gap, 0.0});
    is->has_impact = 1;
    begin_steps(c, start, 0.0);
    if (is->is_solved) begin_solution(c);
    return why;
}

static void component_reset(Component *c)
{
    int is_solved = c->is.is_solved;
    memset(&c->is, 0, sizeof c->is);
    for (int n = 0; n < SETTABLE; n++) c->is.values[n] = TABLE[n].start;
    c->is.is_solved = is_solved;
    c->point_is_free = c->has_failed = c->has_state = 0;
    c->size = NAN;
}

/* The host's time at the start, s. Returns whether it is accepted at all in this mode. */
static int component_set_up(Component *c, double start_time)
{
    if (c->is.mode != INSTANTIATED) return refuse_call(c, refusal(LATE_SET_UP, 0.0, 0.0));
    if (!isfinite(start_time)) {
        refuse(c, refusal(START_TIME, start_time, 0.0));
        return 1;
    }
    correct(c, SETTABLE);
    c->is.start_time = c->is.origin = c->is.point = start_time;
    return 1;
}

/* From here on outputs are those of the present values. */
static int component_enter_initialization(Component *c)
{
    if (c->is.mode != INSTANTIATED) return refuse_call(c, refusal(ENTERED_TWICE, 0.0, 0.0));
    c->is.mode = INITIALIZATION;
    return 1;
}

/* Refusals of parameters, in the list; how many. */
static int refused_parameters(const Component *c, Refusal list[])
{
    int count = 0;
    for (int n = 0; n < c->is.refused_count; n++) {
        int place = c->is.refused[n].place;
        if (place >= INPUTS && place < SETTABLE) list[count++] = c->is.refused[n];
    }
    return count;
}

/* Fix the parameters; or return how many refusals, in the list, speak against it. */
static int start_run(Component *c, Refusal list[])
{
    int count = refused_parameters(c, list);
    if (!count) {
        list[0] = begin_run(c);
        count = list[0].reason != FINE;
    }
    if (!count) c->is.mode = STEPPING;
    return count;
}

/* Fix the parameters, as soon as they can be used. Returns whether all start values can be used; if
   not, steps are refused until they can. */
static int component_exit_initialization(Component *c)
{
    Refusal list[MOST_REFUSALS];
    if (c->is.mode != INITIALIZATION) return refuse_call(c, refusal(NOT_ENTERED, 0.0, 0.0));
    c->is.mode = START_REFUSED;
    int count = start_run(c, list);
    /* A refused value has been reported when it was set. */
    if (count && !refused_parameters(c, list)) report(c, list, count, FINE);
    return !count && !c->is.refused_count;
}

/* The end of the run: values can still be read, nothing else. */
static void component_terminate(Component *c)
{
    c->is.mode = TERMINATED;
    c->size = NAN;
}

/* STEPS */

/* The instant after so many steps, without loss. */
static Instant instant_after(const Snapshot *is, double count)
{
    double size = is->last_step;
    if (!count) return is->begin;
    if (count == 1.0) return added(is->begin, size);
    /* Two factors of at most 26 bits have an exact product. */
    double high = 134217729.0 * size;
    high -= high - size;
    return added(added(is->begin, count * high), count * (size - high));
}

/* The present instant: the sum of the accepted steps; in Model Exchange, the host's time. */
static Instant instant_now(const Component *c)
{
    return c->is.is_solved ? (Instant){c->is.time, 0.0} : instant_after(&c->is, c->is.count);
}

/* The impact in the phase that holds the present instant. */
static Impact *present(Component *c)
{
    if (c->is.is_solved) {
        if (!c->has_state) evaluate_solution(c);
        c->has_state = 1;
        return &c->is.impact;
    }
    if (!c->is.has_impact) begin_run(c);
    /* A contact that can't be computed isn't tried again for each output. */
    if (!c->has_failed)
        c->has_failed = !advance(&c->is.impact, &c->is.parameters, c->is.inputs, instant_now(c));
    return &c->is.impact;
}

/* Why the present impact can't be computed, once; the state isn't valid then. */
static Refusal take_failure(Component *c)
{
    if (!c->has_failed) return ACCEPTED;
    c->has_failed = c->has_state = 0;
    return preventing(contact_failure(&c->is.impact.contact), NOT_COMPUTABLE, 0.0, 0.0);
}

/* All refusals that speak against going on, in the list; how many. Those of illegal calls are gone with
   that. */
static int take_refusals(Component *c, Refusal list[])
{
    Snapshot *is = &c->is;
    int count = is->mode == START_REFUSED ? start_run(c, list) : 0;
    if (count || is->mode != STEPPING) return count;
    count = is->refused_count + is->illegal_count;
    memcpy(list, is->refused, (size_t)is->refused_count * sizeof *list);
    memcpy(list + is->refused_count, is->illegal, (size_t)is->illegal_count * sizeof *list);
    is->illegal_count = 0;
    return count;
}

/* Whether steps are possible in this mode, and no value must be corrected; else why not is reported. */
static int may_step(Component *c)
{
    Refusal list[MOST_REFUSALS];
    int count = take_refusals(c, list);
    if (!count && c->is.mode != STEPPING) {
        Reason reason = c->is.mode == TERMINATED ? STEP_AFTER_END : STEP_BEFORE_START;
        report_one(c, refusal(reason, 0.0, 0.0));
        return 0;
    }
    if (count) report(c, list, count, UNTIL_CORRECTED);
    return !count;
}

/* Whether a communication point and a step size have a sum, which is the end of the step. Here and below
   comparisons are quiet of NaN: a host may trap exceptions. */
static int are_times(double point, double size)
{
    return islessequal(fabs(point), LARGEST_TIME) && islessequal(fabs(size), LARGEST_TIME);
}

/* Whether a step begins where the last one ended, within the host's rounding errors. */
static int goes_on(const Snapshot *is, double point, double size)
{
    double time = fabs(is->point);
    double allowed = smaller(POINT_TOLERANCE * larger(size, time), MOST_OF_STEP * size);
    /* Far from 0 doubles themselves may be further apart than steps. */
    return islessequal(fabs(point - is->point), larger(allowed, 1e-15 * time));
}

/* The origin of the host's time if a step begins at this point; or why it may not. */
static Refusal check_point(Component *c, double point, double size, double *origin)
{
    Snapshot *is = &c->is;
    *origin = is->origin;
    if (point == is->point || goes_on(is, point, size)) return ACCEPTED;
    if (!c->point_is_free || !are_times(point, size))
        return refusal(POINT_JUMPS, point, is->point);
    /* After a restored state the host's time may go on from anywhere; a touch to come moves. */
    const Impact *i = present(c);
    double now = instant_now(c).high;
    Refusal why = take_failure(c);
    if (!why.reason && (i->phase == APPROACH || i->touch.instant.high >= now)) *origin = point - now;
    return why;
}

/* Why this touch would be refused in a step of this size; whether one is ahead that would be. */
static Refusal check_touch(const Component *c, const Approach *a, Inputs inputs, double size,
                           int *is_ahead)
{
    *is_ahead = 0;
    if (!c->is.parameters.restitution_at_rest && !inputs.club_force) return ACCEPTED;
    Refusal why = refusal_of_touch(&c->is.parameters, inputs);
    *is_ahead = why.reason != FINE;
    double left = a->duration - elapsed(a->begin, instant_now(c));
    return *is_ahead && left <= size * (1.0 + 1e-12) ? why : ACCEPTED;
}

static int are_equal(Inputs a, Inputs b)
{
    return a.k == b.k && a.b == b.b && a.club_speed == b.club_speed && a.club_force == b.club_force;
}

/* Why these inputs are refused from now on; else the impact that they lead to is `changed`. */
static Refusal change(const Component *c, Inputs inputs, Impact *changed)
{
    const Snapshot *is = &c->is;
    Refusal why = conflict(&is->parameters, inputs);
    if (why.reason) return why;
    impact_copy(changed, &is->impact);
    why = change_inputs(changed, &is->parameters, is->inputs, inputs, instant_now(c));
    return why.reason ? preventing(why, CHANGE_REFUSED, inputs.k, inputs.b) : ACCEPTED;
}

/* Make a step, unless it is refused: then why is reported, and nothing has changed. */
static int check_step(Component *c, double point, double size)
{
    Snapshot *is = &c->is;
    Impact changed;
    double origin;
    int is_ahead = 0;
    if (!(isless(0.0, size) && islessequal(size, LARGEST_TIME))) {
        report_one(c, refusal(STEP_SIZE, size, 0.0));
        return 0;
    }
    if ((is->mode != STEPPING || is->refused_count || is->illegal_count) && !may_step(c)) return 0;
    Refusal why = check_point(c, point, size, &origin);
    Inputs inputs = inputs_of(is->values);
    int has_changed = !are_equal(inputs, is->inputs);
    if (!why.reason && has_changed) why = change(c, inputs, &changed);
    const Impact *impact = has_changed ? &changed : &is->impact;
    if (!why.reason && is_undecided(impact, instant_now(c)))
        why = check_touch(c, &impact->approach, inputs, size, &is_ahead);
    if (why.reason) {
        report_one(c, why);
        return 0;
    }
    if (has_changed || size != is->last_step) begin_steps(c, instant_now(c), size);
    if (has_changed) impact_copy(&is->impact, &changed);
    is->inputs = inputs;
    is->origin = origin;
    is->count += 1.0;
    /* A touch ahead that would be refused is checked at every step. */
    if (!is_ahead) c->size = size;
    return 1;
}

/* One communication step from the host's communication point on, both in s. Returns whether it was
   accepted; if not, a message says why, and nothing has changed. */
static int component_step(Component *c, double point, double size)
{
    if (size == c->size && (point == c->is.point || goes_on(&c->is, point, size))) {
        c->is.count += 1.0;
    } else {
        c->size = NAN;
        if (!check_step(c, point, size)) return 0;
        c->point_is_free = 0;
    }
    c->is.point = point + size;
    c->has_state = 0;
    return 1;
}

/* VALUES */

/* Set an input or parameter that the host takes for this type; a refused one keeps its value. Returns
   whether the call was legal: a value out of range is, and refuses steps until it is corrected. */
static int component_set(Component *c, uint32_t reference, double value, Type type)
{
    int place = place_of(reference);
    if (place < 0 || place >= SETTABLE || TABLE[place].type != type)
        return refuse_call(c, refusal(NOT_SETTABLE, reference, type));
    const Variable *v = &TABLE[place];
    double now = c->is.values[place];
    if (c->is.mode == TERMINATED)
        return refuse_call(c, refusal_of(reference, SET_AFTER_END, 0.0, 0.0));
    if (!(islessequal(v->low, value) && islessequal(value, v->high))) {
        refuse(c, refusal_of(reference, OUT_OF_RANGE, value, 0.0));
        return 1;
    }
    if (v->causality == PARAMETER && c->is.mode == STEPPING && value != now) {
        refuse(c, refusal_of(reference, FIXED, value, now));
        return 0;
    }
    correct(c, place);
    if (value == now) return 1;
    c->is.values[place] = value;
    c->size = NAN;
    if (c->is.is_solved) c->has_state = 0;
    if (c->is.mode < STEPPING) c->is.has_impact = c->has_state = 0;
    return 1;
}

/* The state in a contact, in the scaled time from its start, or from the first step after that. */
static State contact_state(const Component *c, Impact *i)
{
    const Snapshot *is = &c->is;
    double scale = contact_scale(&i->contact), offset = since(i->begin, is->begin), first = 0.0;
    if (offset < 0.0 && is->last_step) {
        /* Steps before the phase began would only cost digits. */
        first = ceil(-offset / is->last_step - 1e-9);
        offset = since(i->begin, instant_after(is, first));
    }
    double scaled_time = scale * offset + (is->count - first) * (scale * is->last_step);
    State s = contact_dense(&i->contact, scaled_time);
    double t = elapsed(i->begin, instant_now(c));
    /* Quiet of NaN: of a contact that can't be computed. */
    if (!t || isless(s.force, 0.0) || isless(s.compression, 0.0))
        clamp_state(i, &is->parameters, &s, t);
    s.x_club += i->touch.x_ball;
    s.x_ball += i->touch.x_ball;
    return s;
}

/* The state at this communication point; before stepping, under the present values. */
static const State *state_now(Component *c)
{
    if (!c->has_state) {
        Impact *i = present(c);
        if (c->is.is_solved) return &c->state;
        c->state = i->phase == CONTACT ? contact_state(c, i)
                                       : impact_state(i, &c->is.parameters, instant_now(c));
        c->has_state = 1;
    }
    return &c->state;
}
